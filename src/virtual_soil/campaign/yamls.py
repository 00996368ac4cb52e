"""Safe YAML loader: no objects, and duplicate keys are refused (YAML would silently use the last)."""

import re
from pathlib import Path

import yaml


class Loader(yaml.SafeLoader):
    """Safe loader that refuses duplicate keys."""

    def construct_mapping(self, node, deep=False):
        """Return the mapping of a node; raises yaml.YAMLError naming a duplicate key and its line."""
        seen: set = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if isinstance(key, str) and key in seen and key != "<<":
                line = key_node.start_mark.line + 1
                raise yaml.constructor.ConstructorError(None, None, f"the key {key!r} is given twice, again in line {line}")
            if isinstance(key, str):
                seen.add(key)
        return super().construct_mapping(node, deep)


def load(text: str):
    """Parse a YAML text; raises yaml.YAMLError."""
    return yaml.load(text, Loader)  # noqa: S506 (a safe loader)


def load_file(path: str | Path):
    """Read a YAML file; raises OSError, ValueError or yaml.YAMLError."""
    return load(Path(path).read_text(encoding="utf-8"))


def hint(value) -> str:
    """How to write a number that YAML has read as a text, to be added to a message; empty for any other value.

    YAML takes an exponent for a number only with a decimal point before it and a sign after the e: 4.0e+5.
    """
    if not isinstance(value, str) or not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)[eE][+-]?\d{1,3}", value.strip()):
        return ""
    mantissa, exponent = value.strip().lower().split("e")
    written = f"{mantissa if '.' in mantissa else f'{mantissa}.0'}e{int(exponent):+d}"
    return f" (YAML reads this as a text; write {float(value):.12g} or {written})"
