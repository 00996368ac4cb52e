"""Laboratory heaps: a file of measured angles of repose, of both flanks' angles, or of heights and diameters."""

from pathlib import Path

import numpy as np
import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.noise import student
from virtual_soil.campaign.laboratory.entry import READING, laboratory_paths, left_out, readings
from virtual_soil.campaign.laboratory.table import NoHeader, Readings

#: Allowed keys of the entry in a soil file.
KEYS = READING
ENTRY = "repose_csv"
#: What a file of heaps may hold, tried in this order.
FORMS = (("angle_of_repose",), ("left_angle", "right_angle"), ("heap_height", "base_diameter"))


def read(soil: Path, entry) -> list[dict]:
    """Read the angle of repose of several heaps: mean and standard error, with Student's factor (see `noise.student`)."""
    paths = laboratory_paths(soil, ENTRY, entry, KEYS)
    found = [read_heaps(soil, entry, path) for path in paths]
    box = paths[0] if len(paths) == 1 else soil
    check_one_soil(box, pd.concat([one.table for one in found]))
    angles = np.concatenate([angles_of(one.table) for one in found])
    wrong = angles[(angles <= 0) | (angles >= 90)]
    demand(not len(wrong), f"{box}: angle of repose", f"{wrong[0] if len(wrong) else 0:g} deg", "above 0 and below 90 deg")
    few = len(angles) - 1
    same = few > 0 and np.ptp(angles) == 0.0
    demand(
        not same, f"{box}: angles of repose", f"{len(angles)} times {angles[0]:g} deg", "those of single heaps, not a mean repeated"
    )
    error = float(student(few)) * angles.std(ddof=1) / np.sqrt(len(angles)) if few else np.nan
    return [
        {
            "property": "angle_of_repose",
            "value": float(angles.mean()),
            "standard_uncertainty": float(error),
            "source": entry.get("source", ", ".join(path.name for path in paths)),
            "method": f"mean of {len(angles)} heaps{''.join(map(left_out, found))}",
        }
    ]


def read_heaps(soil: Path, entry, path: Path) -> Readings:
    """Read a file in the first form that it has; the error of the first form if it has none."""
    failure = None
    own = set(entry.get("columns") or {}) if isinstance(entry.get("columns"), dict) else set()
    for form in FORMS:
        if own - {*form, "soil"} and form is not FORMS[0]:
            continue
        try:
            return readings(soil, ENTRY, entry, path, form, ("soil",))
        except NoHeader as error:
            failure = failure or error
    assert failure is not None  # every form that is tried returns or fails
    raise failure


def angles_of(table: pd.DataFrame) -> np.ndarray:
    """Angle of repose of every heap in degrees."""
    if "left_angle_deg" in table:
        return 0.5 * (table["left_angle_deg"] + table["right_angle_deg"]).to_numpy()
    if "heap_height_m" in table:
        return np.degrees(np.arctan2(table["heap_height_m"], 0.5 * table["base_diameter_m"])).to_numpy()
    return table["angle_of_repose_deg"].to_numpy()


def check_one_soil(box: Path, table: pd.DataFrame) -> None:
    """Raise CalibrationError if the rows name several soils: names that differ by more than numbers."""
    if "soil" not in table:
        return
    names = sorted({"".join(c for c in str(name) if not c.isdigit()).strip(" .#_-") for name in table["soil"].dropna()})
    demand(len(names) < 2, f"{box}: soils", ", ".join(map(repr, names)), "one, chosen by `rows: {header: text}` in the soil file")
