"""Sections `wheel`, `plate` and `cone` of a new study, from words such as `radius_m=0.1 slips=0,0.2 gravity_m_s2=moon`."""

import copy
from typing import Any

import yaml

from virtual_soil.campaign.study import check_config
from virtual_soil.errors import InputError

#: Tools of a new study, and what their sections say of none: a study has those that are asked for.
NONE: dict[str, dict[str, Any]] = {"wheel": {}, "plate": {"diameters_m": []}, "cone": {"base_area_m2": None}}
#: Keys of `wheel.shape` that may be given without it.
SHAPE = ("radius_m", "width_m")
HEAD = "# After `all`: targets wheel, plate and cone on the calibrated soil (docs/guides/wheel.md).\n"


def allowed_keys(values: dict, before: str = "") -> list[str]:
    """Keys of a section, with dots where sections are nested."""
    nested = [
        allowed_keys(value, f"{before}{key}.") if isinstance(value, dict) else [before + key] for key, value in values.items()
    ]
    return [key for keys in nested for key in keys]


def value_of(text: str, default: Any) -> Any:
    """Value of a word; a list is written with commas."""
    return yaml.safe_load(f"[{text}]" if isinstance(default, list) else text)


def section_of(tool: str, words: list[str], default: dict) -> dict:
    """What words change of a section. Exits with one line if a word is no `key=value`, or the section has no such key."""
    changed: dict = {}
    for word in words:
        key, _, text = word.partition("=")
        name = f"shape.{key}" if tool == "wheel" and key in SHAPE else key
        if name not in allowed_keys(default) or not text:
            known = ", ".join(allowed_keys(default))
            raise SystemExit(f"{tool.upper()} has {word!r}; allowed: <key>=<value> with the keys {known}.")
        *parents, last = name.split(".")
        place, stated = changed, default
        for parent in parents:
            place, stated = place.setdefault(parent, {}), stated[parent]
        try:
            value = value_of(text, stated[last])
        except yaml.YAMLError:
            raise SystemExit(f"{tool.upper()} has {word!r}; allowed: a value in YAML, a list with commas.") from None
        if value != stated[last]:
            place[last] = value
    return {key: value for key, value in changed.items() if value != {}}


def sections_of(study: str, asked: dict[str, list[str]], default: dict) -> dict[str, dict]:
    """Sections of the tools that are asked for: what differs from the default configuration; none if no tool is.

    asked : tool -> its words. The case of a new study has the study's name. Exits with one line if a value is not allowed. A wheel
    that is too large or too small for its bed and grains is refused when it is planned.
    """
    if not asked:
        return {}
    found = {tool: section_of(tool, asked[tool], default[tool]) if tool in asked else none for tool, none in NONE.items()}
    found["wheel"] = {"cases": [study]} | found["wheel"]
    try:
        check_config(merged(default, found))
    except InputError as error:
        raise SystemExit(str(error)) from None
    return {tool: section for tool, section in found.items() if section}


def merged(values: dict, changes: dict) -> dict:
    """Copy of a section with changes, of nested sections key by key."""
    nested = {key: merged(values[key], change) if isinstance(change, dict) else change for key, change in changes.items()}
    return copy.deepcopy(values) | nested


def text_of(sections: dict[str, dict]) -> str:
    """The sections as the end of a study's file; empty without sections."""
    return "\n" + HEAD + yaml.safe_dump(sections, sort_keys=False, default_flow_style=None, width=120) if sections else ""
