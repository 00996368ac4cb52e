"""Parquet in and out: every table is checked against its schema and carries its provenance in the file's metadata.

workflow/schemas/<name>.yaml lists the columns of a table: type (string, integer, number, boolean), unit, meaning, and optionally
minimum, maximum, allowed values and whether values may be missing; `includes` takes over the columns of other tables. Columns
beyond the listed ones (a further material property, say) are let through. Simulations write dicts of columns, so that their short
jobs need not import pandas.
"""

import contextlib
import functools
import itertools
import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from _batches import may_hold

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


@contextlib.contextmanager
def readable(path: str | Path):
    """While inside, a file that is no Parquet is named in the error."""
    try:
        yield
    except (pa.ArrowInvalid, OSError) as error:
        raise TableError(f"{path}: not a readable Parquet file ({error}).") from error


def read_table(path: str, name: str):
    """Read a table and check it (DataFrame)."""
    with readable(path):
        frame = pq.ParquetFile(path).read().to_pandas()
    return check_table(frame, name, str(path))


def read_simulation(path: str, name: str, simulation: str):
    """The rows of one simulation in a table that may hold several (DataFrame); none where it failed."""
    with readable(path):
        frame = rows_of(path, simulation).to_pandas()
    return check_table(frame, name, str(path))


def read_simulations(path: str, name: str):
    """Yield (simulation, DataFrame) of a table that `stack_tables` wrote, one at a time; one that failed has no rows, nor turn."""
    with readable(path):
        file = pq.ParquetFile(path)
    for k in range(file.num_row_groups):
        with readable(path):
            frame = file.read_row_group(k).to_pandas()
        if len(check_table(frame, name, str(path))):
            yield frame["simulation"].iloc[0], frame


def folder_of(sims: Path, simulation: str) -> Path:
    """The newest folder of results/<study>/sims/<experiment> that holds a simulation; raises TableError where none does."""
    runs = [folder / "run.parquet" for folder in sims.glob("*") if may_hold(folder.name, simulation)]
    found = [path for path in runs if path.is_file() and len(rows_of(path, simulation))]
    if not found:
        raise TableError(f"{sims}: there is no result of simulation {simulation}.")
    return max(found, key=lambda path: path.stat().st_mtime).parent


def batch_results(runs, run_name: str, details, name: str, timings):
    """Yield (row of the run with its wall_time_s, its table `name` or None where it failed) of every simulation in all batches.

    The three lists of files belong together one by one. Only one simulation's table is held at a time; each comes once.
    """
    seen = set()
    for run_path, path, timing_path in zip(runs, details, timings, strict=True):
        seconds = json.loads(Path(timing_path).read_text(encoding="utf-8"))["wall_time_s"]
        rows = {row["simulation_id"]: row for row in read_table(run_path, run_name).to_dict("records")}
        with_rows = itertools.chain(read_simulations(path, name), ((failed, None) for failed in list(rows)))
        for simulation, frame in with_rows:
            if simulation not in seen:
                seen.add(simulation)
                yield {**rows[simulation], "wall_time_s": seconds[simulation]}, frame


def rows_of(path: str | Path, simulation: str) -> pa.Table:
    """One simulation's rows, by column simulation, or simulation_id in tables of one row each."""
    column = next(name for name in ("simulation", "simulation_id") if name in pq.read_schema(path).names)
    return pq.read_table(path, filters=[(column, "==", simulation)])


def stack_tables(paths: dict[str, Path], path: str, provenance: dict) -> None:
    """Write one table from those of several simulations (simulation -> file), a row group for each, in the order given."""
    schemas = [pq.read_schema(file).remove_metadata() for file in dict.fromkeys(paths.values())]
    metadata = {METADATA_KEY: json.dumps(provenance, sort_keys=True).encode()}
    schema = pa.unify_schemas(schemas, promote_options="permissive").with_metadata(metadata)
    with pq.ParquetWriter(path, schema, compression="zstd") as writer:
        for simulation, file in paths.items():
            rows = rows_of(file, simulation)
            writer.write_table(rows.cast(schema), row_group_size=max(len(rows), 1))


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


def read_provenance(path: str | Path) -> dict:
    """The provenance in a table's metadata; empty if it has none."""
    with readable(path):
        metadata = pq.read_schema(path).metadata or {}
    return json.loads(metadata.get(METADATA_KEY, b"{}"))
