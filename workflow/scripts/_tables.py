"""Parquet in and out: every table is checked against its schema and carries its provenance in the file's metadata.

workflow/schemas/<name>.yaml lists the columns of a table: type (string, integer, number, boolean), unit, meaning, and optionally
minimum, maximum, allowed values and whether values may be missing; `includes` takes over the columns of other tables. Columns
beyond the listed ones (a further material property, say) are let through. Simulations write dicts of columns, so that their short
jobs need not import pandas.
"""

import functools
import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

SCHEMAS = Path(__file__).resolve().parents[1] / "schemas"
METADATA_KEY = b"virtual_soil"

KINDS = {"string": "OTU", "integer": "iu", "number": "fiu", "boolean": "b"}


class TableError(ValueError):
    """A table that does not obey its schema, or a file that is no table."""


@functools.cache
def load_schema(name: str) -> dict[str, dict]:
    """Rules of a table's columns, those of the schemas that it includes first."""
    schema = yaml.safe_load((SCHEMAS / f"{name}.yaml").read_text())
    columns: dict[str, dict] = {}
    for other in schema.get("includes", ()):
        columns |= load_schema(other)
    return columns | schema["columns"]


def check_table(table, name: str, source: str):
    """Return the table if it obeys schema `name`; raise TableError naming source, column, value and what is allowed.

    A table is a DataFrame, or a dict of columns.
    """
    columns = load_schema(name)
    for column, rule in columns.items():
        if column not in table:
            raise TableError(f"{source}: column {column!r} is missing; a {name} table has {', '.join(columns)}.")
        check_column(np.asarray(table[column]), column, rule, source)
    return table


def check_column(values: np.ndarray, column: str, rule: dict, source: str) -> None:
    """Check one column's type, missing values, range and allowed values."""
    missing = values != values if values.dtype.kind == "f" else np.array([v is None or v != v for v in values.flat], bool)  # noqa: PLR0124
    present = values[~missing]
    if missing.any() and not rule.get("missing_allowed"):
        raise TableError(f"{source}: column {column!r} has missing values in {missing.sum()} of {len(values)} rows.")
    if len(present) and present.dtype.kind not in KINDS[rule["type"]]:
        raise TableError(f"{source}: column {column!r} holds {present.dtype}; allowed: {rule['type']}.")
    for bound, breaks in (("minimum", np.less), ("maximum", np.greater)):
        if bound in rule and breaks(present, rule[bound]).any():
            bad = present[breaks(present, rule[bound])][0]
            raise TableError(f"{source}: column {column!r} holds {bad}; its {bound} is {rule[bound]}.")
    if "allowed" in rule and not np.isin(present, rule["allowed"]).all():
        bad = present[~np.isin(present, rule["allowed"])][0]
        raise TableError(f"{source}: column {column!r} holds {str(bad)!r}; allowed: {', '.join(map(str, rule['allowed']))}.")


def write_table(table, path: str, name: str, provenance: dict) -> None:
    """Check a table and write it to Parquet with its provenance (any JSON-like dict)."""
    check_table(table, name, path)
    if isinstance(table, dict):
        arrow = pa.Table.from_arrays([arrow_column(np.asarray(values)) for values in table.values()], names=list(table))
    else:
        arrow = pa.Table.from_pandas(table, preserve_index=False)
    metadata = {**(arrow.schema.metadata or {}), METADATA_KEY: json.dumps(provenance, sort_keys=True).encode()}
    pq.write_table(arrow.replace_schema_metadata(metadata), path, compression="zstd")


def arrow_column(values: np.ndarray) -> pa.Array:
    """One column of numbers or strings, made from memory: `pyarrow.array` would import pandas, a third of a short job's start."""
    if values.dtype.kind == "U":
        texts = [text.encode() for text in values]
        ends = np.cumsum([0, *map(len, texts)], dtype=np.int32)
        return pa.StringArray.from_buffers(len(texts), pa.py_buffer(ends), pa.py_buffer(b"".join(texts)))
    kind = {"f": (pa.float64(), np.float64), "i": (pa.int64(), np.int64)}[values.dtype.kind]
    return pa.Array.from_buffers(kind[0], len(values), [None, pa.py_buffer(np.ascontiguousarray(values, kind[1]))])


def read_table(path: str, name: str):
    """Read a table and check it (DataFrame); a file that is no Parquet is named in the error."""
    try:
        frame = pq.ParquetFile(path).read().to_pandas()
    except (pa.ArrowInvalid, OSError) as error:
        raise TableError(f"{path}: not a readable Parquet file ({error}).") from error
    return check_table(frame, name, str(path))


def read_all(paths, name: str):
    """One table from several files of the same kind; a simulation that is in more than one counts once."""
    import pandas as pd

    frames = [read_table(path, name) for path in paths]
    table = pd.concat([frame for frame in frames if len(frame)] or frames[:1], ignore_index=True)
    return table.drop_duplicates("simulation_id", ignore_index=True) if "simulation_id" in table else table


def empty_table(name: str):
    """A DataFrame without rows that has a schema's columns."""
    import pandas as pd

    kinds = {"string": str, "integer": int, "number": float, "boolean": bool}
    return pd.DataFrame({column: pd.Series(dtype=kinds[rule["type"]]) for column, rule in load_schema(name).items()})


def read_provenance(path: str) -> dict:
    """The provenance in a table's metadata; empty if it has none."""
    metadata = pq.read_schema(path).metadata or {}
    return json.loads(metadata.get(METADATA_KEY, b"{}"))
