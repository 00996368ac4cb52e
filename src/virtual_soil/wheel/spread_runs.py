"""Runs, families and plate pressures of target `wheel_spread`, from the files of its jobs."""

import math
from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from dem.measure.penetration import pressure_at
from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.space import space_of
from virtual_soil.campaign.tables import read_table
from virtual_soil.wheel.measured import wheel_table
from virtual_soil.wheel.soil import acting, chosen_ranks, member_name, values_of, verdicts_of
from virtual_soil.wheel.spread_page import Family


def beds_of(calibration: str | Path, case: str, design: dict, settings: dict) -> list[tuple[str, int]]:
    """Pairs of soil and seed of all beds: the optimum's, then those of the equivalent sets; settings : section `wheel_spread`.

    Raises CalibrationError if the soil is not calibrated yet, or has fewer sets.
    """
    values_of(calibration, case)
    ranks = chosen_ranks(Path(calibration).with_name("equivalents.parquet"), case, design, settings["soils"])
    members = [(member_name(case, rank), seed) for rank in ranks for seed in settings["soil_seeds"]]
    return [*((case, seed) for seed in settings["optimum_seeds"]), *members]


def spread_table(
    runs: pd.DataFrame,
    histories: Iterable[pd.DataFrame],
    beds: pd.DataFrame,
    plates: Iterable[pd.DataFrame],
    sinkage_m: float,
) -> pd.DataFrame:
    """Runs with the means of their steady stretch and the pressure under the plate of the same bed.

    runs, histories, beds : as `measured.wheel_table`. plates : histories of schema press_history, one by one with the runs; none
    without a plate.
    """
    table, plates = wheel_table(runs, histories, beds), list(plates)
    pressures = [pressure_at(plate["depth_m"].to_numpy(), plate["pressure_pa"].to_numpy(), sinkage_m)[0] for plate in plates]
    return table.assign(plate_pressure_pa=pressures or math.nan)


def family_of(case: str, runs: pd.DataFrame, calibration: str | Path, posterior: str, design: dict, responses: dict) -> Family:
    """The soils of the runs that are done, with their parameters; responses : as `Family`.

    Raises CalibrationError for runs of fewer than three soils.
    """
    names = list(dict.fromkeys(runs["case"]))
    demand(len(names) >= 3, f"case {case}: soils with a run that is done", len(names), "at least 3; see the runs' reasons")
    variables = design["variables"]
    soils = pd.DataFrame([{"case": name, **values_of(calibration, name)[variables]} for name in names])
    samples = read_table(posterior, "posterior")
    samples = samples[samples["case"] == case].reset_index(drop=True)
    known = {column: what for column, what in responses.items() if column in samples and samples[column].notna().all()}
    verdicts = verdicts_of(calibration, [case])[case]
    return Family(case, verdicts, soils.astype(dict.fromkeys(variables, float)), samples, space_of(design), acting(design), known)


def done_runs(runs: pd.DataFrame) -> pd.DataFrame:
    """Runs that are done, in their order: those of the optimum first. Raises CalibrationError if none is."""
    done = runs[runs["status"] == "done"].reset_index(drop=True)
    demand(len(done) > 0, "runs of the wheel that are done", 0, "at least one; see the reasons in wheel_spread.parquet")
    return done
