"""Laboratory direct-shear tests: a file of force against displacement at several loads."""

from pathlib import Path
from typing import cast

import numpy as np

from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.campaign.experiments.mohr_coulomb import StrengthLine, fit_line
from virtual_soil.campaign.experiments.shear.definitions import PLATEAU_WINDOW
from virtual_soil.campaign.laboratory import is_number, readings, skipped

#: Allowed keys of the entry in a soil file.
KEYS = frozenset({"file", "shear_area_m2", "strength", "source", "columns", "decimal", "insist"})
#: Cross-sections of shear boxes that nobody need insist on: others are most often in mm2 or cm2.
USUAL_AREAS_M2 = (1e-4, 10.0)
#: Plausible stresses in a shear box; outside this range a unit or a sign is wrong.
STRESSES_PA = (1e-3, 1e9)


def read(soil: Path, entry) -> list[dict]:
    """Read force against displacement at several loads and determine cohesion and friction angle."""
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
    demand(kind in ("peak", "plateau"), f"{soil}: direct_shear_csv.strength", repr(kind), "peak or plateau")
    box, stresses, strengths = soil.parent / entry["file"], [], []
    for name, test in found.table.groupby("test", sort=False):
        begin, end = test["displacement_m"].min(), test["displacement_m"].max()
        chosen = test if kind == "peak" else test[test["displacement_m"] >= end - PLATEAU_WINDOW * (end - begin)]
        with np.errstate(over="ignore"):
            strength = float(chosen["force_n"].max() if kind == "peak" else chosen["force_n"].mean()) / area
            stress = float(test["normal_stress_pa"].mean())
        for what, value in (("normal stress", stress), (f"{kind} shear strength", strength)):
            least, largest = STRESSES_PA
            where, allowed = f"{box}: {what} of test {name!r}", f"{least:g} to {largest:g} Pa; see units and signs"
            demand(least <= value <= largest, where, f"{value:g} Pa", allowed)
        stresses.append(stress)
        strengths.append(strength)
    line = strength_line(box, np.array(stresses), np.array(strengths))
    shared = {
        "source": entry.get("source", entry["file"]),
        "method": f"direct shear, {len(stresses)} tests, {kind}{skipped(found)}",
    }
    return [
        {"property": "cohesion", "value": line.cohesion_pa, "standard_uncertainty": line.cohesion_se_pa, **shared},
        {
            "property": "friction_angle",
            "value": line.friction_angle_deg,
            "standard_uncertainty": line.friction_angle_se_deg,
            **shared,
        },
    ]


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
