"""Runs of target `check_wheel_soil`: the wheel with one setting changed, each beside the wheel as it is."""

import copy
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import reduce
from operator import getitem
from typing import Any, cast

import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.campaign.tables import read_table
from virtual_soil.wheel.measured import stacked, wheel_table
from virtual_soil.wheel.setups import check_setups, run_names
from virtual_soil.wheel.soil import grain_settings

#: Name of the runs that the others are compared with.
BASE = "base"


@dataclass(frozen=True)
class Change:
    """One changed setting.

    key : of section `wheel`. setting : of section `wheel_check`. own_bed : the bed has to be prepared anew. is_factor : the setting
    multiplies the value, else it replaces it.
    """

    words: str
    key: tuple[str, ...]
    setting: str
    own_bed: bool
    is_factor: bool = True

    def value(self, wheel: dict) -> Any:
        """Value of the setting in a section `wheel`: a number, or None."""
        return reduce(getitem, self.key, cast(Any, wheel))


#: Name in paths and tables -> the change, in the order of the page.
CHANGES = {
    "finer_grains": Change("finer grains", ("grains_per_radius",), "finer_grains_factor", True),
    "slower": Change("slower wheel", ("speed_m_s",), "speed_factor", False),
    "stiffer": Change("stiffer grains", ("shear_modulus_pa",), "stiffness_factor", True),
    "wider_bed": Change("wider bed", ("bed", "width_ratio"), "width_factor", True),
    "wheel_friction": Change("other wheel friction", ("wheel_static_friction",), "wheel_static_friction", False, False),
    "wheel_rolling": Change(
        "other rolling friction of the wheel", ("wheel_rolling_friction",), "wheel_rolling_friction", False, False
    ),
}


def without_effect(wheel: dict, check: dict) -> dict[str, str]:
    """Changes that have a value and change nothing, or cannot -> what is allowed; wheel, check : the two sections."""
    found = {}
    if check["stiffness_factor"] is not None and wheel["shear_modulus_pa"] is None:
        found["stiffer"] = "null without wheel.shear_modulus_pa"
    for name in ("wheel_friction", "wheel_rolling"):
        setting = CHANGES[name].setting
        if check[setting] is not None and check[setting] == wheel[setting]:
            found[name] = f"another value than wheel.{setting}, or null"
    return found


def changes_of(wheel: dict, check: dict) -> list[str]:
    """Names of the changes that can be run; `check_changes` refuses the others."""
    refused = without_effect(wheel, check)
    return [name for name, change in CHANGES.items() if check[change.setting] is not None and name not in refused]


def changed_wheel(wheel: dict, check: dict, name: str) -> dict:
    """Section `wheel` with one change, or as it is for BASE; its slips are the one of section `wheel_check`."""
    found = copy.deepcopy(wheel) | {"slips": [check["slip"]]}
    if name != BASE:
        change = CHANGES[name]
        *parents, last = change.key
        value = check[change.setting]
        reduce(getitem, parents, cast(Any, found))[last] = change.value(wheel) * value if change.is_factor else value
    return found


def run_name(wheel: dict, check: dict) -> str:
    """Name of every run; see `setups.run_names`."""
    (name,) = run_names(changed_wheel(wheel, check, BASE))
    return name


def check_changes(wheel: dict, check: dict, soil: dict, engine: dict) -> None:
    """Raise CalibrationError for a change without effect, or if the engine would refuse a run; soil, engine : of a job."""
    for name, allowed in without_effect(wheel, check).items():
        setting = CHANGES[name].setting
        demand(False, f"wheel_check.{setting}", check[setting], allowed)
    for name in (BASE, *changes_of(wheel, check)):
        changed = changed_wheel(wheel, check, name)
        check_setups(changed, {"soil": soil, "grains": grain_settings(changed), "engine": engine})


def check_any(changes: Collection[str], tests: Collection) -> None:
    """Raise CalibrationError if nothing is compared; tests : the repeated tests of all cases."""
    allowed = "a value of at least one of " + ", ".join(change.setting for change in CHANGES.values())
    demand(bool(changes or tests), "wheel_check: comparisons", 0, allowed)


def said(wheel: dict, name: str, check: dict) -> tuple[str, str]:
    """The changed setting of a change before and after, in words."""
    key = f"wheel.{'.'.join(CHANGES[name].key)}"
    values = (CHANGES[name].value(section) for section in (wheel, changed_wheel(wheel, check, name)))
    before, after = (f"{key} {'null' if value is None else f'{value:.4g}'}" for value in values)
    return before, after


def runs_of(files: Mapping[str, Collection[str]], changes: Collection[str]) -> dict[str, pd.DataFrame]:
    """BASE and changes -> runs of schema wheel; files : <name>_runs, <name>_histories and <name>_beds of each, in one order."""
    found = {}
    for name in (BASE, *changes):
        histories = (read_table(path, "wheel_history") for path in files[f"{name}_histories"])
        beds = stacked(files[f"{name}_beds"], "wheel_bed")
        found[name] = wheel_table(stacked(files[f"{name}_runs"], "wheel_run"), histories, beds)
    return found
