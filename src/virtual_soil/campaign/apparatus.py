"""The apparatus of a study, in SI: stated by the study itself, or by the files of its soils."""

import math
from pathlib import Path

import numpy as np

from virtual_soil.calibration.errors import demand
from virtual_soil.campaign import settings
from virtual_soil.campaign.experiments.apparatus import POURED, SECTIONS, gravity_m_s2
from virtual_soil.campaign.experiments.registry import RESPONSES, chosen
from virtual_soil.campaign.experiments.shear.curves import NOMINAL
from virtual_soil.campaign.experiments.shear.laboratory import ENTRY, understood
from virtual_soil.campaign.soils import measure_soil, soil_content

#: Section of a test of an angle -> groups of keys of which one has to be stated for a soil that coheres.
SIZES = {
    "repose_test": (("tube_diameter_m",), ("fill_height_m", "fill_mass_kg"), ("gravity_m_s2",)),
    "slope_test": (("height_m",), ("gravity_m_s2",)),
}
#: Cohesion over rho_b g H beyond which soil does not flow out of a lifted tube: a vertical wall stands from
#: 1 / (4 tan(45 deg + phi / 2)) on (Culmann), 0.12 for 40 degrees.
LARGEST_KAPPA = 0.1
#: Stresses on the lid over the cohesion that they measure, lowest and highest, and their number: below, grains that stick tear off
#: the lid; above, the cohesion is lost in the scatter of the strengths.
STRESS_RATIOS, N_STRESSES = (0.5, 5.0), 4
#: Response that compares curves.
CURVE_DISTANCE = "curve_distance"


def apparatus(config: dict, soil_files: list[str]) -> dict[str, dict]:
    """Sections of SECTIONS (`repose_test` and so on) of a study, completed by those of its soils' files.

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


def check_sizes(config: dict, soil_files: list[str]) -> None:
    """Refuse slopes of soils that cohere without the size of their test, and heaps that would stand as columns.

    Only of grains that may stick: others have no cohesion, and their angles no size. config : with its apparatus complete. Raises
    CalibrationError naming the section, what is missing and why.
    """
    files = {Path(path).stem: path for path in soil_files}
    for case in config["optimise"]["cases"] if may_stick(config) else ():
        cohesion = cohesion_pa(files[case["soil"]]) if case["soil"] in files else 0.0
        for experiment in chosen(config["experiments"]):
            wanted = case["weights"].get(experiment.RESPONSES[0].name)  # of heap and slope: its angle
            if cohesion > 0.0 and wanted and experiment.APPARATUS in SIZES:
                check_size(config, experiment.APPARATUS, case["soil"], cohesion)


def follow_cohesion(config: dict, soil_files: list[str]) -> dict[str, dict]:
    """Sections of the shear tests, with stresses that follow the cohesions which the study's cases ask for.

    Only of grains that may stick, and where the section states no stresses: from half of the lowest cohesion to five times the
    highest, in equal ratios. config : with its apparatus complete; its stresses go before those of the sections.
    """
    files = {Path(path).stem: path for path in soil_files}
    found = {}
    for experiment in chosen(config["experiments"]):
        section, names = config[experiment.NAME], [response.name for response in experiment.RESPONSES if response.unit == "Pa"]
        asked = [case["soil"] for case in config["optimise"]["cases"] if any(case["weights"].get(name) for name in names)]
        values = [cohesion for cohesion in (cohesion_pa(files[soil]) for soil in asked if soil in files) if cohesion > 0.0]
        if may_stick(config) and values and section["normal_stresses_pa"] is None:
            ends = STRESS_RATIOS[0] * min(values), STRESS_RATIOS[1] * max(values)
            stresses = [float(f"{stress:.3g}") for stress in np.geomspace(*ends, N_STRESSES)]
            found[experiment.NAME] = section | {"normal_stresses_pa": stresses}
    return found


def may_stick(config: dict) -> bool:
    """True if grains of the study may stick."""
    return config["material"]["adhesive_stress_pa"] > 0.0 or "adhesive_stress_pa" in config["design"]["variables"]


def check_size(config: dict, section: str, soil: str, cohesion_pa: float) -> None:
    """Refuse the test of a soil that coheres if its size is not stated, or if the soil would stand as a column in it."""
    stated = config[section]
    missing = [" or ".join(keys) for keys in SIZES[section] if all(stated[key] is None for key in keys)]
    why = f"stated in SI: {soil} has a cohesion of {cohesion_pa:g} Pa, so its angle depends on the size of the test"
    demand(not missing, f"{section}: {', '.join(missing)}", "missing", why)
    height = fill_height_m(config)
    if section != "repose_test" or height is None:
        return
    weight_pa = POURED * config["material"]["density_kg_m3"] * gravity_m_s2(stated["gravity_m_s2"]) * height
    kappa = cohesion_pa / weight_pa
    demand(
        kappa <= LARGEST_KAPPA,
        f"{section}: cohesion of {soil} over the weight of the fill, {cohesion_pa:g} Pa / {weight_pa:.3g} Pa,",
        f"{kappa:.2g}",
        f"at most {LARGEST_KAPPA:g}: it stands as a column in this test; measure a slope (slope_angle_deg and slope_test) or a "
        "taller heap",
    )


def fill_height_m(config: dict) -> float | None:
    """Height of the soil in the laboratory's tube; None if it is not stated."""
    stated = config["repose_test"]
    if stated["fill_mass_kg"] is None:
        return stated["fill_height_m"]
    area = math.pi * (0.5 * stated["tube_diameter_m"]) ** 2
    return stated["fill_mass_kg"] / (POURED * config["material"]["density_kg_m3"] * area)


def cohesion_pa(soil_file: str) -> float:
    """Largest cohesion that a soil file states in Pa; 0 if it states none, or none beyond two standard errors."""
    table = measure_soil(soil_file)
    signed = table[[RESPONSES[name].signed for name in table["property"]]]
    beyond = signed["value"] > 2.0 * signed["standard_uncertainty"].fillna(0.0)
    return float(signed.loc[beyond, "value"].max()) if beyond.any() else 0.0


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
