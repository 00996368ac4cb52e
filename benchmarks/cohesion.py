"""Cohesion and friction angle of grains that stick, by plane shear tests: what they depend on, and what they do not.

    python benchmarks/cohesion.py [--seeds 3]

Writes docs/cohesion.md, on one core in half an hour. Tests of one table share the normal stresses, the ratio E*/(p + 4/pi sigma_a)
and the inertial number; beds are prepared without adhesion unless a row says otherwise.
"""

import argparse
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dem.experiments import plane_shear, specimen, strength
from dem.experiments.soil import Engine
from virtual_soil.campaign.experiments.common import soil_of
from virtual_soil.campaign.experiments.mohr_coulomb import StrengthLine, fit_line
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults

PAGE = Path(__file__).resolve().parents[1] / "docs" / "cohesion.md"
CONFIG = defaults(Study)
MATERIAL, FIDELITY = CONFIG["material"], CONFIG["fidelity"]["campaign"]
#: Normal stresses in Pa: a half to five times the cohesion of the base row.
STRESSES_PA = (150.0, 300.0, 600.0, 1500.0)
ADHESIVE_STRESS_PA = 600.0


class Case(NamedTuple):
    """A row: its name, and what differs from the base."""

    name: str
    material: dict = {}
    setup: dict = {}
    engine: dict = {}
    stiffness: float = 1.0


BASE = Case("base: σa 600 Pa, r 50 µm, µs 0.3, µr 0.1")
TABLES = {
    "Adhesive stress": [*(Case(f"σa {stress:g} Pa", {"adhesive_stress_pa": stress}) for stress in (0.0, 150.0, 300.0)), BASE,
                        Case("σa 1200 Pa", {"adhesive_stress_pa": 1200.0})],
    "Radius": [BASE, *(Case(f"r {1e6 * radius:g} µm", {"radius_m": radius}) for radius in (100e-6, 250e-6))],
    "Preparation and stiffness": [BASE, Case("prepared with adhesion", setup={"prepared_with_adhesion": True}),
                                  Case("four times as stiff", stiffness=4.0)],
    "Law and friction": [BASE, Case("JKR", engine={"adhesion": "jkr"}),
                         Case("µs 0.9, µr 0.2", {"static_friction": 0.9, "rolling_friction": 0.2})],
}  # fmt: skip

HEAD = """# Cohesion of grains that stick

Written by `python benchmarks/cohesion.py`: {n} plane shear tests, {seeds} seeds under each normal stress of {stresses} Pa. Beds
are prepared without adhesion, then sheared with it. c and φ with their standard errors are those of the line through all tests of a
row; solid fractions are those before shearing, of the lowest and the highest stress. c / σa: cohesion at the peak over the adhesive
stress σa = F_c/d², the pull-off force of two grains over their diameter squared.
"""


class Row(NamedTuple):
    """Lines of a case's peak and steady strengths, solid fractions by stress, largest overlap over the radius."""

    peak: StrengthLine
    steady: StrengthLine
    solid_fractions: list[float]
    overlap: float


def measure(case: Case, seeds: int) -> Row:
    """Run all tests of a case."""
    soil = soil_of({**MATERIAL, "adhesive_stress_pa": ADHESIVE_STRESS_PA, **case.material}, CONFIG)
    section = {key: value for key, value in CONFIG["plane_shear"].items() if key in plane_shear.Setup.__dataclass_fields__}
    points, solid, overlap = [], [], 0.0
    for stress in STRESSES_PA:
        given = {"scale_radius_m": soil.radius_m, "inertial_number": FIDELITY["plane_shear_inertial_number"]}
        setup = plane_shear.Setup(**section | given | {"normal_stress_pa": stress} | case.setup)
        number = case.stiffness * FIDELITY["plane_shear_stiffness_number"]
        engine = Engine(
            time_step_rayleigh_ratio=FIDELITY["plane_shear_time_step_rayleigh_ratio"],
            stiffness_reduction=specimen.stiffness_reduction(soil, setup, number, 0.0),
            **case.engine,
        )
        runs = [plane_shear.run(soil, setup, engine, seed) for seed in range(1, seeds + 1)]
        for run in runs:
            curve = [run.history[name] for name in ("shear_strain", "shear_stress_pa", "plane_normal_stress_pa")]
            highest, last = strength.peak(*curve), strength.steady(*curve)
            points.append((highest.normal_stress_pa, highest.shear_stress_pa, last.normal_stress_pa, last.shear_stress_pa))
        solid.append(float(np.mean([run.solid_fraction for run in runs])))
        overlap = max(overlap, *(run.max_overlap_ratio for run in runs))
    p_peak, tau_peak, p_steady, tau_steady = np.array(points).T
    return Row(fit_line(p_peak, tau_peak), fit_line(p_steady, tau_steady), solid, overlap)


def text_of(case: Case, row: Row) -> str:
    """Line of a table."""
    stress = case.material.get("adhesive_stress_pa", ADHESIVE_STRESS_PA)
    share = f"{row.peak.cohesion_pa / stress:.2f} ± {row.peak.cohesion_se_pa / stress:.2f}" if stress else "–"
    values = [
        *(f"{line.cohesion_pa:.0f} ± {line.cohesion_se_pa:.0f}" for line in (row.peak, row.steady)),
        *(f"{line.friction_angle_deg:.1f} ± {line.friction_angle_se_deg:.1f}" for line in (row.peak, row.steady)),
        f"{row.solid_fractions[0]:.3f} – {row.solid_fractions[-1]:.3f}",
        f"{100.0 * row.overlap:.1f}",
    ]
    return f"| {case.name} | {values[0]} | {share} | " + " | ".join(values[1:]) + " |"


def main() -> None:
    """Run all cases and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3, help="seeds under each normal stress")
    seeds = parser.parse_args().seeds
    begin = time.perf_counter()
    cases = {case.name: case for table in TABLES.values() for case in table}
    rows = {}
    for name, case in cases.items():
        rows[name] = measure(case, seeds)
        print(text_of(case, rows[name]), f"{time.perf_counter() - begin:.0f} s", flush=True)
    n = len(cases) * seeds * len(STRESSES_PA)
    parts = [HEAD.format(n=n, seeds=seeds, stresses=", ".join(f"{stress:g}" for stress in STRESSES_PA))]
    for title, table in TABLES.items():
        head = ("", "c peak (Pa)", "c / σa", "c steady (Pa)", "φ peak (°)", "φ steady (°)", "solid fraction", "overlap (% of r)")
        lines = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|", *(text_of(case, rows[case.name]) for case in table)]
        parts.append(f"## {title}\n\n" + "\n".join(lines) + "\n")
    PAGE.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
