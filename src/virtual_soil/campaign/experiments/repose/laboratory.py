"""Laboratory heaps: a file of measured angles of repose."""

from pathlib import Path

import numpy as np

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.noise import student
from virtual_soil.campaign.laboratory import readings, skipped

#: Allowed keys of the entry in a soil file.
KEYS = frozenset({"file", "source", "columns", "decimal", "insist"})


def read(soil: Path, entry) -> list[dict]:
    """Read the angle of repose of several heaps: mean and standard error, with Student's factor (see `noise.student`)."""
    found = readings(soil, "repose_csv", entry, KEYS, ("angle_of_repose",))
    angles = found.table["angle_of_repose_deg"].to_numpy()
    wrong = angles[(angles <= 0) | (angles >= 90)]
    where = f"{soil.parent / entry['file']}: angle of repose"
    demand(not len(wrong), where, f"{wrong[0] if len(wrong) else 0:g} deg", "above 0 and below 90 deg")
    few = len(angles) - 1
    error = float(student(few)) * angles.std(ddof=1) / np.sqrt(len(angles)) if few else np.nan
    return [
        {
            "property": "angle_of_repose",
            "value": float(angles.mean()),
            "standard_uncertainty": float(error),
            "source": entry.get("source", entry["file"]),
            "method": f"mean of {len(angles)} heaps{skipped(found)}",
        }
    ]
