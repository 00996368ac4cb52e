"""The test that a first answer is for, as it is asked for on the command line beside `soil`, and that of the reference campaign."""

from functools import reduce
from operator import getitem
from typing import Any

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.optimise import RADIUS
from virtual_soil.calibration.scaling import scaling_of
from virtual_soil.campaign import yamls
from virtual_soil.campaign.experiments.apparatus import gravity_m_s2
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.tables import read_provenance

#: Key of the test -> the key of a study that means the same.
KEYS = {
    "radius_m": "material.radius_m",
    "density_kg_m3": "material.density_kg_m3",
    "gravity_m_s2": "engine.gravity_m_s2",
    "lift_speed_m_s": "fidelity.campaign.lift_speed_m_s",
}


def rules(schema: dict) -> dict[str, dict]:
    """Schemas of KEYS, those of the study's keys. schema : that of a study."""
    return {name: reduce(lambda part, word: part["properties"][word], key.split("."), schema) for name, key in KEYS.items()}


def taken(config: dict) -> dict[str, float]:
    """Take the test out of a checked configuration: the KEYS that it has, gravity as a number.

    Raises CalibrationError without `soil`: the test is that of one soil, and a study has its own keys for it.
    """
    test = {name: config.pop(name) for name in KEYS if name in config}
    for name in test:
        demand("soil" in config, name, "given without a soil", f"beside soil=..., for its first answer; in a study, {KEYS[name]}")
    return in_si(test)


def in_si(test: dict) -> dict[str, float]:
    """The test with its gravity as a number, not as a name."""
    return {name: gravity_m_s2(value) if name == "gravity_m_s2" else value for name, value in test.items()}


def of_reference(path: str) -> dict[str, float]:
    """Density, gravity and lift speed of the reference campaign; path : its configuration, which holds what is not default."""
    given, usual = yamls.load_file(path), defaults(Study)

    def value(keys: list[str]) -> Any:
        try:
            return reduce(getitem, keys, given)
        except KeyError:
            return reduce(getitem, keys, usual)

    return in_si({name: value(key.split(".")) for name, key in KEYS.items() if name != RADIUS})


def check(test: dict[str, float], simulated: dict[str, float], table: str) -> None:
    """Refuse a test that the reference campaign cannot answer.

    test, simulated : see `scaling_of`. table : one of the campaign's tables, whose provenance holds the design.
    """
    if test:
        scaling_of(test, simulated, read_provenance(table)["design"])
