"""Safe YAML loader: no objects, and duplicate keys are refused (YAML would silently use the last)."""

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
