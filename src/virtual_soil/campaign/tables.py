"""Reading and writing of Parquet tables, with checks against their schemas and provenance in the file's metadata.

schemas/<name>.yaml lists the columns of a table: type (string, integer, number, boolean), unit, meaning, and optionally minimum,
maximum, allowed values, `missing_allowed`, and `optional` for a column that older tables lack. `includes` adds the columns of other
schemas. A column name with {response} or {load} is expanded to one column per response or load; those of responses may be missing,
as a study need not measure all. `allowed: experiments` or `responses` means their names. Further columns (e.g. an additional
material property) are accepted. Simulations write dicts of columns, so that short jobs do not import pandas.
"""

import contextlib
import functools
import itertools
import json
from importlib import import_module
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from virtual_soil.campaign.batches import may_hold
from virtual_soil.campaign.files import whole
from virtual_soil.errors import InputError

#: Folders of schemas: of the campaign and of every experiment.
SCHEMAS = (Path(__file__).with_name("schemas"), *sorted(Path(__file__).with_name("experiments").glob("*/schemas")))
METADATA_KEY = b"virtual_soil"

KINDS = {"string": "OTU", "integer": "iu", "number": "fiu", "boolean": "b"}
#: The same for the columns of a file; a column without values has no type.
FILE_TYPES = {
    "string": (pa.types.is_string, pa.types.is_large_string, pa.types.is_null),
    "integer": (pa.types.is_integer,),
    "number": (pa.types.is_integer, pa.types.is_floating, pa.types.is_null),
    "boolean": (pa.types.is_boolean,),
}
#: Exceptions of the Parquet and JSON readers for a damaged file or a file of another format.
UNREADABLE = (pa.ArrowException, OSError, ValueError, TypeError, KeyError, OverflowError, RecursionError)
#: Remedy for a damaged result.
ADVICE = "Delete it and run again."


class TableError(InputError, ValueError):
    """Error: a table violates its schema, or a file is not a table."""


@functools.cache
def load_schema(name: str) -> dict[str, dict]:
    """Load the rules of a table's columns, starting with those of included schemas."""
    (path,) = (folder / f"{name}.yaml" for folder in SCHEMAS if (folder / f"{name}.yaml").is_file())
    schema = yaml.safe_load(path.read_text(encoding="utf-8"))
    columns: dict[str, dict] = {}
    for other in schema.get("includes", ()):
        columns |= load_schema(other)
    for column, rule in schema["columns"].items():
        columns |= dict(expanded(column, rule))
    return columns


def expanded(column: str, rule: dict):
    """Yield the columns of a schema's entry, expanded over responses or loads, with `allowed` lists resolved."""
    known = names()
    if isinstance(rule.get("allowed"), str):
        rule = rule | {"allowed": known[rule["allowed"]]}
    place = next((place for place in ("{response}", "{load}") if place in column), None)
    if place == "{response}":
        rule = rule | {"optional": True}
    for name in known[place] if place else ("",):
        yield column.replace(place or "", name) if place else column, rule


@functools.cache
def names() -> dict[str, list[str]]:
    """Names for schemas: experiments and responses, columns of responses and loads.

    The registry is imported by name, i.e. outside the code fingerprints: schemas only refuse tables, so no result depends on it.
    """
    registry = import_module("virtual_soil.campaign.experiments.registry")
    return {
        "experiments": [experiment.NAME for experiment in registry.EXPERIMENTS],
        "responses": list(registry.RESPONSES),
        "{response}": [response.column for response in registry.RESPONSES.values()],
        "{load}": list(registry.LOADS),
    }


def check_table(table, name: str, source: str):
    """Return the table if it conforms to schema `name`; raise TableError naming source, column, value and the allowed values.

    A table is a DataFrame, or a dict of columns.
    """
    columns = load_schema(name)
    for column, rule in columns.items():
        if column not in table:
            if rule.get("optional"):
                continue
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
    if not isinstance(table, dict) and table.empty:  # the dtypes of an empty DataFrame are undefined
        table = empty_table(name, table.columns)
    check_table(table, name, path)
    if isinstance(table, dict):
        arrow = pa.Table.from_arrays([arrow_column(np.asarray(values)) for values in table.values()], names=list(table))
    else:
        arrow = pa.Table.from_pandas(table, preserve_index=False)
    metadata = {**(arrow.schema.metadata or {}), METADATA_KEY: json.dumps(provenance, sort_keys=True).encode()}
    with whole(path) as part:
        pq.write_table(arrow.replace_schema_metadata(metadata), part, compression="zstd")


def arrow_column(values: np.ndarray) -> pa.Array:
    """Build a column from memory buffers: `pyarrow.array` would import pandas, a third of a short job's start-up time."""
    if values.dtype.kind == "U":
        texts = [text.encode() for text in values]
        ends = np.cumsum([0, *map(len, texts)], dtype=np.int32)
        return pa.StringArray.from_buffers(len(texts), pa.py_buffer(ends), pa.py_buffer(b"".join(texts)))
    kind = {"f": (pa.float64(), np.float64), "i": (pa.int64(), np.int64)}[values.dtype.kind]
    return pa.Array.from_buffers(kind[0], len(values), [None, pa.py_buffer(np.ascontiguousarray(values, kind[1]))])


@contextlib.contextmanager
def readable(path: str | Path):
    """Context manager: convert errors on an invalid or unexpected Parquet file into a TableError with its name and the remedy."""
    try:
        yield
    except TableError as error:
        raise TableError(f"{error} {ADVICE}") from None
    except UNREADABLE as error:
        raise TableError(f"{path}: not a readable Parquet file ({one_line(error)}). {ADVICE}") from error


def read_table(path: str, name: str):
    """Read and check a table (DataFrame); raises TableError naming the file, the fault and the remedy."""
    with readable(path), pq.ParquetFile(path) as file:
        check_types(file.schema_arrow, name, str(path))
        return check_table(file.read().to_pandas(ignore_metadata=True), name, str(path))


def check_types(schema: pa.Schema, name: str, source: str) -> None:
    """Check that a file has every column of schema `name` exactly once and with the right type."""
    rules = load_schema(name)
    for column, rule in rules.items():
        n = len(schema.get_all_field_indices(column))
        if n == 0 and rule.get("optional"):
            continue
        if n != 1:
            found = "missing" if n == 0 else f"there {n} times"
            raise TableError(f"{source}: column {column!r} is {found}; a {name} table has {', '.join(rules)}.")
        kind = schema.field(column).type
        if not any(fits(kind) for fits in FILE_TYPES[rule["type"]]):
            raise TableError(f"{source}: column {column!r} holds {kind}; allowed: {rule['type']}.")


def one_line(error: Exception) -> str:
    """Format a library's error message as one short line."""
    return " ".join(str(error).split())[:200] or type(error).__name__


def read_runs(path: str, name: str) -> dict[str, dict]:
    """Read simulation -> row of the run table, for all simulations in the folder of a file; raises the errors of `read_table`."""
    rows = {row["simulation_id"]: row for row in read_table(path, name).to_dict("records")}
    check_makers(path, rows)
    strangers = [simulation for simulation in rows if not may_hold(Path(path).parent.name, simulation)]
    if strangers:
        raise TableError(f"{path}: holds simulation {strangers[0]}, which does not belong into this folder. {ADVICE}")
    return rows


def check_makers(path: str, simulations) -> None:
    """Raise TableError unless the provenance of a file lists exactly these simulations."""
    with readable(path):
        made_by = read_provenance(path).get("simulations")
        if not isinstance(made_by, dict) or made_by.keys() != set(simulations):
            raise TableError(f"{path}: made by other simulations than {', '.join(simulations)}.")


def read_timing(path: str, simulations) -> dict[str, float]:
    """Read the wall times in s of a job's simulations; raises TableError if the file does not contain them."""
    try:
        noted = json.loads(Path(path).read_text(encoding="utf-8"))["wall_time_s"]
        seconds = {simulation: noted[simulation] for simulation in simulations}
        for value in seconds.values():
            if isinstance(value, bool) or not 0.0 <= value < np.inf:
                raise ValueError(f"wall_time_s is {value}")
    except UNREADABLE as error:
        raise TableError(f"{path}: not the wall times of its simulations ({one_line(error)}). {ADVICE}") from error
    return seconds


def read_simulation(path: str, name: str, simulation: str):
    """Read the rows of one simulation from a table of one or several (DataFrame); empty if it failed."""
    with readable(path):
        rows = rows_of(path, simulation)
        check_types(rows.schema, name, str(path))
        return check_table(rows.to_pandas(ignore_metadata=True), name, str(path))


def read_simulations(path: str, name: str):
    """Yield (simulation, DataFrame) from a table of `stack_tables`, one at a time; failed simulations are skipped."""
    with readable(path):
        file = pq.ParquetFile(path)
        check_types(file.schema_arrow, name, str(path))
    for k in range(file.num_row_groups):
        with readable(path):
            frame = check_table(file.read_row_group(k).to_pandas(ignore_metadata=True), name, str(path))
        if len(frame):
            yield frame["simulation"].iloc[0], frame


def folder_of(sims: Path, simulation: str) -> Path:
    """Return the newest folder of results/<study>/sims/<experiment> with a given simulation; raises TableError if there is none."""
    runs = [folder / "run.parquet" for folder in sims.glob("*") if may_hold(folder.name, simulation)]
    found = [path for path in runs if path.is_file() and len(rows_of(path, simulation))]
    if not found:
        raise TableError(f"{sims}: there is no result of simulation {simulation}.")
    return max(found, key=lambda path: path.stat().st_mtime).parent


def batch_results(runs, run_name: str, details, name: str, timings):
    """Yield (run row with wall_time_s, table `name` or None if it failed) of every simulation in all batches.

    The three lists of files correspond element by element. Only one simulation's table is in memory; each is yielded once.
    """
    seen = set()
    for run_path, path, timing_path in zip(runs, details, timings, strict=True):
        rows = read_runs(run_path, run_name)
        seconds = read_timing(timing_path, rows)
        check_makers(path, rows)
        with_rows = itertools.chain(read_simulations(path, name), ((failed, None) for failed in list(rows)))
        for simulation, frame in with_rows:
            if simulation not in seen:
                seen.add(simulation)
                yield {**rows[simulation], "wall_time_s": seconds[simulation]}, frame


def rows_of(path: str | Path, simulation: str) -> pa.Table:
    """Return the rows of one simulation, by column simulation, or simulation_id in tables of one row each.

    Raises TableError unless every row group belongs to one simulation. (A row filter would import pandas, a third of a short job's
    start-up time.)
    """
    with pq.ParquetFile(path) as file:
        places = (file.schema_arrow.get_field_index(column) for column in ("simulation", "simulation_id"))
        place = next((place for place in places if place >= 0), None)
        groups = [file.metadata.row_group(k) for k in range(file.num_row_groups)]
        some = [k for k, group in enumerate(groups) if group.num_rows and of_one(group, place, path) == simulation]
        return file.read_row_groups(some)


def of_one(group, place: int | None, source: str | Path) -> str:
    """Return the unique value in a column of a row group, from the file's statistics."""
    known = None if place is None else group.column(place).statistics
    if known is None or not known.has_min_max or known.min != known.max:
        raise TableError(f"{source}: a row group is not of one simulation.")
    return known.min


def stack_tables(paths: dict[str, Path], path: str, provenance: dict) -> None:
    """Combine the tables of several simulations (simulation -> file) into one file, one row group each, in the given order."""
    schemas = [pq.read_schema(file).remove_metadata() for file in dict.fromkeys(paths.values())]
    metadata = {METADATA_KEY: json.dumps(provenance, sort_keys=True).encode()}
    schema = pa.unify_schemas(schemas, promote_options="permissive").with_metadata(metadata)
    with whole(path) as part, pq.ParquetWriter(part, schema, compression="zstd") as writer:
        for simulation, file in paths.items():
            rows = rows_of(file, simulation)
            writer.write_table(rows.cast(schema), row_group_size=max(len(rows), 1))


def read_all(paths, name: str):
    """Combine several files of the same kind into one table; duplicate rows of a point and simulation are dropped."""
    import pandas as pd

    frames = [read_table(path, name) for path in paths]
    table = pd.concat([frame for frame in frames if len(frame)] or frames[:1], ignore_index=True)
    return table.drop_duplicates(["simulation_id", "point_id"], ignore_index=True) if "simulation_id" in table else table


def empty_table(name: str, further=()):
    """Return a DataFrame without rows, with a schema's columns and further numeric columns."""
    import pandas as pd

    kinds = {"string": str, "integer": int, "number": float, "boolean": bool}
    types = dict.fromkeys(further, float) | {
        column: kinds[rule["type"]] for column, rule in load_schema(name).items() if not rule.get("optional")
    }
    return pd.DataFrame({column: pd.Series(dtype=kind) for column, kind in types.items()})


def read_provenance(path: str | Path) -> dict:
    """Read the provenance from a table's metadata; empty if there is none."""
    return provenance_in(pq.read_schema(path), str(path))


def provenance_in(schema: pa.Schema, source: str) -> dict:
    """Parse the provenance in a file's metadata; raises TableError if it is invalid."""
    try:
        found = json.loads((schema.metadata or {}).get(METADATA_KEY, b"{}"))
    except UNREADABLE as error:
        raise TableError(f"{source}: where it comes from cannot be read ({one_line(error)}).") from error
    if not isinstance(found, dict):
        raise TableError(f"{source}: where it comes from is {type(found).__name__}; allowed: a mapping.")
    return found
