"""What is wrong with values, in one line each: violations of a schema, and numbers that are most often in another unit."""

import jsonschema

from virtual_soil.campaign import settings, yamls

#: Upper bound of numbers in a configuration.
LARGEST = 2.0**62


def shortened(value) -> str:
    """Format a value for a message, shortened; Python refuses to print very long integers."""
    text = "a whole number of more than 18 digits" if isinstance(value, int) and abs(value) >= LARGEST else str(value)
    return text if len(text) <= 200 else f"{text[:200]}..."


def described(value, schema: dict, name: str = "") -> list[str]:
    """Return a line for every violation of a schema, in the order of the keys; name : of the value, if it is no configuration."""
    errors = jsonschema.Draft202012Validator(schema).iter_errors(value)
    return [describe(error, name) for error in sorted(errors, key=lambda error: list(map(str, error.path)))]


def describe(error: jsonschema.ValidationError, name: str = "") -> str:
    """Format a schema error as one line."""
    key = ".".join(filter(None, [name, *map(str, error.absolute_path)])) or "the configuration"
    if error.validator == "additionalProperties":
        known = set(error.schema.get("properties", {}))
        unknown = sorted(set(error.instance) - known)
        return f"{key}: unknown key {', '.join(map(repr, unknown))}; allowed: {', '.join(sorted(known))}."
    if error.validator == "required":
        return f"{key}: {error.message}."
    meaning = error.schema.get("description", "")
    return f"{key}: {shortened(error.message)}{yamls.hint(error.instance)}." + (f" It means: {meaning}" if meaning else "")


def out_of_the_usual(values: dict, kind: type, name: str) -> list[str]:
    """Return a line for every number of a section outside its usual range; its `insist` says that they are meant."""
    lines = []
    for key, field, _ in settings.leaves(kind):
        usual, value = field.metadata["usual"], values.get(key)
        for number in value if isinstance(value, list) else [value]:
            if usual and isinstance(number, int | float) and not usual[0] <= number <= usual[1]:
                lines.append(
                    f"{name}.{key} is {number:g}; allowed: usually {usual[0]:g} to {usual[1]:g}, in the unit of the name; if it is "
                    "meant, add `insist: true` to the entry."
                )
    return lines
