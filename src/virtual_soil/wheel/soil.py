"""The soil of a case under the tools: frictions and adhesive stress of its optimum, with grains of the wheel's size."""

from pathlib import Path

import pandas as pd

from dem.experiments.soil import Engine
from virtual_soil.calibration.errors import demand
from virtual_soil.campaign.experiments.apparatus import gravity_m_s2
from virtual_soil.campaign.experiments.common import MATERIAL_KEYS
from virtual_soil.campaign.experiments.grading import grading_of
from virtual_soil.campaign.experiments.shapes import numbers, shape_of
from virtual_soil.campaign.tables import read_table

#: Surrogate whose optimum is a case's answer.
ANSWER = "ours"
#: Verdicts of a confirmed answer.
CONFIRMED, MATCHES = "confirmed", "matches"


def cases_of(wheel: dict, known: list[str]) -> list[str]:
    """Cases that the wheel runs on; raises CalibrationError for one that is not among the study's."""
    unknown = sorted(set(wheel["cases"]) - set(known))
    demand(not unknown, "wheel.cases", unknown, f"names of optimise.cases: {', '.join(known)}")
    return wheel["cases"] or list(known)


def answer_of(calibration: str | Path, case: str) -> pd.Series:
    """Row of a case's answer in results/<study>/calibration.parquet.

    Raises CalibrationError if the soil is not calibrated yet, or the case is not in the table.
    """
    allowed = "the table of a finished calibration: run the target `all` of this study first"
    demand(Path(calibration).is_file(), f"calibration of case {case}", f"missing ({calibration})", allowed)
    table = read_table(str(calibration), "calibration")
    rows = table[(table["case"] == case) & (table["surrogate"] == ANSWER)]
    demand(len(rows) == 1, f"{calibration}: case {case}", f"there {len(rows)} times", "once: run the target `all` of this study")
    return rows.iloc[0]


def grain_settings(wheel: dict) -> dict:
    """What the wheel changes of the grains: their mean radius, to six digits, and their shear modulus unless it is null."""
    radius = float(f"{wheel['shape']['radius_m'] / (2.0 * wheel['grains_per_radius']):.6g}")
    modulus = wheel["shear_modulus_pa"]
    return {"radius_m": radius} | ({} if modulus is None else {"shear_modulus_pa": modulus})


def soil_of_case(config: dict, calibration: str | Path, case: str) -> dict:
    """Values of the calibrated soil: `row`, `grading` and `shape` for `experiments.common.soil_of`; plain values, for a rule.

    config : the study. The design's variables have the optimum's values, all else is the study's material.
    """
    answer = answer_of(calibration, case)
    material = numbers(config["material"])
    material |= {name: float(answer[name]) for name in config["design"]["variables"] if name in answer}
    row = {name: material[name] for name in MATERIAL_KEYS if name in material}
    return {"row": row, **grading_of(config), **shape_of(config)}


def verdicts_of(calibration: str | Path, cases: list[str]) -> dict[str, list[str]]:
    """Case -> verdicts of its answer, prediction and match; plain values, a rule's parameter."""
    answers = {case: answer_of(calibration, case) for case in cases}
    return {case: [str(answer["prediction"]), str(answer["match"])] for case, answer in answers.items()}


def is_confirmed(verdicts: list[str]) -> bool:
    """True if simulation confirms prediction and match of an answer."""
    return verdicts == [CONFIRMED, MATCHES]


def engine_settings(config: dict, wheel: dict) -> dict:
    """Arguments of `dem.experiments.soil.Engine` for bed and tools. No energy ledger is kept: it does not book bodies that turn."""
    stated = wheel["gravity_m_s2"]
    gravity = config["engine"]["gravity_m_s2"] if stated is None else gravity_m_s2(stated)
    known = {name: value for name, value in config["engine"].items() if name in Engine.__dataclass_fields__}
    step = wheel["time_step_rayleigh_ratio"]
    return known | {"energy_ledger": False, "gravity_m_s2": gravity, "time_step_rayleigh_ratio": step}
