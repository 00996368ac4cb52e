"""Precision of strength: scatter and cost of plane shear and of the direct shear box, for different sizes, strains and radii.

    python benchmarks/precision.py [--cores 2] [--seeds 6]

Writes docs/precision.md. Every variant is run with several seeds under one normal stress. The cost of a friction angle known to
half a degree follows from the scatter: a line through n tests that share one slope has the standard error SD(tau/p) / sqrt(n).
"""

import argparse
import math
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from dem.experiments import direct_shear, plane_shear, strength
from dem.experiments.soil import Engine, Soil
from dem.experiments.specimen import stiffness_reduction
from dem.measure.shear import strength as box_strength

PAGE = Path(__file__).resolve().parents[1] / "docs" / "precision.md"
#: The paper's base set at the middle of its friction grid, under the middle stress of the default study.
SOIL = Soil(
    radius_m=50e-6,
    density_kg_m3=3000.0,
    poisson_ratio=0.2,
    shear_modulus_pa=5e7,
    static_friction=0.5,
    rolling_friction=0.1,
    restitution=0.5,
)
STRESS_PA, INERTIAL_NUMBER, STIFFNESS_NUMBER = 500.0, 5e-3, 5000.0
#: Standard error of the friction angle for which the cost is stated.
WANTED_DEG = 0.5
COMMON = {"normal_stress_pa": STRESS_PA, "preparation_friction_ratio": 0.3, "scale_radius_m": SOIL.radius_m}


def plane(length: float, height: float, width: float, strain: float = 3.0, sd_ratio: float = 0.0, **engine) -> dict:
    """A plane shear variant; lengths in grain radii."""
    size = {"length_ratio": length, "height_ratio": height, "width_ratio": width}
    rate = engine.pop("inertial_number", INERTIAL_NUMBER)
    number = engine.pop("stiffness_number", STIFFNESS_NUMBER)
    setup = plane_shear.Setup(**COMMON, **size, shear_strain=strain, max_shear_strain=strain, inertial_number=rate)
    return {"test": "plane", "setup": setup, "soil": replace(SOIL, radius_sd_ratio=sd_ratio, **engine), "number": number}


def box(length: float, height: float, width: float, displacement: float = 9.0, sd_ratio: float = 0.0) -> dict:
    """A direct shear variant; lengths in grain radii."""
    size = {"length_ratio": length, "height_ratio": height, "width_ratio": width}
    setup = direct_shear.Setup(
        **COMMON, **size, displacement_ratio=displacement, inertial_number=INERTIAL_NUMBER, frame_static_friction=0.0
    )
    return {"test": "box", "setup": setup, "soil": replace(SOIL, radius_sd_ratio=sd_ratio), "number": STIFFNESS_NUMBER}


VARIANTS = {
    "plane 32 x 32 x 16, strain 3": plane(32, 32, 16),
    "plane 16 x 32 x 16": plane(16, 32, 16),
    "plane 64 x 32 x 16": plane(64, 32, 16),
    "plane 32 x 32 x 8": plane(32, 32, 8),
    "plane 32 x 32 x 32": plane(32, 32, 32),
    "plane 32 x 16 x 16": plane(32, 16, 16),
    "plane 32 x 64 x 16": plane(32, 64, 16),
    "plane, strain 6": plane(32, 32, 16, 6.0),
    "plane, strain 12": plane(32, 32, 16, 12.0),
    "plane, radii spread by 10 %": plane(32, 32, 16, sd_ratio=0.1),
    "plane, radii spread by 20 %": plane(32, 32, 16, sd_ratio=0.2),
    "plane, half the rate": plane(32, 32, 16, inertial_number=2.5e-3),
    "plane, four times the rate": plane(32, 32, 16, inertial_number=2e-2),
    "plane, four times as stiff": plane(32, 32, 16, stiffness_number=2e4),
    "box 60 x 32 x 5, 9 r (the paper's)": box(60, 32, 5),
    "box 60 x 32 x 10": box(60, 32, 10),
    "box 60 x 32 x 20": box(60, 32, 20),
    "box 30 x 32 x 10": box(30, 32, 10),
    "box, 18 r": box(60, 32, 5, 18.0),
    "box 60 x 32 x 6, radii spread by 10 %": box(60, 32, 6, sd_ratio=0.1),
}


def run(name: str, seed: int) -> tuple[str, float, float, float, float]:
    """One test: name, peak and steady (or plateau) stress ratio, processor time in s, largest overlap over the radius."""
    variant = VARIANTS[name]
    soil, setup, gravity = variant["soil"], variant["setup"], 0.0 if variant["test"] == "plane" else 9.81
    engine = Engine(time_step_rayleigh_ratio=0.3, stiffness_reduction=stiffness_reduction(soil, setup, variant["number"], gravity))
    began = time.process_time()
    test = (plane_shear if variant["test"] == "plane" else direct_shear).run(soil, setup, engine, seed)
    seconds = time.process_time() - began
    position = test.history["shear_strain" if variant["test"] == "plane" else "displacement_m"]
    curve = position, test.history["shear_stress_pa"], test.history["plane_normal_stress_pa"]
    if variant["test"] == "plane":
        highest, last = strength.peak(*curve), strength.steady(*curve)
        ratios = highest.shear_stress_pa / highest.normal_stress_pa, last.shear_stress_pa / last.normal_stress_pa
    else:
        found = box_strength(*curve, 0.3)
        ratios = (
            found.peak_shear_stress_pa / found.peak_plane_normal_stress_pa,
            found.plateau_shear_stress_pa / found.plane_normal_stress_pa,
        )
    return name, *ratios, seconds, test.max_overlap_ratio


def row(name: str, tests: list[tuple]) -> str:
    """A row of the table."""
    peaks, steadies, seconds, overlaps = np.array([test[1:] for test in tests]).T
    mean, sd = steadies.mean(), steadies.std(ddof=1)
    angle, sd_deg = math.degrees(math.atan(mean)), math.degrees(sd / (1.0 + mean**2))
    n = max(1, math.ceil((sd_deg / WANTED_DEG) ** 2))
    cells = (
        name,
        f"{peaks.mean():.3f} ± {peaks.std(ddof=1):.3f}",
        f"{mean:.3f} ± {sd:.3f}",
        f"{angle:.1f}",
        f"{100.0 * sd / mean:.1f}",
        f"{overlaps.max():.3f}",
        f"{seconds.mean():.1f}",
        f"{n}",
        f"{n * seconds.mean():.0f}",
    )
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Run all variants and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument("--seeds", type=int, default=6)
    given = parser.parse_args()
    run(next(iter(VARIANTS)), 0)  # compiles the kernels
    jobs = [(name, seed) for name in VARIANTS for seed in range(1, given.seeds + 1)]
    with ProcessPoolExecutor(given.cores) as pool:
        tests = list(pool.map(run, *zip(*jobs, strict=True)))
    rows = [row(name, [test for test in tests if test[0] == name]) for name in VARIANTS]
    head = [
        "# Precision of the strength tests",
        "",
        f"Written by `python benchmarks/precision.py`: {given.seeds} seeds of each variant under {STRESS_PA:g} Pa; µs "
        f"{SOIL.static_friction:g}, µr {SOIL.rolling_friction:g}, equal spheres unless said. Sizes are length x height x width in "
        "grain radii. SD: standard deviation over seeds of a single test. Steady: the mean over the last half of the strain; of "
        "the box: over the last 30 % of the displacement. Tests, core-seconds: as many as give the friction angle a standard "
        f"error of {WANTED_DEG:g}°, from SD, at least one. An SD from so few seeds is itself known to "
        f"± {100.0 / math.sqrt(2.0 * (given.seeds - 1)):.0f} %.",
        "",
        "| variant | peak τ/p | steady τ/p | φ (°) | SD (%) | largest overlap / r | core-s a test | tests | core-s |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    PAGE.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
    print(PAGE.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
