"""Declaration of settings: type, default, range and meaning in one line of a section's class.

A section is a frozen dataclass whose fields are made by `setting` (a value), `section` (a nested section) or `choice` (one of a few
texts). config/schema.yaml, config/config.yaml and docs/configuration.md are written from these classes (`make settings`).
"""

import dataclasses
import types
import typing
from typing import Any

#: Pattern of names that are part of paths, and its schema.
NAME = r"[A-Za-z0-9][A-Za-z0-9_-]*"
NAMES: dict[str, Any] = {"type": "string", "maxLength": 100, "pattern": rf"^{NAME}$(?!\n)"}

KINDS = {float: "number", int: "integer", bool: "boolean", str: "string", dict: "object"}
#: Keyword of `setting` -> keyword of the schema.
BOUNDS = {"minimum": "minimum", "above": "exclusiveMinimum", "maximum": "maximum", "below": "exclusiveMaximum"}


def setting(
    meaning: str, default: Any, *, note: str = "", of: dict | None = None, usual: tuple[float, float] | None = None, **bounds: Any
) -> Any:
    """Declare a setting.

    Parameters
    ----------
    meaning : one phrase, with the unit if the name has none. default : value in the default study. note : background in one
    sentence, for the default configuration file. of : further keywords of the schema. bounds : minimum, above (exclusive), maximum,
    below (exclusive); for a list or a mapping they apply to its numbers. usual : lowest and highest number that nobody need insist
    on; one beyond is most often in another unit.
    """
    limits = {BOUNDS[key]: value for key, value in bounds.items()}
    metadata = {"meaning": meaning, "note": note, "of": of or {}, "usual": usual, "bounds": limits}
    if isinstance(default, dict | list):
        return dataclasses.field(default_factory=lambda: default, metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def section(kind: type, note: str = "", **changes: Any) -> Any:
    """Declare a nested section of a class; changes : defaults that differ from the class's."""
    return dataclasses.field(default_factory=lambda: kind(**changes), metadata={"section": kind, "note": note})


def choice(meaning: str, default: str, allowed: typing.Iterable[str], note: str = "") -> Any:
    """Declare a setting with a few allowed strings."""
    return setting(meaning, default, note=note, of={"enum": list(allowed)})


def make(name: str, doc: str, fields: dict[str, tuple[Any, Any]]) -> type:
    """Create a section class from fields known only at run time: name -> (type, result of `setting` or `section`)."""
    made = dataclasses.make_dataclass(name, [(key, *entry) for key, entry in fields.items()], frozen=True, kw_only=True)
    made.__doc__ = doc
    return made


def defaults(kind: type) -> dict:
    """Default values of a section, as in a configuration."""
    return dataclasses.asdict(kind())


def in_declared_order(values: dict, kind: type) -> dict:
    """Copy of a section with its keys, and those of its nested sections, in the order of the class.

    Snakemake compares parameters as text: without this, a section written in another order would rerun what depends on it.
    """
    ordered = {}
    for field in dataclasses.fields(kind):
        if field.name in values:
            value, nested = values[field.name], field.metadata.get("section")
            ordered[field.name] = value if nested is None else in_declared_order(value, nested)
    return ordered


def schema(kind: type) -> dict:
    """JSON schema of a section: all keys are required, unknown keys are refused."""
    types_ = typing.get_type_hints(kind)
    return {
        "type": "object",
        "additionalProperties": False,
        "required": [field.name for field in dataclasses.fields(kind)],
        "properties": {field.name: schema_of(field, types_[field.name]) for field in dataclasses.fields(kind)},
    }


def schema_of(field: dataclasses.Field, annotation: Any) -> dict:
    """JSON schema of one setting."""
    nested = field.metadata.get("section")
    if nested is not None:
        return schema(nested)
    rules = value_schema(annotation, field.metadata["bounds"])
    described = {**rules, **field.metadata["of"]}
    if "enum" in described:
        del described["type"]
    return {**described, "description": field.metadata["meaning"]}


def value_schema(annotation: Any, bounds: dict) -> dict:
    """JSON schema of a type; bounds apply to its numbers."""
    if dataclasses.is_dataclass(annotation):
        return schema(typing.cast(type, annotation))
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin in (types.UnionType, typing.Union):
        (inner,) = (argument for argument in arguments if argument is not type(None))
        rules = value_schema(inner, bounds)
        return {**rules, "type": [rules["type"], "null"]}
    if origin is list:
        return {"type": "array", "items": value_schema(arguments[0], bounds)}
    if origin is dict:
        return {"type": "object", "additionalProperties": value_schema(arguments[1], bounds)}
    return {"type": KINDS[annotation], **(bounds if annotation in (int, float) else {})}


def leaves(kind: type, key: str = "") -> typing.Iterator[tuple[str, dataclasses.Field, Any]]:
    """Yield (dotted key, field, type) of every setting in a section and its nested sections."""
    types_ = typing.get_type_hints(kind)
    for field in dataclasses.fields(kind):
        name = f"{key}.{field.name}".lstrip(".")
        nested = field.metadata.get("section")
        if nested is None:
            yield name, field, types_[field.name]
        else:
            yield from leaves(nested, name)
