"""Measurements of wheels and plates: CSV files in SI units, whose every cell is checked before anything runs.

The first line that is no comment (`#`) names the columns. Cells are split by commas, or by semicolons if the header has one.
A wheel's file has a row for a slip, a plate's file one for a diameter and a sinkage; rows of the same are repeated tests, of which
mean and standard deviation are taken. `*_sd_*` is the standard deviation of a row that stands alone; an empty cell is not known.

Signs are the product's: forces of the soil on the wheel, forwards positive; the motor's torque; sinkage downwards.
"""

import csv
import math
from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.campaign.laboratory.rows import text_of

#: Quantities of a wheel's file, those of which one must be there, and quantities of a plate's file.
OF_WHEEL, RESULTS, OF_PLATE = (
    ("slip", "load_n", "drawbar_pull_n", "torque_n_m", "sinkage_m"),
    ("drawbar_pull_n", "torque_n_m", "sinkage_m"),
    ("diameter_m", "sinkage_m", "pressure_pa"),
)
#: Slips, and lengths in m, that agree to this number of decimals are the same point.
SLIP_DECIMALS, LENGTH_DECIMALS = 2, 4
#: Measured loads may differ from the stated one by this share; rails and springs do not hold them better.
LOAD_TOLERANCE = 0.25
#: Largest pull over load, and torque over load and radius: none of a wheel on soil reaches half of them.
LARGEST_RATIO = 2.0
#: A sign is wrong if the value is beyond this share of the load, or two standard deviations, on the other side of zero.
SIGN_SHARE, SIGN_DEVIATIONS = 0.05, 2.0
#: Least bulk density in kg/m3, whose buoyancy any plate carries at least, and largest pressure over sinkage in Pa/m.
LEAST_DENSITY_KG_M3, LARGEST_STIFFNESS = 1e3, 1e9
#: Diameters in m that plates in soil have.
DIAMETERS_M = (1e-3, 2.0)


class Row(NamedTuple):
    """A row of a file: where it stands, and its numbers by column; nan for an empty cell."""

    place: str
    values: dict[str, float]

    def demand(self, condition: bool, name: str, allowed: str) -> None:
        """Raise CalibrationError naming file, line, column and value, unless the condition holds."""
        demand(condition, f"{self.place}: {name}", f"{self.values.get(name, math.nan):g}", allowed)


def sd_name(name: str) -> str:
    """Column of a quantity's standard deviation: `sd` comes before the unit."""
    for unit in ("_n_m", "_n", "_m", "_pa"):
        if name.endswith(unit):
            return f"{name.removesuffix(unit)}_sd{unit}"
    return f"{name}_sd"


def rows_of(path: str | Path, required: Collection[str], known: Collection[str]) -> list[Row]:
    """Rows of a file; raises CalibrationError for unknown or missing columns, and cells that are no numbers."""
    path = Path(path)
    lines = [(k, line) for k, line in enumerate(text_of(path, None).splitlines(), 1) if line.strip() and line.lstrip()[0] != "#"]
    demand(len(lines) > 1, f"{path}: number of rows", max(len(lines) - 1, 0), "a line of column names, and a row at least")
    delimiter = ";" if ";" in lines[0][1] else ","
    table = [(number, [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]) for number, line in lines]
    (first, header), body = table[0], table[1:]
    columns = ", ".join(known)
    for name in header:
        demand(name in known, f"{path}, line {first}: column {name!r}", "unknown", f"{columns}; all in SI units")
        demand(header.count(name) == 1, f"{path}, line {first}: column {name!r}", f"there {header.count(name)} times", "once")
    for name in required:
        demand(name in header, f"{path}, line {first}: column {name!r}", "missing", f"{', '.join(required)}, and any of {columns}")
    for number, cells in body:
        demand(
            len(cells) == len(header), f"{path}, line {number}: number of cells", len(cells), f"{len(header)}, as in line {first}"
        )
    return [
        Row(
            f"{path}, line {number}",
            {
                name: cell_number(f"{path}, line {number}: {name}", cell, name in required)
                for name, cell in zip(header, cells, strict=True)
            },
        )
        for number, cells in body
    ]


def cell_number(place: str, cell: str, required: bool) -> float:
    """Number in a cell; nan if it is empty and may be."""
    if not cell and not required:
        return math.nan
    try:
        number = float(cell)
    except ValueError:
        number = math.nan
    demand(math.isfinite(number), place, repr(cell), "a number" + ("" if required else ", or nothing"))
    return number


def check_deviations(row: Row, largest: dict[str, float]) -> None:
    """Refuse standard deviations that are negative or larger than a quantity can be; largest : by quantity."""
    for name, limit in largest.items():
        deviation = row.values.get(sd_name(name), math.nan)
        row.demand(math.isnan(deviation) or 0.0 <= deviation <= limit, sd_name(name), f"zero to {limit:.4g}")


def read_wheel(path: str | Path, radius_m: float, load_n: float) -> pd.DataFrame:
    """Measured points of a wheel, one row per slip, in the order of the slips.

    radius_m, load_n : of the wheel that is simulated; measurements of another are refused.

    Returns
    -------
    Columns slip, n_tests, and for load_n, drawbar_pull_n, torque_n_m, sinkage_m, drawbar_ratio (pull over load) and
    traction_coefficient (torque over load and radius) the mean and, named by `sd_name`, the standard deviation; nan if not known.

    Raises
    ------
    CalibrationError : a column is missing or unknown, or a value is not one of this wheel in SI units and the product's signs; one
    line that names file, line, value and what is allowed.
    """
    known = [name for quantity in OF_WHEEL for name in dict.fromkeys((quantity, sd_name(quantity))) if name != "slip_sd"]
    rows = rows_of(path, ("slip", "load_n"), known)
    found = [name for name in RESULTS if name in rows[0].values]
    demand(bool(found), f"{path}: measured quantities", "none", f"at least one column of {', '.join(RESULTS)}")
    for row in rows:
        check_wheel_row(row, radius_m, load_n)
    return merged([with_ratios(row, radius_m) for row in rows], {"slip": SLIP_DECIMALS}, [*OF_WHEEL[1:], *RATIOS])


def check_wheel_row(row: Row, radius_m: float, load_n: float) -> None:
    """Refuse a row that is not of this wheel, or not in these units and signs."""
    values = row.values
    slip, load = values["slip"], values["load_n"]
    row.demand(-1.0 <= slip < 1.0, "slip", "from -1 (locked) to below 1 (spinning on the spot); a share, not per cent")
    near = f"within {100 * LOAD_TOLERANCE:g} % of wheel.load_n, {load_n:g} N"
    row.demand(abs(load - load_n) <= LOAD_TOLERANCE * load_n, "load_n", near)
    check_deviations(row, {"load_n": load, "drawbar_pull_n": load, "torque_n_m": load * radius_m, "sinkage_m": radius_m})
    if not math.isnan(values.get("sinkage_m", math.nan)):
        allowed = f"0 to the wheel's radius, {radius_m:g} m, downwards"
        row.demand(0.0 <= values["sinkage_m"] <= radius_m, "sinkage_m", allowed)
    signs = {"drawbar_pull_n": (-1.0, slip < 0.0, "a braked wheel"), "torque_n_m": (1.0, slip > 0.0, "a driven wheel")}
    for name, scale in (("drawbar_pull_n", load), ("torque_n_m", load * radius_m)):
        value, deviation = values.get(name, math.nan), values.get(sd_name(name), math.nan)
        if math.isnan(value):
            continue
        row.demand(
            abs(value) <= LARGEST_RATIO * scale,
            name,
            f"up to {LARGEST_RATIO * scale:.3g} either way, {LARGEST_RATIO:g} of the load",
        )
        sign, applies, what = signs[name]
        margin = max(SIGN_SHARE * scale, 0.0 if math.isnan(deviation) else SIGN_DEVIATIONS * deviation)
        word = "negative" if sign < 0.0 else "positive"
        conventions = "forces of the soil on the wheel count forwards, torques are the motor's"
        row.demand(not applies or sign * value >= -margin, name, f"{word} of {what} (slip {slip:g}): {conventions}")


#: Ratios that are computed -> quantity, and whether the radius divides it, too.
RATIOS = {"drawbar_ratio": ("drawbar_pull_n", False), "traction_coefficient": ("torque_n_m", True)}


def with_ratios(row: Row, radius_m: float) -> dict[str, float]:
    """Numbers of a row with pull and torque over the load measured with them; deviations as if those of both were independent."""
    values = dict(row.values)
    load, load_sd = values["load_n"], values.get(sd_name("load_n"), math.nan)
    for ratio, (name, by_radius) in RATIOS.items():
        scale = load * (radius_m if by_radius else 1.0)
        value, deviation = values.get(name, math.nan) / scale, values.get(sd_name(name), math.nan) / scale
        values[ratio] = value
        values[sd_name(ratio)] = math.hypot(deviation, value * (0.0 if math.isnan(load_sd) else load_sd) / load)
    return values


def read_plates(path: str | Path, gravity_m_s2: float) -> pd.DataFrame:
    """Measured pressures under plates, one row per diameter and sinkage, in ascending order.

    gravity_m_s2 : of the tests, which tells pascals from other units.

    Returns
    -------
    Columns diameter_m, sinkage_m, n_tests, pressure_pa and pressure_sd_pa (nan if not known).

    Raises
    ------
    CalibrationError : as `read_wheel`.
    """
    rows = rows_of(path, OF_PLATE, [*OF_PLATE, sd_name("pressure_pa")])
    low, high = DIAMETERS_M
    for row in rows:
        row.demand(low <= row.values["diameter_m"] <= high, "diameter_m", f"{low:g} to {high:g}, in metres")
        diameter, sinkage = row.values["diameter_m"], row.values["sinkage_m"]
        row.demand(0.0 <= sinkage <= diameter, "sinkage_m", f"0 to the plate's diameter, {diameter:g} m")
        row.demand(row.values["pressure_pa"] >= 0.0, "pressure_pa", "zero or more")
        check_deviations(row, {"pressure_pa": max(one.values["pressure_pa"] for one in rows)})
    for diameter in sorted({row.values["diameter_m"] for row in rows}):
        check_stiffness([row for row in rows if row.values["diameter_m"] == diameter], gravity_m_s2)
    return merged([row.values for row in rows], {"diameter_m": LENGTH_DECIMALS, "sinkage_m": LENGTH_DECIMALS}, ["pressure_pa"])


def check_stiffness(rows: list[Row], gravity_m_s2: float) -> None:
    """Refuse pressures in another unit, by the deepest row of a plate: a curve's zero may be anywhere, its end not."""
    deepest = max(rows, key=lambda row: row.values["sinkage_m"])
    low, high = (limit * deepest.values["sinkage_m"] for limit in (LEAST_DENSITY_KG_M3 * gravity_m_s2, LARGEST_STIFFNESS))
    deepest.demand(
        low <= deepest.values["pressure_pa"] <= high, "pressure_pa", f"{low:.3g} to {high:.3g} at this sinkage, in pascals"
    )


def merged(rows: list[dict[str, float]], keys: dict[str, int], quantities: Collection[str]) -> pd.DataFrame:
    """One row for each point, in ascending order: mean and standard deviation of repeated tests, or what a single row says.

    keys : column of a point -> decimals to which its values agree.
    """
    groups: dict[tuple, list[dict[str, float]]] = {}
    for row in rows:
        groups.setdefault(tuple(round(row[key], decimals) + 0.0 for key, decimals in keys.items()), []).append(row)
    points = []
    for point, members in sorted(groups.items()):
        table = pd.DataFrame(members)
        found: dict[str, float] = {**dict(zip(keys, point, strict=True)), "n_tests": len(members)}
        for name in quantities:
            values = table[name].dropna() if name in table else pd.Series(dtype=float)
            stated = table[sd_name(name)].iloc[0] if sd_name(name) in table and len(members) == 1 else math.nan
            found[name] = float(values.mean()) if len(values) else math.nan
            found[sd_name(name)] = float(values.std(ddof=1)) if len(values) > 1 else float(stated)
        points.append(found)
    return pd.DataFrame(points)


def checked_files(wheel: dict, plate: dict, gravity_m_s2: float) -> list[str]:
    """Files of measurements that the study names; wheel, plate : its sections.

    Raises CalibrationError for a file without its source, a source without a file, measurements as the readers do, and a handbook's
    wheel that has no plates.
    """
    for name, section in (("wheel", wheel), ("plate", plate)):
        file, source = section["measured"]["file"], section["measured"]["source"]
        demand(file is None or bool(source), f"{name}.measured.source", source, f"a text that says where {file} comes from")
        demand(file is not None or source is None, f"{name}.measured.file", file, "a file, as there is a source")
    if wheel["measured"]["file"] is not None:
        read_wheel(wheel["measured"]["file"], wheel["shape"]["radius_m"], wheel["load_n"])
    low, high = plate["measured"]["compared_m"]
    demand(low < high, "plate.measured.compared_m", [low, high], "a lower and a higher sinkage")
    if plate["measured"]["file"] is not None:
        read_plates(plate["measured"]["file"], gravity_m_s2)
    handbook = wheel["handbook"]
    if handbook["internal_friction_angle_deg"] is not None:
        there = {"measured": plate["measured"]["file"] is not None, "simulated": bool(plate["diameters_m"])}
        allowed = "measured with plate.measured.file, or simulated with plate.diameters_m; or null as the handbook's angle"
        demand(there[handbook["plates"]], "wheel.handbook.plates", handbook["plates"], allowed)
    return [section["measured"]["file"] for section in (wheel, plate) if section["measured"]["file"] is not None]
