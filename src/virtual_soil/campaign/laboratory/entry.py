"""The laboratory file that an entry of a soil file names, and what its method says of the reading."""

from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from virtual_soil.calibration.errors import demand
from virtual_soil.campaign.laboratory.table import Alternatives, Readings, read_laboratory

#: Keys of every entry: the file, and how it is to be read.
READING = frozenset({"file", "source", "columns", "decimal", "encoding", "sheet", "rows", "insist"})


def laboratory_paths(soil: Path, key: str, entry, known: Collection[str]) -> list[Path]:
    """Paths of the laboratory files of an entry with known keys; they must be in the soil file's folder or below."""
    names = entry.get("file") if isinstance(entry, dict) else None
    names = names if isinstance(names, list) and names else [names]
    ok = isinstance(entry, dict) and all(isinstance(name, str) for name in names) and set(entry) <= set(known)
    demand(ok, f"{soil}: {key}", repr(entry), f"a mapping with the key file (or a list of files) and others of {sorted(known)}")
    demand(isinstance(entry.get("source", ""), str), f"{soil}: {key}.source", repr(entry.get("source")), "a text")
    paths = []
    for name in names:
        demand("\0" not in name, f"{soil}: {key}.file", repr(name), "a file beside the soil file")
        path = soil.parent / name
        inside = path.resolve().is_relative_to(soil.parent.resolve())
        demand(inside, f"{soil}: {key}.file", name, "a file beside the soil file")
        paths.append(path)
    return paths


def readings(
    soil: Path, key: str, entry: dict, path: Path, quantities: Sequence[str | Alternatives], optional: Collection[str] = ()
) -> Readings:
    """Read a laboratory file of an entry; quantities, optional : as of `read_laboratory`."""
    how = {name: entry.get(name) for name in ("encoding", "sheet", "rows")}
    return read_laboratory(path, quantities, entry.get("columns"), entry.get("decimal"), f"{soil}: {key}", optional=optional, **how)


def left_out(found: Readings) -> str:
    """What was left out or filled, as text for the description of the method."""
    empty = (f"{found.n_skipped} empty rows skipped",) if found.n_skipped else ()
    return "".join(f", {text}" for text in (*empty, *found.remarks))


def is_number(value) -> bool:
    """True if a value from YAML is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(float(value)))
