"""Tables of the finished runs: what the wheel did in the steady stretch of its travel, and what plates and cone tell of the bed."""

import math
from collections.abc import Collection, Iterable

import pandas as pd

from dem.measure.penetration import bekker, cone_gradient, power_law, pressure_at
from dem.measure.wheel import Steady, steady
from virtual_soil.calibration.errors import demand
from virtual_soil.campaign.tables import read_table

#: Sinkages at which a plate's pressure is given, and those between which its law is fitted, as shares of the test's depth.
SHARES, FITTED = (0.2, 0.4, 0.6, 0.8), (0.2, 1.0)
#: Columns that say which bed.
BED = ["case", "seed"]
#: Columns of a bed that stand beside each run on it.
OF_BED = ["solid_fraction", "bulk_density_kg_m3", "grain_radius_m", "preparation_friction_ratio"]


def stacked(paths: Collection[str], schema: str) -> pd.DataFrame:
    """The rows of several files of one schema, in the order of the files; raises CalibrationError without files."""
    demand(len(paths) > 0, "number of runs", 0, "at least one: a plate in plate.diameters_m, or cone.base_area_m2")
    return pd.concat([read_table(path, schema) for path in paths], ignore_index=True)


def histories_by(frames: Iterable[pd.DataFrame], runs: pd.DataFrame):
    """Pairs of a run's row and its history, which correspond one by one."""
    yield from zip(runs.to_dict("records"), frames, strict=True)


def beside_beds(table: pd.DataFrame, beds: pd.DataFrame) -> pd.DataFrame:
    """A table of runs with the columns OF_BED of their beds."""
    return table.merge(beds[[*BED, *OF_BED]], on=BED, how="left", validate="many_to_one")


def steady_or_nothing(history: pd.DataFrame, radius_m: float) -> dict[str, float]:
    """Means of the steady stretch and their errors (`dem.measure.wheel.Steady`); missing if the wheel hardly travelled."""
    columns = {name: history[name].to_numpy() for name in history}
    try:
        found = steady(columns, radius_m)
    except ValueError:
        return dict.fromkeys(Steady.__dataclass_fields__, math.nan) | {"n_samples": 0}
    return {name: getattr(found, name) for name in Steady.__dataclass_fields__}


def wheel_table(runs: pd.DataFrame, histories: Iterable[pd.DataFrame], beds: pd.DataFrame) -> pd.DataFrame:
    """One row per run of the wheel: the run, its bed, means of the steady stretch with standard errors.

    runs : of schema wheel_run. histories : of schema wheel_history, in the same order. beds : of schema wheel_bed. A run that was
    not `done` has no means: the wheel sank to the floor or was not carried.
    """
    rows = []
    for run, history in histories_by(histories, runs):
        counts = history if run["status"] == "done" else history[:0]
        rows.append({**run, **steady_or_nothing(counts, run["radius_m"])})
    return beside_beds(pd.DataFrame(rows), beds)


def plate_table(runs: pd.DataFrame, histories: Iterable[pd.DataFrame], beds: pd.DataFrame) -> pd.DataFrame:
    """One row per plate and sinkage: the pressure there, the plate's law p = k z^n, and Bekker's moduli of the bed's plates.

    runs : of schema press_run with case, seed; histories : of schema press_history. Sinkages count from the bed's level. Bekker's
    moduli belong to all plates on one bed, and are missing with fewer than two.
    """
    laws: dict[tuple, dict] = {}
    kept = []
    for run, history in histories_by(histories, runs):
        z, p, depth = history["depth_m"].to_numpy(), history["pressure_pa"].to_numpy(), run["depth_m"]
        law = power_law(z, p, FITTED[0] * depth, FITTED[1] * depth)
        if not math.isnan(law.n):
            laws.setdefault((run["case"], run["seed"]), {})[run["diameter_m"]] = law
        kept.append((run, z, p, law))
    rows = []
    for run, z, p, law in kept:
        n, k_c, k_phi = bekker(laws.get((run["case"], run["seed"]), {}), SHARES[1] * run["depth_m"])
        for share in SHARES:
            pressure, error = pressure_at(z, p, share * run["depth_m"])
            rows.append(
                {
                    **run,
                    "sinkage_m": share * run["depth_m"],
                    "pressure_pa": pressure,
                    "pressure_error_pa": error,
                    "k_pa_m_n": law.k_pa_m_n,
                    "n": law.n,
                    "law_residual_ratio": law.residual_ratio,
                    "bekker_n": n,
                    "bekker_k_c": k_c,
                    "bekker_k_phi": k_phi,
                }
            )
    return beside_beds(pd.DataFrame(rows), beds)


def cone_table(runs: pd.DataFrame, histories: Iterable[pd.DataFrame], beds: pd.DataFrame) -> pd.DataFrame:
    """One row per bed: the gradient of the cone's resistance over its depth, and the resistance at the end."""
    rows = []
    for run, history in histories_by(histories, runs):
        z, q = history["depth_m"].to_numpy(), history["pressure_pa"].to_numpy()
        gradient, error = cone_gradient(z, q, run["depth_m"])
        last, last_error = pressure_at(z, q, SHARES[-1] * run["depth_m"])
        rows.append(
            {
                **run,
                "gradient_pa_m": gradient,
                "gradient_error_pa_m": error,
                "resistance_pa": last,
                "resistance_error_pa": last_error,
                "resistance_depth_m": SHARES[-1] * run["depth_m"],
            }
        )
    return beside_beds(pd.DataFrame(rows), beds)
