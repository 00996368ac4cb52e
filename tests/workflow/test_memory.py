"""The steps that gather a campaign hold one simulation at a time, not all of them."""

import json
import math
import tracemalloc
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from virtual_soil.campaign.design import make_row
from virtual_soil.campaign.measure import measured_table
from virtual_soil.campaign.tables import read_table, write_table

MATERIAL = {
    "radius_m": 1e-3, "radius_sd_ratio": 0.0, "density_kg_m3": 2500.0, "poisson_ratio": 0.2, "shear_modulus_pa": 1e7,
    "static_friction": 0.3, "rolling_friction": 0.1, "restitution": 0.5,
}  # fmt: skip
#: Rows of a history or grains of a heap; so many that one table is larger than all that is kept of a simulation.
N_ROWS = 20_000
HISTORY = (
    *("time_s", "displacement_m", "shear_force_n", "shear_stress_pa", "applied_normal_stress_pa", "plane_normal_stress_pa"),
    "lid_height_m",
)
SHARED = {"reason": "", "n_particles": 5, "n_steps": 9, "simulated_time_s": 1.0, "max_overlap_ratio": 0.01}
ENERGY = {"energy_dissipated_j": math.nan, "energy_residual_ratio": math.nan}
#: experiment -> its tables: name of the file, schema, columns
TABLES = {
    "repose": ("after", "grains", {name: np.full(N_ROWS, 1e-3) for name in ("x_m", "y_m", "z_m", "radius_m", "speed_m_s")}),
    "shear": ("history", "shear_history", {name: np.linspace(1.0, 2.0, N_ROWS) for name in HISTORY}),
}
RUNS = {
    "repose": SHARED | ENERGY | {"status": "flat", "n_lost": 0},
    "shear": SHARED | ENERGY
    | {"status": "done", "inertial_number": 0.01, "stiffness_reduction": 1.0, "solid_fraction": 0.6, "lid_slip_ratio": 0.0},
}  # fmt: skip


def campaign(folder, experiment, n):
    """Files of n simulations, as a measuring rule gets them."""
    file, schema, columns = TABLES[experiment]
    stress = {"repose": math.nan, "shear": 500.0}[experiment]
    rows = [make_row(experiment, "campaign", MATERIAL, stress, seed) | {"purposes": "grid"} for seed in range(n)]
    write_table(pd.DataFrame(rows), folder / "design.parquet", "design", {})
    found = {"runs": [], "large": [], "timings": []}
    for row in rows:
        name = row["simulation_id"]
        paths = [folder / name / f"{part}" for part in ("run.parquet", f"{file}.parquet", "timing.json")]
        provenance = {"simulations": {name: {}}}
        run = {"simulation_id": name} | RUNS[experiment]
        write_table({key: [value] for key, value in run.items()}, paths[0], f"{experiment}_run", provenance)
        write_table({"simulation": np.full(N_ROWS, name), **columns}, paths[1], schema, provenance)
        paths[2].write_text(json.dumps({"wall_time_s": {name: 1.0}}))
        for key, path in zip(found, paths, strict=True):
            found[key].append(path)
    large = found.pop("large")
    return SimpleNamespace(**found, results=large, design=folder / "design.parquet")


def measure(experiment, files, folder):
    """As rule `measure`; its tables are gone when it returns, before the pool that holds them."""
    design = read_table(files.design, "design")
    table = measured_table(experiment, design, files.runs, files.results, files.timings, {"estimator": "profile"})
    write_table(table, folder / "table.parquet", experiment, {})


def peak_bytes(experiment, folder, n):
    """The most memory that is held at once while n simulations are measured: of Arrow's pool and of Python's own."""
    files = campaign(folder, experiment, n)
    before, pool = pa.default_memory_pool(), pa.proxy_memory_pool(pa.system_memory_pool())
    pa.set_memory_pool(pool)
    tracemalloc.start()
    try:
        measure(experiment, files, folder)
        return pool.max_memory() + tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
        pa.set_memory_pool(before)


@pytest.mark.parametrize("experiment", list(TABLES))
def test_memory_does_not_grow_with_the_number_of_simulations(experiment, tmp_path):
    one = sum(column.nbytes for column in TABLES[experiment][2].values())
    peak_bytes(experiment, tmp_path / "imports", 1)
    few, many = peak_bytes(experiment, tmp_path / "few", 4), peak_bytes(experiment, tmp_path / "many", 24)
    assert len(read_table(tmp_path / "many" / "table.parquet", experiment)) == 24
    assert one < few < many + one  # what is measured is there at all
    assert many - few < one
