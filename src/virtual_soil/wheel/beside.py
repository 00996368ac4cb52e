"""Runs beside measurements: predicted, measured, difference, and a verdict for each point against criteria that are stated before.

The criteria are the state of the art of grain simulations of small wheels on dry sand, with nothing fitted to wheel or plates. They
say nothing about how well the measurements are known: figures and tables show that.
"""

import math
from collections.abc import Collection, Iterable

import numpy as np
import pandas as pd

from dem.measure.penetration import PowerLaw, power_law, pressure_at
from virtual_soil.campaign.tables import load_schema, read_table
from virtual_soil.wheel.handbook import Strength, curve
from virtual_soil.wheel.measured import FITTED, histories_by, stacked
from virtual_soil.wheel.measurements import SLIP_DECIMALS, read_plates, read_wheel, sd_name

#: Largest differences that agree: of sinkage and pressure over the measured one, and of the drawbar pull over the load.
SINKAGE_SHARE, PRESSURE_SHARE, DRAWBAR_DIFFERENCE = 0.30, 0.30, 0.05
#: A sign is decided by a value this number of its standard deviations or errors from zero.
SIGN_DEVIATIONS = 2.0
AGREES, MISSES, UNDECIDED, NOT_RUN, NO_CRITERION = "agrees", "misses", "not decided", "not run", "no criterion"
#: Quantities of a wheel in the order of the page; `drawbar_sign` and `pressure_growth` are criteria on others.
OF_WHEEL = ("sinkage_m", "drawbar_ratio", "drawbar_sign", "traction_coefficient")
#: Case -> diameter and law of the plate that the handbook's wheel takes.
Laws = dict[str, tuple[float, PowerLaw]]
#: Slips of the handbook's line: the runs' and a little beyond, but nothing nearer to locked or spinning.
LINE_SLIPS, BEYOND, N_LINE = (-0.95, 0.95), 0.05, 60


def beds_mean(values: pd.Series, errors: pd.Series) -> tuple[float, float, int]:
    """Mean over beds, its standard error (of one bed that of its run), and their number."""
    known = values.notna()
    n = int(known.sum())
    if n == 0:
        return math.nan, math.nan, 0
    error = values[known].std(ddof=1) / math.sqrt(n) if n > 1 else errors[known].iloc[0]
    return float(values[known].mean()), float(error), n


def difference_verdict(predicted: float, measured: float, allowed: float) -> str:
    """Verdict on a difference; allowed : nan without a criterion."""
    if math.isnan(predicted):
        return NOT_RUN
    if math.isnan(allowed):
        return NO_CRITERION
    return AGREES if abs(predicted - measured) <= allowed else MISSES


def sign_verdict(predicted: float, predicted_error: float, measured: float, measured_sd: float) -> str:
    """Verdict on a sign: not decided where either value is within two deviations of zero."""
    if math.isnan(predicted):
        return NOT_RUN
    for value, deviation in ((predicted, predicted_error), (measured, measured_sd)):
        if abs(value) <= SIGN_DEVIATIONS * (0.0 if math.isnan(deviation) else deviation):
            return UNDECIDED
    return AGREES if predicted * measured > 0.0 else MISSES


def point(found: tuple[float, float, int], measured: float, measured_sd: float, allowed: float, **where) -> dict:
    """Row of a point: found is the predicted mean, its error and the number of beds."""
    predicted, error, n = found
    row = {"case": "", "tool": "", "quantity": "", "slip": math.nan, "diameter_m": math.nan, "at_m": math.nan} | where
    row |= {"measured": measured, "measured_sd": measured_sd, "predicted": predicted, "predicted_error": error, "n_beds": n}
    return row | {
        "difference": predicted - measured,
        "allowed": allowed,
        "verdict": difference_verdict(predicted, measured, allowed),
    }


def wheel_points(table: pd.DataFrame, measured: pd.DataFrame) -> list[dict]:
    """Points of the wheel, for every case, measured slip and quantity that was measured.

    table : of schema wheel. measured : of `measurements.read_wheel`. Runs count at the slip that was asked for, if any.
    """
    done = table.assign(at=table["asked_slip"].fillna(table["slip"]).round(SLIP_DECIMALS) + 0.0)
    rows = []
    for case in dict.fromkeys(table["case"]):
        for _, test in measured.iterrows():
            beds = done[(done["case"] == case) & (done["at"] == test["slip"])]
            for name in OF_WHEEL:
                column = "drawbar_ratio" if name == "drawbar_sign" else name
                if math.isnan(test[column]):
                    continue
                found = beds_mean(beds[column], beds[error_of(column)])
                value, deviation = float(test[column]), float(test[sd_name(column)])
                allowed = {"sinkage_m": SINKAGE_SHARE * abs(value), "drawbar_ratio": DRAWBAR_DIFFERENCE}.get(name, math.nan)
                row = point(found, value, deviation, allowed, case=case, tool="wheel", quantity=name, slip=float(test["slip"]))
                if name == "drawbar_sign":
                    row["verdict"] = sign_verdict(*found[:2], value, deviation)
                rows.append(row)
    return rows


def error_of(column: str) -> str:
    """Column of the standard error of a quantity of the wheel's table."""
    return "sinkage_error_m" if column == "sinkage_m" else f"{column}_error"


def plate_points(
    runs: pd.DataFrame, histories: Iterable[pd.DataFrame], measured: pd.DataFrame, compared_m: tuple[float, float]
) -> list[dict]:
    """Points of the plates, for every case and measured pressure; and, between neighbouring diameters, the growth of the pressure.

    runs : of schema press_run; histories : of schema press_history, in the same order. measured : of `measurements.read_plates`.
    compared_m : sinkages between which pressures have a verdict.
    """
    pairs = list(histories_by(histories, runs))
    rows = []
    for case in dict.fromkeys(runs["case"]):
        mine = [(run, history) for run, history in pairs if run["case"] == case]
        of_case = []
        for _, test in measured.iterrows():
            diameter, sinkage = float(test["diameter_m"]), float(test["sinkage_m"])
            here = [history for run, history in mine if math.isclose(run["diameter_m"], diameter, rel_tol=1e-3)]
            read = [pressure_at(history["depth_m"], history["pressure_pa"], sinkage) for history in here]
            found = beds_mean(*(pd.Series([pair[k] for pair in read], dtype=float) for k in (0, 1)))
            counts = compared_m[0] - 1e-9 <= sinkage <= compared_m[1] + 1e-9
            value = float(test["pressure_pa"])
            allowed = PRESSURE_SHARE * value if counts else math.nan
            where = {"case": case, "tool": "plate", "quantity": "pressure_pa", "diameter_m": diameter, "at_m": sinkage}
            of_case.append(point(found, value, float(test["pressure_sd_pa"]), allowed, **where))
        rows += [*of_case, *growth_points(of_case)]
    return rows


def growth_points(rows: list[dict]) -> list[dict]:
    """Pressure of a plate over that of the next smaller one at the same sinkage, where pressures have a verdict.

    rows : of one case. The diameter is the larger one. Agrees if both ratios are on the same side of 1.
    """
    found = []
    for row in (row for row in rows if not math.isnan(row["allowed"])):
        smaller = [other for other in rows if other["at_m"] == row["at_m"] and other["diameter_m"] < row["diameter_m"]]
        if not smaller:
            continue
        base = max(smaller, key=lambda other: other["diameter_m"])
        if not (base["predicted"] > 0.0 or math.isnan(base["predicted"])) or not base["measured"] > 0.0:
            continue
        predicted, measured = row["predicted"] / base["predicted"], row["measured"] / base["measured"]
        error, deviation = (
            ratio_deviation(row, base, "predicted", "predicted_error"),
            ratio_deviation(row, base, "measured", "measured_sd"),
        )
        grown = point((predicted, error, min(row["n_beds"], base["n_beds"])), measured, deviation, math.nan, **{
            **{key: row[key] for key in ("case", "tool", "diameter_m", "at_m")}, "quantity": "pressure_growth",
        })  # fmt: skip
        if not math.isnan(predicted):
            grown["verdict"] = AGREES if (predicted > 1.0) == (measured > 1.0) else MISSES
        found.append(grown)
    return found


def ratio_deviation(row: dict, base: dict, value: str, deviation: str) -> float:
    """Standard deviation of row[value] / base[value], as if both were independent."""
    return math.hypot(row[deviation], base[deviation] * row[value] / base[value]) / base[value]


def nearest_diameter(diameters: Iterable[float], width_m: float) -> float:
    """Diameter of the plate nearest to a wheel's width."""
    return min(diameters, key=lambda diameter: abs(diameter - width_m))


def measured_law(measured: pd.DataFrame, width_m: float, depth_m: float) -> tuple[float, PowerLaw]:
    """Diameter and law of the measured plate nearest to the wheel's width, fitted over the sinkages of simulated plates."""
    diameter = nearest_diameter(measured["diameter_m"].unique(), width_m)
    plate = measured[measured["diameter_m"] == diameter]
    return diameter, power_law(plate["sinkage_m"], plate["pressure_pa"], FITTED[0] * depth_m, FITTED[1] * depth_m)


def simulated_law(table: pd.DataFrame, width_m: float) -> tuple[float, PowerLaw]:
    """Diameter and law of a case's simulated plate nearest to the wheel's width: the mean pressure of its beds' laws.

    table : rows of schema plate of one case. n is the mean of the beds', k that of the mean pressure in the middle of the depth.
    """
    diameter = nearest_diameter(table["diameter_m"].unique(), width_m)
    beds = table[table["diameter_m"] == diameter].drop_duplicates("seed").dropna(subset=["n"])
    middle = 0.5 * float(table["depth_m"].iloc[0])
    n = float(beds["n"].mean())
    k = float((beds["k_pa_m_n"] * middle ** beds["n"]).mean()) / middle**n
    return diameter, PowerLaw(k_pa_m_n=k, n=n, residual_ratio=float(beds["law_residual_ratio"].mean()))


def laws_of(tables: dict[str, pd.DataFrame], plates: str, measured: pd.DataFrame | None, depth_m: float) -> Laws:
    """Laws that the handbook's wheel takes: case -> diameter and law of the plate; "" for measured plates.

    tables : of schemas wheel and plate, by name. plates : "measured" or "simulated". depth_m : of the simulated tests.
    """
    width = float(tables["wheel"]["width_m"].iloc[0])
    if plates == "measured":
        return {} if measured is None else {"": measured_law(measured, width, depth_m)}
    return {str(case): simulated_law(rows, width) for case, rows in tables["plate"].groupby("case", sort=False)}


def handbook_table(
    tables: dict[str, pd.DataFrame], handbook: dict, measured_file: str | None, depth_m: float, gravity_m_s2: float
) -> pd.DataFrame:
    """The handbook's line, of schema wheel_handbook, for every law; for radius, width, load and slips of the runs.

    tables : of schemas wheel and plate, by name. handbook : section `wheel.handbook`. measured_file : of measured plates, or None.
    """
    strength = Strength(**{name: handbook[name] for name in Strength.__dataclass_fields__})
    measured = None if measured_file is None else read_plates(measured_file, gravity_m_s2)
    wheel, slips = tables["wheel"].iloc[0], tables["wheel"]["asked_slip"].dropna()
    low, high = (slips.min() - BEYOND, slips.max() + BEYOND) if len(slips) else LINE_SLIPS
    line = np.linspace(max(low, LINE_SLIPS[0]), min(high, LINE_SLIPS[1]), N_LINE)
    size = (float(wheel["applied_load_n"]), float(wheel["radius_m"]), float(wheel["width_m"]))
    rows = []
    for case, (diameter, law) in laws_of(tables, handbook["plates"], measured, depth_m).items():
        inputs = {"case": case, "diameter_m": diameter, "k_pa_m_n": law.k_pa_m_n, "n": law.n}
        inputs |= {name: getattr(strength, name) for name in Strength.__dataclass_fields__}
        if not math.isnan(law.n):
            rows += [inputs | row for row in curve(map(float, line), *size, law, strength)]
    return pd.DataFrame(rows, columns=None if rows else list(load_schema("wheel_handbook")))


def compared(
    table: pd.DataFrame,
    plate_runs: Collection[str],
    plate_histories: Collection[str],
    measured: dict[str, dict],
    gravity_m_s2: float,
) -> pd.DataFrame:
    """Table of all points, of schema wheel_measured.

    table : of schema wheel. plate_runs, plate_histories : files, one by one. measured : section `measured` of wheel and plate.
    """
    points: list[dict] = []
    if measured["wheel"]["file"] is not None:
        size = (float(table["radius_m"].iloc[0]), float(table["applied_load_n"].iloc[0]))
        points += wheel_points(table, read_wheel(measured["wheel"]["file"], *size))
    if measured["plate"]["file"] is not None and plate_runs:
        runs, histories = stacked(plate_runs, "press_run"), (read_table(path, "press_history") for path in plate_histories)
        plates = read_plates(measured["plate"]["file"], gravity_m_s2)
        points += plate_points(runs, histories, plates, measured["plate"]["compared_m"])
    return pd.DataFrame(points, columns=None if points else list(load_schema("wheel_measured")))
