"""Whatever stands in a configuration, it is accepted, or refused in words that name a key, before anything is written."""

import copy
import datetime
import math
import re
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from snakemake.utils import update_config

from virtual_soil.campaign import asked
from virtual_soil.campaign.cost import memory_mb, runtime_min
from virtual_soil.campaign.study import (
    StudyError,
    base_simulation,
    check_config,
    check_soils,
    design_rows,
    experiment_settings,
    first_answer_soils,
    raw_files,
    simulations,
    soil_files,
)

ROOT = Path(__file__).parents[2]
SMOKE = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())
update_config(SMOKE, yaml.safe_load((ROOT / "config" / "smoke.yaml").read_text()))
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")

NUMBERS = st.one_of(
    st.integers(-10, 10),
    st.integers(),
    st.floats(),
    st.sampled_from([0, -1, 1e-308, 1e308, 10**30, -(10**400), math.nan, math.inf]),
)
TEXTS = st.one_of(
    st.text(max_size=8),
    st.sampled_from(
        ["../x", "/etc", "a/b", "a\\b", "a\n", "..", ".", "", "x" * 300, "{case}", "~", "a b", "\0", "µ", "1e3", "radius_m"]
    ),
)
LEAVES = st.one_of(st.none(), st.booleans(), NUMBERS, TEXTS, st.just(datetime.date(2020, 1, 1)), st.just(b"x"), st.just({1, 2}))
KEYS = st.one_of(TEXTS, st.integers(0, 3), st.none())
VALUES = st.recursive(LEAVES, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=3), max_leaves=6)


def places(tree, path=()):
    """All places in a configuration, as sequences of keys."""
    found = [path] if path else []
    for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ():
        found += places(value, (*path, key))
    return found


PLACES = sorted(places(SMOKE), key=str)


@st.composite
def mutated(draw):
    """The smoke study with one to three changes: a value of another kind, a key more or less."""
    config = copy.deepcopy(SMOKE)
    for _ in range(draw(st.integers(1, 3))):
        *way, last = draw(st.sampled_from(PLACES))
        target = config
        try:
            for key in way:
                target = target[key]
            target[last]
        except (KeyError, IndexError, TypeError):  # changed away before
            continue
        how = draw(st.sampled_from(["set", "set", "set", "delete", "add", "scale"]))
        if how == "set":
            target[last] = draw(VALUES)
        elif how == "delete":
            del target[last]
        elif how == "scale" and isinstance(target[last], int | float) and not isinstance(target[last], bool):
            target[last] = target[last] * draw(st.sampled_from([-1, 0, 2, 1e6, 1e-6, 1e300]))
        elif isinstance(target, dict):
            target[draw(KEYS)] = draw(VALUES)
    return config


def plan(config):
    """All that is done with a configuration before a job runs, in the order of common.smk; the study's name and its simulations."""
    check_config(config)
    asked.taken(config)
    first_answer_soils(config.pop("soil", None), config)
    config.pop("checkpoint_interval_s"), config.pop("batch_minutes")
    check_soils(config)
    design = design_rows(config)
    rows = simulations(config, design)
    raw_files(soil_files(config))
    for row in rows.values():
        members = [(row, experiment_settings(config, row))]
        runtime_min(members, 1), memory_mb(members, 1)
    for experiment in ("repose", "shear"):
        base_simulation(config, design, experiment)
    return config, rows


def test_the_study_that_is_changed_is_sound():
    assert len(plan(copy.deepcopy(SMOKE))[1]) > 50


@settings(max_examples=400, suppress_health_check=list(HealthCheck))
@given(mutated())
@example(SMOKE | {"study": "../../x"})
@example(SMOKE | {"study": "smoke\n"})
@example(SMOKE | {"study": "x" * 300})
@example(SMOKE | {"soils": ["../soils/lunar_regolith"]})
@example(SMOKE | {"twins": {1: {}, "a": {}}})
@example(SMOKE | {1: 2, "a": 3})
@example(SMOKE | {"refine": SMOKE["refine"] | {"rounds": 10**12}})
@example(SMOKE | {"material": SMOKE["material"] | {"radius_m": math.nan}})
@example(SMOKE | {"material": SMOKE["material"] | {"density_kg_m3": 10**400}})
@example(SMOKE | {"screening": SMOKE["screening"] | {"factors": {"radius_m": -1.0}}})
@example(SMOKE | {"shear": SMOKE["shear"] | {"displacement_ratio": 1e308}})
def test_any_configuration_is_accepted_or_refused_in_words(config):
    top = set(map(str, config)) | set(map(str, SMOKE))
    try:
        config, rows = plan(copy.deepcopy(config))
    except StudyError as error:
        text = str(error)
        assert any(key in text for key in top), text
        assert len(text) < 4000
        return
    # what is accepted cannot lead out of its folder
    names = [config["study"], *config["soils"], *config["twins"], *(case["case"] for case in config["optimise"]["cases"])]
    assert all(NAME.fullmatch(name) and len(name) <= 100 for name in names)
    assert all(re.fullmatch("[0-9a-f]{10}", name) for name in rows)


def test_a_configuration_that_contains_itself_is_refused():
    config = copy.deepcopy(SMOKE)
    config["twins"]["fine"] = config["twins"]
    with pytest.raises(StudyError, match="twins"):
        check_config(config)
