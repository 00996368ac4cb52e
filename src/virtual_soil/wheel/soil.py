"""The soil of a case under the tools: frictions and adhesive stress of its optimum, with grains of the wheel's size."""

from pathlib import Path

import numpy as np
import pandas as pd

from dem.experiments.soil import Engine
from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.optimise import RADIUS
from virtual_soil.calibration.space import space_of
from virtual_soil.campaign.experiments.apparatus import gravity_m_s2
from virtual_soil.campaign.experiments.common import MATERIAL_KEYS
from virtual_soil.campaign.experiments.grading import grading_of
from virtual_soil.campaign.experiments.shapes import numbers, shape_of
from virtual_soil.campaign.tables import read_table

#: Surrogate whose optimum is a case's answer.
ANSWER = "ours"
#: Between a case and the rank of one of its equivalent sets.
MEMBER = "-equivalent-"
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


def equivalents_of(table: str | Path, case: str) -> pd.DataFrame:
    """Sets of a case in results/<study>/equivalents.parquet, that simulated points surround, by rank.

    Raises CalibrationError if the soil is not calibrated yet.
    """
    allowed = "the table of a finished calibration: run the target `all` of this study first"
    demand(Path(table).is_file(), f"equivalent sets of case {case}", f"missing ({table})", allowed)
    rows = read_table(str(table), "equivalents")
    rows = rows[(rows["case"] == case) & ~rows["extrapolated"].astype(bool)]
    return rows.set_index("rank").sort_index()


def acting(design: dict) -> list[str]:
    """Variables of a design that act under the wheel: its grains have a radius of their own. design : in its normal form."""
    return [name for name in design["variables"] if name != RADIUS]


def chosen_ranks(table: str | Path, case: str, design: dict, n: int) -> list[int]:
    """Ranks of n equivalent sets of a case, spread over the design's coordinates of what acts under the wheel.

    The first is the most probable, each next the farthest from all before it. Raises CalibrationError for fewer sets.
    """
    rows, space = equivalents_of(table, case), space_of(design)
    demand(len(rows) >= n, "wheel_spread.soils", n, f"at most the {len(rows)} equivalent sets of case {case}")
    columns = [space.variables.index(name) for name in acting(design)]
    unit = space.unit({name: rows[name].to_numpy() for name in space.variables})[:, columns]
    order, distance = [0], np.linalg.norm(unit - unit[0], axis=1)
    while len(order) < n:
        order.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(unit - unit[order[-1]], axis=1))
    return [int(rows.index[k]) for k in order]


def member_name(case: str, rank: int) -> str:
    """Name of an equivalent set among the cases under the wheel."""
    return f"{case}{MEMBER}{rank}"


def values_of(calibration: str | Path, case: str) -> pd.Series:
    """Values of the answer of a case, or of an equivalent set by its `member_name`, whose table lies beside the calibration's."""
    name, mark, rank = case.rpartition(MEMBER)
    if not mark:
        return answer_of(calibration, case)
    table = Path(calibration).with_name("equivalents.parquet")
    rows = equivalents_of(table, name)
    demand(rank.isdecimal() and int(rank) in rows.index, f"{table}: case {name}, set", rank, f"one of {list(rows.index)}")
    return rows.loc[int(rank)]


def grain_settings(wheel: dict) -> dict:
    """What the wheel changes of the grains: their mean radius, to six digits, and their shear modulus unless it is null."""
    radius = float(f"{wheel['shape']['radius_m'] / (2.0 * wheel['grains_per_radius']):.6g}")
    modulus = wheel["shear_modulus_pa"]
    return {"radius_m": radius} | ({} if modulus is None else {"shear_modulus_pa": modulus})


def soil_of_case(config: dict, calibration: str | Path, case: str) -> dict:
    """Values of the calibrated soil: `row`, `grading` and `shape` for `experiments.common.soil_of`; plain values, for a rule.

    config : the study. The design's variables have the values of the optimum, or of an equivalent set (case: its `member_name`);
    all else is the study's material.
    """
    answer = values_of(calibration, case)
    return soil_with(config, {name: float(answer[name]) for name in config["design"]["variables"] if name in answer})


def soil_with(config: dict, values: dict[str, float]) -> dict:
    """The study's material with other values of some keys, as `soil_of_case`."""
    material = numbers(config["material"]) | values
    row = {name: material[name] for name in MATERIAL_KEYS if name in material}
    return {"row": row, **grading_of(config), **shape_of(config)}


def card(soil: dict, grains: dict) -> dict:
    """Keys and values of the grains under the tools; soil : of `soil_of_case`, grains : of `grain_settings`."""
    return soil["row"] | grains | {key: value for key, value in soil.items() if key != "row"}


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
