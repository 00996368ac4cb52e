"""Parquet in and out: every table is checked against its schema and carries its provenance in the file's metadata.

workflow/schemas/<name>.yaml lists the columns of a table: type (string, integer, number, boolean), unit, meaning, and optionally
minimum, maximum, allowed values and whether values may be missing; `includes` takes over the columns of other tables. Columns
beyond the listed ones (a further material property, say) are let through.
"""

import functools
import json
from pathlib import Path

import numpy as np
import pandas as pd
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
    columns = {}
    for other in schema.get("includes", ()):
        columns |= load_schema(other)
    return columns | schema["columns"]


def check_table(frame: pd.DataFrame, name: str, source: str) -> pd.DataFrame:
    """Return the table if it obeys schema `name`; raise TableError naming source, column, value and what is allowed."""
    columns = load_schema(name)
    for column, rule in columns.items():
        if column not in frame:
            raise TableError(f"{source}: column {column!r} is missing; a {name} table has {', '.join(columns)}.")
        check_column(frame[column], column, rule, source)
    return frame


def check_column(values: pd.Series, column: str, rule: dict, source: str) -> None:
    """Check one column's type, missing values, range and allowed values."""
    present = values.dropna()
    if len(present) < len(values) and not rule.get("missing_allowed"):
        raise TableError(f"{source}: column {column!r} has missing values in {len(values) - len(present)} of {len(values)} rows.")
    kind = "U" if isinstance(present.dtype, pd.StringDtype) else present.dtype.kind
    if len(present) and kind not in KINDS[rule["type"]]:
        raise TableError(f"{source}: column {column!r} holds {present.dtype}; allowed: {rule['type']}.")
    for bound, breaks in (("minimum", np.less), ("maximum", np.greater)):
        if bound in rule and len(present) and breaks(present.to_numpy(), rule[bound]).any():
            bad = present[breaks(present.to_numpy(), rule[bound])].iloc[0]
            raise TableError(f"{source}: column {column!r} holds {bad}; its {bound} is {rule[bound]}.")
    if "allowed" in rule and not present.isin(rule["allowed"]).all():
        bad = present[~present.isin(rule["allowed"])].iloc[0]
        raise TableError(f"{source}: column {column!r} holds {bad!r}; allowed: {', '.join(map(str, rule['allowed']))}.")


def write_table(frame: pd.DataFrame, path: str, name: str, provenance: dict) -> None:
    """Check a table and write it to Parquet with its provenance (any JSON-like dict)."""
    check_table(frame, name, path)
    table = pa.Table.from_pandas(frame, preserve_index=False)
    metadata = {**(table.schema.metadata or {}), METADATA_KEY: json.dumps(provenance, sort_keys=True).encode()}
    pq.write_table(table.replace_schema_metadata(metadata), path, compression="zstd")


def read_table(path: str, name: str) -> pd.DataFrame:
    """Read a table and check it; a file that is no Parquet is named in the error."""
    try:
        frame = pq.ParquetFile(path).read().to_pandas()
    except (pa.ArrowInvalid, OSError) as error:
        raise TableError(f"{path}: not a readable Parquet file ({error}).") from error
    return check_table(frame, name, str(path))


def read_provenance(path: str) -> dict:
    """The provenance in a table's metadata; empty if it has none."""
    metadata = pq.read_schema(path).metadata or {}
    return json.loads(metadata.get(METADATA_KEY, b"{}"))
