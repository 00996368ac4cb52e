"""Step 1: what is known of a real soil, as values with a source or from raw laboratory CSV files.

A soil file (YAML) gives each of cohesion_pa, friction_angle_deg and angle_of_repose_deg as {value, source,
standard_uncertainty}; or, in place of the first two, direct_shear_csv: {file, shear_area_m2, strength, source} with the columns
normal_stress_pa, displacement_m, force_n and test (a number per test); or, in place of the last, repose_csv: {file, source} with
the column angle_of_repose_deg. Files are looked for beside the soil file.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from calibration.errors import CalibrationError, demand
from calibration.mohr_coulomb import fit_line

#: property -> (key in the soil file, unit, largest value; the smallest is 0)
PROPERTIES = {
    "cohesion": ("cohesion_pa", "Pa", np.inf),
    "friction_angle": ("friction_angle_deg", "deg", 90.0),
    "angle_of_repose": ("angle_of_repose_deg", "deg", 90.0),
}
KEYS = {key for key, _, _ in PROPERTIES.values()} | {"direct_shear_csv", "repose_csv"}
#: The plateau of a laboratory shear curve is the mean over this last fraction of its displacement.
PLATEAU_FRACTION = 0.2


def measure_soil(path: str | Path) -> pd.DataFrame:
    """One row per property: soil, property, value, standard_uncertainty (NaN if unknown), unit, source, method.

    Raises CalibrationError naming file, key and value when something is missing, unknown or impossible.
    """
    path = Path(path)
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    demand(isinstance(content, dict), f"{path}", type(content).__name__, f"a mapping with keys of {sorted(KEYS)}")
    unknown = set(content) - KEYS
    demand(not unknown, f"{path}: keys {sorted(unknown)}", "unknown", f"{sorted(KEYS)}")
    rows = []
    if "direct_shear_csv" in content:
        rows += from_shear_tests(path, content["direct_shear_csv"])
    if "repose_csv" in content:
        rows += from_heaps(path, content["repose_csv"])
    for name, (key, _, _) in PROPERTIES.items():
        if key in content:
            rows.append(from_value(path, name, key, content[key]))
    found = [row["property"] for row in rows]
    for name, (key, _, _) in PROPERTIES.items():
        demand(found.count(name) == 1, f"{path}: {key}", f"given {found.count(name)} times", "once, as a value or from a CSV")
    table = pd.DataFrame(rows)
    table["unit"] = table["property"].map(lambda name: PROPERTIES[name][1])
    table.insert(0, "soil", path.stem)
    for row in rows:
        check_range(path, row)
    return table


def check_range(path: Path, row: dict) -> None:
    """Refuse impossible properties."""
    key, unit, largest = PROPERTIES[row["property"]]
    value, uncertainty = row["value"], row["standard_uncertainty"]
    if row["property"] == "cohesion":
        # the intercept of a regression through dry sand's tests lies on either side of zero
        least = 0.0 if row["method"] == "value" or np.isnan(uncertainty) else -2.0 * uncertainty
        demand(
            value >= least,
            f"{path}: {key}",
            value,
            "zero or more, or as a regression's intercept within two standard errors of zero",
        )
    else:
        demand(0 < value < largest, f"{path}: {key}", value, f"above 0 and below {largest:g} {unit}")
    demand(np.isnan(uncertainty) or uncertainty >= 0, f"{path}: {key} standard_uncertainty", uncertainty, "zero or more")


def from_value(path: Path, name: str, key: str, entry) -> dict:
    """A property given as a value."""
    allowed = {"value", "source", "standard_uncertainty"}
    demand(isinstance(entry, dict) and set(entry) <= allowed, f"{path}: {key}", entry, f"a mapping with keys of {sorted(allowed)}")
    for required in ("value", "source"):
        demand(required in entry, f"{path}: {key}.{required}", "missing", "a value with its source")
    demand(isinstance(entry["value"], int | float), f"{path}: {key}.value", repr(entry["value"]), "a number")
    return {
        "property": name,
        "value": float(entry["value"]),
        "standard_uncertainty": float(entry.get("standard_uncertainty", np.nan)),
        "source": entry["source"],
        "method": "value",
    }


def read_csv(soil: Path, key: str, entry, columns: list[str]) -> pd.DataFrame:
    """A laboratory CSV beside the soil file, with the columns that are needed, all of them finite numbers."""
    demand(isinstance(entry, dict) and "file" in entry, f"{soil}: {key}", entry, "a mapping with the key file")
    path = soil.parent / entry["file"]
    demand(
        path.resolve().is_relative_to(soil.parent.resolve()),
        f"{soil}: {key}.file",
        entry["file"],
        "a file beside the soil file",
    )
    try:
        table = pd.read_csv(path, comment="#")
    except (OSError, ValueError) as error:
        raise CalibrationError(f"{path}: cannot be read as CSV ({error}).") from error
    for column in columns:
        demand(column in table, f"{path}: column {column}", "missing", f"columns {columns}")
        values = pd.to_numeric(table[column], errors="coerce")
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad):
            raise CalibrationError(
                f"{path}: column {column} holds {table[column].iloc[bad[0]]!r} in row {bad[0] + 1}; allowed: a number."
            )
        table[column] = values
    return table


def from_shear_tests(soil: Path, entry) -> list[dict]:
    """Cohesion and friction angle from force against displacement at several loads."""
    table = read_csv(soil, "direct_shear_csv", entry, ["test", "normal_stress_pa", "displacement_m", "force_n"])
    area, kind = entry.get("shear_area_m2"), entry.get("strength", "peak")
    demand(isinstance(area, int | float) and area > 0, f"{soil}: direct_shear_csv.shear_area_m2", area, "a positive number")
    demand(kind in ("peak", "plateau"), f"{soil}: direct_shear_csv.strength", repr(kind), "peak or plateau")
    stresses, strengths = [], []
    for _, test in table.groupby("test"):
        end = test["displacement_m"].max()
        chosen = test if kind == "peak" else test[test["displacement_m"] >= (1 - PLATEAU_FRACTION) * end]
        strengths.append((chosen["force_n"].max() if kind == "peak" else chosen["force_n"].mean()) / area)
        stresses.append(test["normal_stress_pa"].mean())
    line = fit_line(np.array(stresses), np.array(strengths))
    shared = {"source": entry.get("source", entry["file"]), "method": f"direct shear, {len(stresses)} tests, {kind}"}
    return [
        {"property": "cohesion", "value": line.cohesion_pa, "standard_uncertainty": line.cohesion_se_pa, **shared},
        {
            "property": "friction_angle",
            "value": line.friction_angle_deg,
            "standard_uncertainty": line.friction_angle_se_deg,
            **shared,
        },
    ]


def from_heaps(soil: Path, entry) -> list[dict]:
    """Angle of repose from several heaps: mean and its standard error."""
    angles = read_csv(soil, "repose_csv", entry, ["angle_of_repose_deg"])["angle_of_repose_deg"].to_numpy()
    demand(len(angles) > 0, f"{soil}: repose_csv", "empty", "at least one heap")
    error = angles.std(ddof=1) / np.sqrt(len(angles)) if len(angles) > 1 else np.nan
    return [
        {
            "property": "angle_of_repose",
            "value": float(angles.mean()),
            "standard_uncertainty": float(error),
            "source": entry.get("source", entry["file"]),
            "method": f"mean of {len(angles)} heaps",
        }
    ]
