"""Step 1: what is known of a real soil, as values with a source or from raw laboratory files.

A soil file (YAML) gives each of cohesion_pa, friction_angle_deg and angle_of_repose_deg as {value, source,
standard_uncertainty}; or, in place of the first two, direct_shear_csv: {file, shear_area_m2, strength, source} with columns for
test (a number or name per test), normal stress, displacement and force; or, in place of the last, repose_csv: {file, source} with
a column for the angle of repose. Both may have `columns` (quantity: the file's own header) and `decimal`; see
`calibration.laboratory` for what is understood without. Files are looked for beside the soil file.
"""

from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd
import yaml

from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.calibration.laboratory import Readings, read_laboratory
from virtual_soil.calibration.mohr_coulomb import StrengthLine, fit_line

#: property -> (key in the soil file, unit, largest value; the smallest is 0)
PROPERTIES = {
    "cohesion": ("cohesion_pa", "Pa", np.inf),
    "friction_angle": ("friction_angle_deg", "deg", 90.0),
    "angle_of_repose": ("angle_of_repose_deg", "deg", 90.0),
}
#: laboratory files in a soil file -> keys of their entry
FILES = {
    "direct_shear_csv": {"file", "shear_area_m2", "strength", "source", "columns", "decimal"},
    "repose_csv": {"file", "source", "columns", "decimal"},
}
KEYS = {key for key, _, _ in PROPERTIES.values()} | set(FILES)
#: Stresses in a shear box; beyond them a unit or a sign is wrong.
STRESSES_PA = (1e-3, 1e9)
#: The plateau of a laboratory shear curve is the mean over this last fraction of its displacement.
PLATEAU_FRACTION = 0.2


def measure_soil(path: str | Path) -> pd.DataFrame:
    """One row per property: soil, property, value, standard_uncertainty (NaN if unknown), unit, source, method.

    Raises CalibrationError naming file, key and value when something is missing, unknown or impossible.
    """
    path = Path(path)
    content = soil_content(path)
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


def soil_content(path: Path) -> dict:
    """What a soil file says, its keys checked."""
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be read ({error.strerror}).") from error
    except (yaml.YAMLError, ValueError) as error:
        raise CalibrationError(f"{path}: not a YAML file ({' '.join(str(error).split())}).") from error
    demand(isinstance(content, dict), f"{path}", type(content).__name__, f"a mapping with keys of {sorted(KEYS)}")
    unknown = sorted(str(key) for key in content if key not in KEYS)
    demand(not unknown, f"{path}: keys {unknown}", "unknown", f"{sorted(KEYS)}")
    return content


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
    demand(is_number(entry["value"]), f"{path}: {key}.value", repr(entry["value"]), "a number")
    demand(isinstance(entry["source"], str), f"{path}: {key}.source", repr(entry["source"]), "a text")
    uncertainty = entry.get("standard_uncertainty")
    ok = uncertainty is None or is_number(uncertainty)
    demand(ok, f"{path}: {key}.standard_uncertainty", repr(uncertainty), "a number")
    return {
        "property": name,
        "value": float(entry["value"]),
        "standard_uncertainty": np.nan if uncertainty is None else float(uncertainty),
        "source": entry["source"],
        "method": "value",
    }


def laboratory_files(path: str | Path) -> list[Path]:
    """The laboratory files that a soil file names. Raises CalibrationError for a soil file that cannot be read."""
    path = Path(path)
    content = soil_content(path)
    return [laboratory_path(path, key, content[key]) for key in FILES if key in content]


def laboratory_path(soil: Path, key: str, entry) -> Path:
    """The laboratory file of one entry; it lies beside the soil file or below."""
    known = FILES[key]
    ok = isinstance(entry, dict) and isinstance(entry.get("file"), str) and set(entry) <= known
    demand(ok, f"{soil}: {key}", repr(entry), f"a mapping with the key file and others of {sorted(known)}")
    demand("\0" not in entry["file"], f"{soil}: {key}.file", repr(entry["file"]), "a file beside the soil file")
    path = soil.parent / entry["file"]
    inside = path.resolve().is_relative_to(soil.parent.resolve())
    demand(inside, f"{soil}: {key}.file", entry["file"], "a file beside the soil file")
    return path


def readings(soil: Path, key: str, entry, quantities: tuple[str, ...]) -> Readings:
    """The readings in a laboratory file."""
    path = laboratory_path(soil, key, entry)
    demand(isinstance(entry.get("source", ""), str), f"{soil}: {key}.source", repr(entry.get("source")), "a text")
    return read_laboratory(path, quantities, entry.get("columns"), entry.get("decimal"), f"{soil}: {key}")


def from_shear_tests(soil: Path, entry) -> list[dict]:
    """Cohesion and friction angle from force against displacement at several loads."""
    found = readings(soil, "direct_shear_csv", entry, ("test", "normal_stress", "displacement", "force"))
    area, kind = entry.get("shear_area_m2"), entry.get("strength", "peak")
    demand(is_number(area) and area > 0, f"{soil}: direct_shear_csv.shear_area_m2", area, "a positive number")
    demand(kind in ("peak", "plateau"), f"{soil}: direct_shear_csv.strength", repr(kind), "peak or plateau")
    box, stresses, strengths = soil.parent / entry["file"], [], []
    for name, test in found.table.groupby("test", sort=False):
        begin, end = test["displacement_m"].min(), test["displacement_m"].max()
        chosen = test if kind == "peak" else test[test["displacement_m"] >= end - PLATEAU_FRACTION * (end - begin)]
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
    """The Mohr-Coulomb line of a file's tests; refused where they do not determine one."""
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


def skipped(found: Readings) -> str:
    """How many rows a method did without, for its description."""
    return f", {found.n_skipped} empty rows skipped" if found.n_skipped else ""


def is_number(value) -> bool:
    """Whether a value from YAML is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(float(value)))


def from_heaps(soil: Path, entry) -> list[dict]:
    """Angle of repose from several heaps: mean and its standard error."""
    found = readings(soil, "repose_csv", entry, ("angle_of_repose",))
    angles = found.table["angle_of_repose_deg"].to_numpy()
    wrong = angles[(angles <= 0) | (angles >= 90)]
    where = f"{soil.parent / entry['file']}: angle of repose"
    demand(not len(wrong), where, f"{wrong[0] if len(wrong) else 0:g} deg", "above 0 and below 90 deg")
    error = angles.std(ddof=1) / np.sqrt(len(angles)) if len(angles) > 1 else np.nan
    return [
        {
            "property": "angle_of_repose",
            "value": float(angles.mean()),
            "standard_uncertainty": float(error),
            "source": entry.get("source", entry["file"]),
            "method": f"mean of {len(angles)} heaps{skipped(found)}",
        }
    ]
