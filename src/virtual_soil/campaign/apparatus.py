"""The apparatus of a study, in SI: stated by the study itself, or by the files of its soils."""

from pathlib import Path

import numpy as np

from virtual_soil.calibration.errors import demand
from virtual_soil.campaign import settings
from virtual_soil.campaign.experiments.apparatus import SECTIONS, gravity_m_s2
from virtual_soil.campaign.experiments.shear.curves import NOMINAL
from virtual_soil.campaign.experiments.shear.laboratory import ENTRY, understood
from virtual_soil.campaign.soils import soil_content

#: Response that compares curves.
CURVE_DISTANCE = "curve_distance"


def apparatus(config: dict, soil_files: list[str]) -> dict[str, dict]:
    """Sections `repose_test`, `shear_test` and `slope_test` of a study, completed by those of its soils' files.

    soil_files : of the soils that its cases calibrate. One campaign serves them all, so it has one apparatus: raises
    CalibrationError where two of them, or a soil and the study, state different values.
    """
    found: dict[str, dict] = {}
    for section, kind in SECTIONS.items():
        merged = dict(config[section])
        said_by = {key: "the study" for key, value in merged.items() if value is not None}
        for path in soil_files:
            for key, value in stated_in(path, section, kind).items():
                where = f"{section}.{key}"
                other = merged[key] is None or merged[key] == value
                demand(other, where, f"{value} in {path} and {merged[key]} in {said_by.get(key)}", "one apparatus for a study")
                merged[key], said_by[key] = value, path
        found[section] = merged
    return found


def stated_in(path: str, section: str, kind: type) -> dict:
    """What a soil file states of one test; its shear file's normal stresses, if the test is stated without any."""
    content = soil_content(Path(path))
    if section not in content:
        return {}
    stated = {key: value for key, value in content[section].items() if value is not None and key != "insist"}
    if "normal_stresses_pa" in settings.defaults(kind) and "normal_stresses_pa" not in stated and ENTRY in content:
        stated["normal_stresses_pa"] = laboratory_stresses_pa(Path(path), content[ENTRY])
    return stated


def laboratory_stresses_pa(soil: Path, entry) -> list[float]:
    """The distinct normal stresses of a laboratory's shear tests in Pa, to three digits, ascending."""
    found: list[float] = []
    for stress, _ in sorted(understood(soil, entry).points.values()):
        if not found or stress > found[-1] * (1.0 + NOMINAL):
            found.append(stress)
    return [float(f"{stress:.3g}") for stress in found]


def with_gravity(engine: dict) -> dict:
    """The engine's settings with gravity as a number; it may be given by name."""
    return engine | {"gravity_m_s2": gravity_m_s2(engine["gravity_m_s2"])}


def laboratory_curve(config: dict, soil_files: list[str]) -> list[dict] | None:
    """The laboratory's shear curves that `curve_distance` is measured from; None if no case has a weight for it.

    Raises CalibrationError unless the cases that have one are about one soil, whose file names its curves.
    """
    asked = sorted({case["soil"] for case in config["optimise"]["cases"] if case["weights"].get(CURVE_DISTANCE)})
    if not asked:
        return None
    demand(len(asked) == 1, "optimise.cases: soils with a weight for curve_distance", asked, "one")
    paths = [Path(path) for path in soil_files if Path(path).stem == asked[0]]
    entry = soil_content(paths[0]).get(ENTRY) if paths else None
    tests = understood(paths[0], entry) if entry is not None else None
    curves = tests.curves if tests is not None else []
    demand(bool(curves), f"optimise.cases: weight curve_distance of {asked[0]}", "no shear curves", f"a soil file with {ENTRY}")
    return [
        {
            "normal_stress_pa": float(np.median(curve.normal_stress_pa)),
            "displacement_m": curve.displacement_m.tolist(),
            "stress_ratio": (curve.shear / curve.normal_stress_pa).tolist(),
        }
        for curve in curves
    ]
