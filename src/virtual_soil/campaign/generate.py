"""Generate schema, default configuration and documentation of the keys from the settings classes: `make settings`.

A test compares the files with the classes.
"""

import dataclasses
import textwrap
from pathlib import Path
from typing import Any

import yaml

from virtual_soil.campaign import settings
from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.sections import Study

WIDTH = 120
COMMAND = "make settings"


def flow(value: Any) -> str:
    """Format a value as YAML on one line."""
    text = yaml.safe_dump(value, default_flow_style=True, width=10**6, sort_keys=False, allow_unicode=True)
    return text.strip().removesuffix("...").strip()


def comment(text: str, indent: str) -> list[str]:
    """Format a text as comment lines."""
    return [f"{indent}# {line}" for line in textwrap.wrap(text, WIDTH - len(indent) - 2)]


def value_lines(key: str, value: Any, indent: str) -> list[str]:
    """Format a key and its value; a long mapping or list of mappings has one line per entry."""
    line = f"{indent}{key}: {flow(value)}"
    if len(line) <= WIDTH or not isinstance(value, dict | list):
        return [line]
    entries = (
        [f"{name}: {flow(entry)}" for name, entry in value.items()] if isinstance(value, dict) else [f"- {flow(v)}" for v in value]
    )
    return [f"{indent}{key}:", *(f"{indent}  {entry}" for entry in entries)]


def section_lines(kind: type, values: dict, known: set[type], indent: str = "") -> list[str]:
    """Format a section with values and meanings of its keys; known : classes whose keys were explained before."""
    lines: list[str] = []
    explained = kind in known
    known.add(kind)
    for field in dataclasses.fields(kind):
        nested = field.metadata.get("section")
        if not indent:
            lines += [""] if nested or lines[-1:] and lines[-1].startswith(" ") else []
        if nested is None:
            lines += leaf_lines(field, values[field.name], indent, explained)
        else:
            about = field.metadata["note"] or ("" if nested in known else " ".join((nested.__doc__ or "").split()))
            lines += [*comment(about, indent), f"{indent}{field.name}:"]
            lines += section_lines(nested, values[field.name], known, f"{indent}  ")
    return lines


def leaf_lines(field: dataclasses.Field, value: Any, indent: str, explained: bool) -> list[str]:
    """Format one setting: note above, meaning after the value or above; both are omitted if explained before."""
    meaning, note = field.metadata["meaning"], field.metadata["note"]
    lines = value_lines(field.name, value, indent)
    if explained:
        return lines
    allowed = field.metadata["of"].get("enum", ())
    if len(allowed) > 1 and not all(f"{name}:" in meaning for name in allowed):
        meaning = f"{meaning} ({' | '.join(allowed)})"
    above = comment(note, indent) if note else []
    if len(lines) == 1 and len(lines[0]) + len(meaning) + 3 <= WIDTH:
        return [*above, f"{lines[0]} # {meaning}"]
    return [*comment(meaning, indent), *above, *lines]


def configuration() -> str:
    """Return the text of config/config.yaml."""
    head = [
        "# The default study: the paper's full design with its 3000 particles, accelerated so that it ends in minutes.",
        f"# Written by `{COMMAND}` from the classes of the settings. A study of your own holds only what differs from this file.",
        "# Unknown keys, and keys given twice, are refused. Units are in the names.",
        "",
    ]
    return "\n".join([*head, *section_lines(Study, settings.defaults(Study), set())]) + "\n"


def schema_text() -> str:
    """Return the text of config/schema.yaml."""
    head = f"# What every key of a study means, and its range; written by `{COMMAND}`. Unknown keys are refused.\n"
    full = {"$schema": "https://json-schema.org/draft/2020-12/schema", **settings.schema(Study)}
    return head + yaml.safe_dump(full, sort_keys=False, allow_unicode=True, width=WIDTH)


def allowed_text(rules: dict) -> str:
    """Allowed range of a setting in words, from its schema."""
    if "enum" in rules:
        return ", ".join(f"`{name}`" for name in rules["enum"])
    inner = rules.get("items", rules)
    bounds = {"minimum": "≥ {}", "exclusiveMinimum": "> {}", "maximum": "≤ {}", "exclusiveMaximum": "< {}"}
    return ", ".join(words.format(f"{inner[key]:g}") for key, words in bounds.items() if key in inner) or "–"


def documentation() -> str:
    """Return the text of docs/configuration.md."""
    lines = [
        "# Every key of a study",
        "",
        f"Written by `{COMMAND}` from the settings' classes in `src/virtual_soil/campaign`.",
        "",
        "| key | meaning | default | allowed |",
        "|---|---|---|---|",
    ]
    values = settings.defaults(Study)
    for name, field, annotation in settings.leaves(Study):
        value: Any = values
        for part in name.split("."):
            value = value[part]
        rules = settings.schema_of(field, annotation)
        text = flow(value)
        shown = text if len(text) <= 60 else f"{text[:57]}..."
        note = f"; {field.metadata['note']}" if field.metadata["note"] else ""
        cells = (f"`{name}`", f"{field.metadata['meaning']}{note}".replace("|", "\\|"), f"`{shown}`", allowed_text(rules))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


#: Path -> function that returns its text.
FILES = {"config/config.yaml": configuration, "config/schema.yaml": schema_text, "docs/configuration.md": documentation}

if __name__ == "__main__":
    for name, text in FILES.items():
        (Path(ROOT) / name).write_text(text(), encoding="utf-8")
        print(f"written: {name}")
