"""Step 1: the targets, i.e. the measured responses of a real soil: values with a source, or raw laboratory files.

A soil file (YAML) lists responses by their column names (e.g. cohesion_pa) as {value, source, standard_uncertainty}; any of them,
at least one. Instead of the responses of an experiment it may contain the entry that the experiment reads (its LABORATORY, e.g.
`direct_shear_csv`): a laboratory file in the same folder, with `columns` (quantity: header in the file), `decimal` and further keys
of the experiment's `laboratory` module. The accepted files are described in `campaign.laboratory`.
"""

from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.calibration.response import Response
from virtual_soil.campaign import settings, yamls
from virtual_soil.campaign.described import described, out_of_the_usual
from virtual_soil.campaign.experiments import module_of
from virtual_soil.campaign.experiments.apparatus import SECTIONS
from virtual_soil.campaign.experiments.registry import EXPERIMENTS, RESPONSES
from virtual_soil.campaign.laboratory.entry import is_number, laboratory_paths

#: Entry of a soil file -> the experiment whose laboratory module reads it.
FILES = {experiment.LABORATORY: experiment.NAME for experiment in EXPERIMENTS if experiment.LABORATORY}
#: Which strength a value may say that it is.
STATED_STRENGTHS = ("peak", "plateau", "steady")
KEYS = {response.column for response in RESPONSES.values()} | set(FILES) | set(SECTIONS)


def reader(entry: str):
    """Return the laboratory module that reads an entry of a soil file."""
    return import_module(module_of(FILES[entry], "laboratory"))


def measure_soil(path: str | Path) -> pd.DataFrame:
    """Return one row per response given: soil, property, value, standard_uncertainty (NaN if unknown), unit, source, method.

    Raises CalibrationError naming file, key and value if there is none, or if an entry is unknown or impossible.
    """
    path = Path(path)
    content = soil_content(path)
    rows = [
        {**row, "insist": insists(path, entry, content[entry])}
        for entry in FILES
        if entry in content
        for row in reader(entry).read(path, content[entry])
    ]
    rows += [from_value(path, response, content[response.column]) for response in RESPONSES.values() if response.column in content]
    found = [row["property"] for row in rows]
    demand(len(found) > 0, f"{path}", "no response", f"at least one of {', '.join(sorted(KEYS))}")
    for name, response in RESPONSES.items():
        times = found.count(name)
        demand(times < 2, f"{path}: {response.column}", f"given {times} times", "once, as a value or from a CSV")
    table = pd.DataFrame([{"strength": "", **row} for row in rows])
    table["unit"] = table["property"].map(lambda name: RESPONSES[name].unit)
    table.insert(0, "soil", path.stem)
    insisted = {RESPONSES[row["property"]].name for row in rows if row.pop("insist", False)}
    for row in rows:
        check_range(path, RESPONSES[row["property"]], row, row["property"] in insisted)
    return table.drop(columns="insist", errors="ignore")


def soil_content(path: Path) -> dict:
    """Read a soil file and check its keys."""
    try:
        content = yamls.load_file(path)
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be read ({error.strerror}).") from error
    except (yaml.YAMLError, ValueError) as error:
        raise CalibrationError(f"{path}: not a YAML file ({' '.join(str(error).split())}).") from error
    demand(isinstance(content, dict), f"{path}", type(content).__name__, f"a mapping with keys of {sorted(KEYS)}")
    unknown = sorted(str(key) for key in content if key not in KEYS)
    demand(not unknown, f"{path}: keys {unknown}", "unknown", f"{sorted(KEYS)}")
    for section, kind in SECTIONS.items():
        if section in content:
            check_apparatus(path, section, kind, content[section])
    return content


def check_apparatus(path: Path, section: str, kind: type, stated) -> None:
    """Raise CalibrationError for an entry that states a test as no laboratory can have done it."""
    known = f"a mapping with keys of {sorted(settings.defaults(kind))}"
    demand(isinstance(stated, dict), f"{path}: {section}", repr(stated), known)
    keys = {key: value for key, value in stated.items() if key != "insist"}
    lines = described(keys, settings.schema(kind) | {"required": []}, f"{path}: {section}")
    lines = lines or ([] if insists(path, section, stated) else out_of_the_usual(keys, kind, f"{path}: {section}"))
    if lines:
        raise CalibrationError(lines[0])


def check_range(path: Path, response: Response, row: dict, insisted: bool) -> None:
    """Raise CalibrationError for impossible targets, and for unusual ones unless insisted on."""
    key, value, uncertainty = f"{path}: {response.column}", row["value"], row["standard_uncertainty"]
    if response.signed:
        # the intercept of a regression through noisy tests may be negative
        least = 0.0 if row["method"] == "value" or np.isnan(uncertainty) else -2.0 * uncertainty
        demand(value >= least, key, value, "zero or more, or as a regression's intercept within two standard errors of zero")
    else:
        demand(0 < value < response.maximum, key, value, f"above 0 and below {response.maximum:g} {response.unit}")
    demand(np.isnan(uncertainty) or uncertainty >= 0, f"{key} standard_uncertainty", uncertainty, "zero or more")
    low, high = response.usual
    demand(
        insisted or low <= value <= high,
        key,
        f"{value:g}",
        f"usually {low:g} to {high:g} {response.unit}; if it is meant, add `insist: true` to its entry",
    )


def from_value(path: Path, response: Response, entry) -> dict:
    """Row of a response given as a value."""
    key = response.column
    allowed = {"value", "source", "standard_uncertainty", "strength", "insist"}
    demand(isinstance(entry, dict) and set(entry) <= allowed, f"{path}: {key}", entry, f"a mapping with keys of {sorted(allowed)}")
    for required in ("value", "source"):
        demand(required in entry, f"{path}: {key}.{required}", "missing", "a value with its source")
    demand(is_number(entry["value"]), f"{path}: {key}.value", repr(entry["value"]), f"a number{yamls.hint(entry['value'])}")
    demand(isinstance(entry["source"], str), f"{path}: {key}.source", repr(entry["source"]), "a text")
    uncertainty = entry.get("standard_uncertainty")
    ok = uncertainty is None or is_number(uncertainty)
    demand(ok, f"{path}: {key}.standard_uncertainty", repr(uncertainty), f"a number{yamls.hint(uncertainty)}")
    return {
        "property": response.name,
        "value": float(entry["value"]),
        "standard_uncertainty": np.nan if uncertainty is None else float(uncertainty),
        "source": entry["source"],
        "method": "value",
        "strength": strength_in(path, key, entry),
        "insist": insists(path, key, entry),
    }


def strength_in(path: Path, key: str, entry: dict) -> str:
    """Strength that an entry states; empty if it states none."""
    stated = entry.get("strength", "")
    demand(stated in ("", *STATED_STRENGTHS), f"{path}: {key}.strength", repr(stated), " or ".join(STATED_STRENGTHS))
    return stated


def insists(path: Path, key: str, entry: dict) -> bool:
    """True if an entry of a soil file insists on unusual numbers."""
    demand(isinstance(entry.get("insist", False), bool), f"{path}: {key}.insist", repr(entry.get("insist")), "true or false")
    return entry.get("insist", False)


def laboratory_files(path: str | Path) -> list[Path]:
    """Return the laboratory files named in a soil file. Raises CalibrationError for a soil file that cannot be read."""
    path = Path(path)
    content = soil_content(path)
    return [
        file for entry in FILES if entry in content for file in laboratory_paths(path, entry, content[entry], reader(entry).KEYS)
    ]
