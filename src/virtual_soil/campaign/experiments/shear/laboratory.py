"""Laboratory direct-shear tests: files of force or shear stress against displacement at several loads, or of strengths."""

from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd

from dem.experiments.strength import CurveError, peak, steady
from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.campaign.experiments.mohr_coulomb import LEAST_STRESSES, StrengthLine, fit_line
from virtual_soil.campaign.experiments.shear.ags import ags_strengths
from virtual_soil.campaign.experiments.shear.curves import NOMINAL, Curve, curves_of, nominal, told_apart
from virtual_soil.campaign.experiments.shear.definitions import PLATEAU_WINDOW
from virtual_soil.campaign.laboratory.ags import is_ags
from virtual_soil.campaign.laboratory.entry import READING, is_number, laboratory_paths, left_out, readings
from virtual_soil.campaign.laboratory.table import NoHeader, Readings
from virtual_soil.campaign.yamls import hint

#: Allowed keys of the entry in a soil file.
KEYS = READING | {"shear_area_m2", "strength", "sample"}
#: Cross-sections of shear boxes that nobody need insist on: others are most often in mm2 or cm2.
USUAL_AREAS_M2 = (1e-4, 10.0)
#: Strength that a soil file may ask for -> prefixes of the responses that it is the target of.
STRENGTHS = {"peak": ("", "peak_"), "plateau": ("",), "steady": ("steady_",)}
#: Plausible stresses in a shear box; outside this range a unit or a sign is wrong.
STRESSES_PA = (1e-3, 1e9)
#: What a curve needs, and what it may have beside it. The laboratory's own shear stress goes before the force.
CURVE = (("displacement",), ("shear_stress", "force"))
BESIDE = ("test", "normal_stress", "normal_force")
#: The same of a table of strengths without curves.
LOAD = ("normal_stress", "normal_force")
ENTRY = "direct_shear_csv"


@dataclass(frozen=True)
class ShearTests:
    """A laboratory's shear tests as they were understood.

    readings : all readings in SI units, with columns test, displacement_m, shear_stress_pa and normal_stress_pa; empty if the file
    states strengths without curves. curves : what counts of each test. points : label -> normal stress and strength in Pa.
    line : through the points. method : what was done, in words.
    """

    kind: str
    readings: pd.DataFrame
    curves: list[Curve]
    points: dict[str, tuple[float, float]]
    line: StrengthLine
    method: str


def read(soil: Path, entry) -> list[dict]:
    """Read shear tests at several loads and determine cohesion and friction angle of the strength asked for.

    They are targets of the experiments that measure the same strength: peak and steady of the plane shear test, peak and plateau of
    the shear box.
    """
    tests = understood(soil, entry)
    names = [path.name for path in laboratory_paths(soil, ENTRY, entry, KEYS)]
    shared = {"source": entry.get("source", ", ".join(names)), "method": tests.method, "strength": tests.kind}
    values = {
        "cohesion": (tests.line.cohesion_pa, tests.line.cohesion_se_pa),
        "friction_angle": (tests.line.friction_angle_deg, tests.line.friction_angle_se_deg),
    }
    return [
        {"property": f"{prefix}{name}", "value": value, "standard_uncertainty": error, **shared}
        for prefix in STRENGTHS[tests.kind]
        for name, (value, error) in values.items()
    ]


def understood(soil: Path, entry) -> ShearTests:
    """Read the shear tests of an entry; raises CalibrationError naming what is wrong."""
    paths = laboratory_paths(soil, ENTRY, entry, KEYS)
    kind = entry.get("strength", "peak")
    demand(kind in STRENGTHS, f"{soil}: {ENTRY}.strength", repr(kind), " or ".join(STRENGTHS))
    area, box = area_of(soil, entry), paths[0] if len(paths) == 1 else soil
    table, curves = pd.DataFrame(), []
    if any(map(is_ags, paths)):
        points, method = ags_strengths(f"{soil}: {ENTRY}", entry, paths, kind)
    else:
        table, curves, points, method = of_tables(soil, entry, paths, kind, area)
    for label, point in points.items():
        for what, value in (("normal stress", point[0]), (f"{kind} shear strength", point[1])):
            least, largest = STRESSES_PA
            where, allowed = f"{box}: {what} of test {label!r}", f"{least:g} to {largest:g} Pa; see units and signs"
            demand(least <= value <= largest, where, f"{value:g} Pa", allowed)
    line = strength_line(box, *np.array(list(points.values())).T)
    return ShearTests(kind, table, curves, points, line, f"direct shear, {len(points)} tests, {kind}{method}")


def of_tables(soil: Path, entry, paths: list[Path], kind: str, area_m2: float | None):
    """Readings, curves, points and method of tables of readings; the first two are empty for a table of strengths."""
    demand("sample" not in entry, f"{soil}: {ENTRY}.sample", repr(entry.get("sample")), "none: it is no AGS4 file; see `rows`")
    box = paths[0] if len(paths) == 1 else soil
    try:
        found = [readings(soil, ENTRY, entry, path, CURVE, BESIDE) for path in paths]
    except NoHeader as error:
        return pd.DataFrame(), [], *strengths_of(soil, entry, paths, kind, area_m2, error)
    table, apart = told_apart(tests_of(box, found, area_m2, soil))
    curves, remarks = curves_of(table, "shear_stress_pa")
    points, method = points_of(box, curves, kind)
    rest = dict.fromkeys(text for one in found for text in left_out(one).split(", ") if text)
    return table, curves, points, method + "".join(f", {text}" for text in (*rest, *apart, *remarks))


def area_of(soil: Path, entry) -> float | None:
    """Cross-section of the box in m2; None if the entry does not state it."""
    area = entry.get("shear_area_m2")
    if area is None:
        return None
    demand(is_number(area) and area > 0, f"{soil}: {ENTRY}.shear_area_m2", area, f"a positive number{hint(area)}")
    low, high = USUAL_AREAS_M2
    demand(
        entry.get("insist") is True or low <= area <= high,
        f"{soil}: {ENTRY}.shear_area_m2",
        f"{area:g}",
        f"usually {low:g} to {high:g} m2; if it is meant, add `insist: true` to the entry",
    )
    return float(area)


def over_area(soil: Path, values: pd.Series, area_m2: float | None) -> pd.Series:
    """Forces as stresses; raises CalibrationError if the area is not known."""
    demand(area_m2 is not None, f"{soil}: {ENTRY}.shear_area_m2", area_m2, "a positive number: the file has forces")
    return values / cast(float, area_m2)


def tests_of(box: Path, found: list[Readings], area_m2: float | None, soil: Path) -> pd.DataFrame:
    """Readings of all files as one table, with a label for every test, and stresses in place of forces."""
    parts = []
    for k, one in enumerate(found):
        table = one.table.copy()
        if "test" not in table:
            table["test"] = f"file {k + 1}" if len(found) > 1 else "the only one"
        elif len(found) > 1:
            table["test"] = f"file {k + 1}: " + table["test"].astype(str)
        parts.append(table)
    table = pd.concat(parts, ignore_index=True)
    if "normal_stress_pa" not in table:
        where, allowed = f"{box}: normal stress", "a column, or a text above the table such as `Normal stress: 25 kPa`"
        demand("normal_force_n" in table, where, "in no column and no title", allowed)
        table["normal_stress_pa"] = over_area(soil, table["normal_force_n"], area_m2)
    if "shear_stress_pa" not in table:
        table["shear_stress_pa"] = over_area(soil, table["force_n"], area_m2)
    for column in ("normal_stress_pa", "shear_stress_pa"):
        demand(bool(table[column].notna().all()), f"{box}: {column}", "missing in some tests", "a value for every test")
    return table


def points_of(box: Path, curves: list[Curve], kind: str) -> tuple[dict[str, tuple[float, float]], str]:
    """Normal stress and strength in Pa of every test, by its label, and how many still change, in words."""
    points, n_drifting = {}, 0
    for curve in curves:
        with np.errstate(over="ignore"):
            points[curve.label], drifting = strength_of(box, kind, curve)
        n_drifting += drifting
    return points, f"; in {n_drifting} of them it still changes at the end" if n_drifting else ""


def strengths_of(soil: Path, entry, paths: list[Path], kind: str, area_m2: float | None, curve_error: NoHeader):
    """Points of a table of strengths without curves, and what the method says; raises `curve_error` if the files are none."""
    name = {"peak": "peak_strength", "steady": "steady_strength"}.get(kind)
    columns = entry.get("columns")
    own = set(columns) if isinstance(columns, dict) else set()
    if name is None or own - {*LOAD, name, "test"}:
        raise curve_error
    try:
        found = [readings(soil, ENTRY, entry, path, (LOAD, (name,)), ("test",)) for path in paths]
    except NoHeader:
        raise curve_error from None
    table = pd.concat([one.table for one in found], ignore_index=True)
    if "normal_stress_pa" not in table:
        table["normal_stress_pa"] = over_area(soil, table["normal_force_n"], area_m2)
    points = {str(k + 1): (float(row["normal_stress_pa"]), float(row[f"{name}_pa"])) for k, (_, row) in enumerate(table.iterrows())}
    return points, f", strengths as the file states them{''.join(map(left_out, found))}"


def strength_of(box: Path, kind: str, curve: Curve) -> tuple[tuple[float, float], bool]:
    """Normal stress and shear strength of one test in Pa, by the definitions of the simulated tests; True if it still changes.

    Raises CalibrationError if the curve is too short to have a steady strength.
    """
    x, tau, p = curve.displacement_m, curve.shear, curve.normal_stress_pa
    try:
        if kind == "peak":
            highest = peak(x, tau, p)
            return (highest.normal_stress_pa, highest.shear_stress_pa), False
        if kind == "steady":
            last = steady(x, tau, p)
            return (last.normal_stress_pa, last.shear_stress_pa), not last.steady
    except CurveError as error:
        raise CalibrationError(f"{box}: test {curve.label!r}: {error}; or another `strength`: {', '.join(STRENGTHS)}.") from None
    late = x >= x.max() - PLATEAU_WINDOW * np.ptp(x)
    return (float(p[late].mean()), float(tau[late].mean())), False


def strength_line(box: Path, stresses: np.ndarray, strengths: np.ndarray) -> StrengthLine:
    """Fit the Mohr-Coulomb line to a file's tests; raises CalibrationError if they do not determine it."""
    n = nominal(stresses)
    allowed = f"at least {LEAST_STRESSES}; stresses closer than {NOMINAL:.0%} are one"
    demand(n >= LEAST_STRESSES, f"{box}: number of distinct normal stresses", n, allowed)
    try:
        with np.errstate(all="ignore"):
            line = fit_line(stresses, strengths)
    except CalibrationError as error:
        raise CalibrationError(f"{box}: {error}") from None
    except (np.linalg.LinAlgError, ZeroDivisionError):
        line = None
    known = line is not None and np.isfinite([line.cohesion_pa, line.cohesion_se_pa, line.friction_angle_se_deg]).all()
    allowed = "stresses and strengths that differ clearly between the tests"
    demand(
        bool(known),
        f"{box}: (normal stress, strength) in Pa",
        list(zip(stresses.tolist(), strengths.tolist(), strict=True)),
        allowed,
    )
    return cast(StrengthLine, line)
