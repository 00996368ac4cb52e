"""Overhead of a campaign: planning (a dry run), and the start of each job.

    .venv/bin/python benchmarks/planning.py             # dry runs of 50 (a study has no fewer) to 5000 simulations
    .venv/bin/python benchmarks/planning.py --run 300   # and a real campaign of 300 very short simulations

Every size is a separate study in a temporary folder, with the project's rules and sources. Prints a table and, last, one JSON line.
Processor time is given in addition to wall time, because it depends less on the machine's load.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import yaml

ROOT = Path(__file__).resolve().parents[1]
SIZES = (50, 100, 300, 1000, 3000, 5000)
#: Minimum sizes that a study allows: values of rolling friction, radii, stresses on the lid, seeds of the base set.
ROLLING, RADII_M, STRESSES_PA, LEAST_SEEDS = [0.1, 0.2, 0.3], [5.0e-5, 1.0e-4, 2.0e-4, 4.0e-4], [250.0, 500.0, 1000.0], 2
#: Smallest and shortest tests that the configuration allows.
HEAP = {"n_particles": 50, "tube_diameter_ratio": 5.0, "plate_half_width_ratio": 20.0, "max_time_s": 1e-3}
BOX = {"length_ratio": 10.0, "height_ratio": 8.0, "width_ratio": 5.0, "displacement_ratio": 0.05}
QUICK = {"lift_speed_m_s": 1.0, "shear_inertial_number": 0.1, "repose_stiffness_number": 2000.0, "shear_stiffness_number": 200.0}


def study(n: int) -> dict:
    """Create a configuration with n simulations: values of static friction; the remainder are seeds of the screening's heaps."""
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())
    at_a_point = 1 + len(STRESSES_PA)
    n_values = ((n - LEAST_SEEDS) // at_a_point - (len(RADII_M) - 1)) // len(ROLLING)
    values = np.linspace(0.2, 0.9, n_values).round(6).tolist()
    n_points = n_values * len(ROLLING) + len(RADII_M) - 1  # the base radius is in the grid
    config["study"] = "planning"
    config["design"] |= {"grid": {"static_friction": values, "rolling_friction": ROLLING}, "sweep": {"radius_m": RADII_M}}
    config["design"] |= {"sweep_couples": [{"static_friction": values[0], "rolling_friction": ROLLING[0]}]}
    config["design"] |= {"repose_seeds": [1], "shear_seeds": [1]}
    seeds = list(range(1000, 1000 + n - n_points * at_a_point))
    config["screening"] = {"base_seeds": seeds, "changed_seeds": [1], "changes": {}}
    config["fidelity"]["check"]["couples"] = []
    config["fidelity"]["campaign"] |= QUICK
    config["shear"] |= BOX | {"normal_stresses_pa": STRESSES_PA}
    config["repose"] |= HEAP
    return config


def project(folder: Path, n: int) -> Path:
    """Create a folder in which snakemake runs a study of n simulations."""
    for name in ("config", "workflow", "profiles"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "Snakefile", folder)
    (folder / "src").symlink_to(ROOT / "src")
    (folder / "config" / "config.yaml").write_text(yaml.safe_dump(study(n), sort_keys=False))
    return folder


def snakemake(folder: Path, *arguments: str) -> tuple[dict, str]:
    """Call snakemake; returns wall time, processor time, peak memory and output, or exits with the output if it fails."""
    command = [sys.executable, "-m", "snakemake", *arguments]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src")}
    begin = time.perf_counter()
    with open(folder / "output", "w", encoding="utf-8") as file:
        process = subprocess.Popen(command, cwd=folder, env=environment, stdout=file, stderr=file)
        _, status, usage = os.wait4(process.pid, 0)
    wall_s, output = time.perf_counter() - begin, (folder / "output").read_text()
    if status:
        sys.exit(output[-3000:])
    cpu_s, memory_mb = usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0
    return {"wall_s": round(wall_s, 2), "cpu_s": round(cpu_s, 2), "memory_mb": round(memory_mb)}, output


def planned(output: str) -> int:
    """Number of simulations that a dry run plans."""
    jobs = {words[0]: int(words[1]) for words in map(str.split, output.splitlines()) if len(words) == 2 and words[1].isdigit()}
    return jobs.get("simulate_repose", 0) + jobs.get("simulate_shear", 0)


def dry_run(n: int) -> dict:
    """Time and memory of a dry run of n simulations."""
    with tempfile.TemporaryDirectory() as folder:
        spent, output = snakemake(project(Path(folder), n), "-n", "all")
    if planned(output) != n:
        sys.exit(f"{planned(output)} simulations are planned, not {n}.")
    return {"n": n, **spent}


def overhead(n: int) -> dict:
    """Overhead per simulation in s, of n simulations on one core: starting, planning, writing, measuring."""
    with tempfile.TemporaryDirectory() as name:
        folder = project(Path(name), n)
        results = folder / "results" / "planning"
        snakemake(folder, "-c1", "results/planning/kernels.txt")  # compiles the kernels if necessary
        spent, _ = snakemake(folder, "-c1", "results/planning/repose.parquet", "results/planning/shear.parquet")
        paths = results.glob("sims/*/*/timing.json")
        simulated = [time_s for path in paths for time_s in json.loads(path.read_text())["wall_time_s"].values()]
    if len(simulated) != n:
        sys.exit(f"{len(simulated)} simulations were made, not {n}.")
    return {
        "n": n,
        **spent,
        "simulated_s": round(sum(simulated), 1),
        "overhead_s": round((spent["wall_s"] - sum(simulated)) / n, 3),
    }


def main() -> None:
    """Measure and print the overhead."""
    parser = argparse.ArgumentParser(description="What a campaign costs beside its simulations.")
    parser.add_argument("--sizes", type=int, nargs="*", default=SIZES, help="numbers of simulations to plan")
    parser.add_argument("--run", type=int, default=0, help="also make a campaign of so many simulations of a moment each")
    arguments = parser.parse_args()
    result = {"planning": [], "campaign": None}
    print(f"{'simulations':>11} {'dry run (s)':>12} {'processor (s)':>14} {'memory (MB)':>12}")
    for n in arguments.sizes:
        row = dry_run(n)
        result["planning"].append(row)
        print(f"{n:>11} {row['wall_s']:>12.1f} {row['cpu_s']:>14.1f} {row['memory_mb']:>12}", flush=True)
    if arguments.run:
        result["campaign"] = overhead(arguments.run)
        print(
            "{n} simulations of a moment on one core: {wall_s} s, {simulated_s} s of them simulated; {overhead_s} s each".format(
                **result["campaign"]
            )
        )
    print(json.dumps(result))


if __name__ == "__main__":
    main()
