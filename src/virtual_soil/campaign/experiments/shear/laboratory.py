"""Laboratory direct-shear tests: a file of force against displacement at several loads."""

from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd

from dem.experiments.strength import CurveError, peak, steady
from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.campaign.experiments.mohr_coulomb import StrengthLine, fit_line
from virtual_soil.campaign.experiments.shear.definitions import PLATEAU_WINDOW
from virtual_soil.campaign.laboratory import is_number, readings, skipped

#: Allowed keys of the entry in a soil file.
KEYS = frozenset({"file", "shear_area_m2", "strength", "source", "columns", "decimal", "insist"})
#: Cross-sections of shear boxes that nobody need insist on: others are most often in mm2 or cm2.
USUAL_AREAS_M2 = (1e-4, 10.0)
#: Strength that a soil file may ask for -> prefixes of the responses that it is the target of.
STRENGTHS = {"peak": ("", "peak_"), "plateau": ("",), "steady": ("steady_",)}
#: Plausible stresses in a shear box; outside this range a unit or a sign is wrong.
STRESSES_PA = (1e-3, 1e9)


def read(soil: Path, entry) -> list[dict]:
    """Read force against displacement at several loads and determine cohesion and friction angle of the strength asked for.

    They are targets of the experiments that measure the same strength: peak and steady of the plane shear test, peak and plateau of
    the shear box.
    """
    found = readings(soil, "direct_shear_csv", entry, KEYS, ("test", "normal_stress", "displacement", "force"))
    area, kind = entry.get("shear_area_m2"), entry.get("strength", "peak")
    demand(is_number(area) and area > 0, f"{soil}: direct_shear_csv.shear_area_m2", area, "a positive number")
    low, high = USUAL_AREAS_M2
    demand(
        entry.get("insist") is True or low <= area <= high,
        f"{soil}: direct_shear_csv.shear_area_m2",
        f"{area:g}",
        f"usually {low:g} to {high:g} m2; if it is meant, add `insist: true` to the entry",
    )
    demand(kind in STRENGTHS, f"{soil}: direct_shear_csv.strength", repr(kind), " or ".join(STRENGTHS))
    box, points, n_drifting = soil.parent / entry["file"], [], 0
    for name, test in found.table.groupby("test", sort=False):
        with np.errstate(over="ignore"):
            point, drifting = strength_of(box, str(name), kind, test, area)
        n_drifting += drifting
        for what, value in (("normal stress", point[0]), (f"{kind} shear strength", point[1])):
            least, largest = STRESSES_PA
            where, allowed = f"{box}: {what} of test {name!r}", f"{least:g} to {largest:g} Pa; see units and signs"
            demand(least <= value <= largest, where, f"{value:g} Pa", allowed)
        points.append(point)
    line = strength_line(box, *np.array(points).T)
    drift = f"; in {n_drifting} of them it still changes at the end" if n_drifting else ""
    shared = {
        "source": entry.get("source", entry["file"]),
        "method": f"direct shear, {len(points)} tests, {kind}{drift}{skipped(found)}",
        "strength": kind,
    }
    values = {
        "cohesion": (line.cohesion_pa, line.cohesion_se_pa),
        "friction_angle": (line.friction_angle_deg, line.friction_angle_se_deg),
    }
    return [
        {"property": f"{prefix}{name}", "value": value, "standard_uncertainty": error, **shared}
        for prefix in STRENGTHS[kind]
        for name, (value, error) in values.items()
    ]


def strength_of(box: Path, name: str, kind: str, test: pd.DataFrame, area_m2: float) -> tuple[tuple[float, float], bool]:
    """Normal stress and shear strength of one test in Pa, by the definitions of the simulated tests; True if it still changes.

    Raises CalibrationError if the curve is too short to have a steady strength.
    """
    curve = test["displacement_m"].to_numpy(), test["force_n"].to_numpy() / area_m2, test["normal_stress_pa"].to_numpy()
    try:
        if kind == "peak":
            return (float(curve[2].mean()), peak(*curve).shear_stress_pa), False
        if kind == "steady":
            last = steady(*curve)
            return (last.normal_stress_pa, last.shear_stress_pa), not last.steady
    except CurveError as error:
        raise CalibrationError(f"{box}: test {name!r}: {error}; or another `strength`: {', '.join(STRENGTHS)}.") from None
    begin, end = curve[0].min(), curve[0].max()
    return (float(curve[2].mean()), float(curve[1][curve[0] >= end - PLATEAU_WINDOW * (end - begin)].mean())), False


def strength_line(box: Path, stresses: np.ndarray, strengths: np.ndarray) -> StrengthLine:
    """Fit the Mohr-Coulomb line to a file's tests; raises CalibrationError if they do not determine it."""
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
