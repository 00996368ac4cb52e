"""A study before any job runs, for the Snakefile: checked configuration, simulations and files."""

import itertools
import math
import re
from collections.abc import Collection
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.calibration.optimise import weighted
from virtual_soil.calibration.points import point_id
from virtual_soil.calibration.screening import changed_materials
from virtual_soil.calibration.space import space_of
from virtual_soil.campaign import asked, settings, yamls
from virtual_soil.campaign.cost import expected_s
from virtual_soil.campaign.described import LARGEST, described, shortened
from virtual_soil.campaign.design import DESIGNED, expand
from virtual_soil.campaign.experiments.common import soil_of
from virtual_soil.campaign.experiments.grading import Grading
from virtual_soil.campaign.experiments.registry import BY_NAME, BY_RESPONSE, LOADS, chosen, responses_of, with_optional
from virtual_soil.campaign.experiments.shapes import numbers
from virtual_soil.campaign.sections import USUAL_TERMS, Engine, Material, Study
from virtual_soil.campaign.settings import NAME
from virtual_soil.campaign.soils import laboratory_files, measure_soil
from virtual_soil.campaign.tables import TableError, read_table
from virtual_soil.campaign.variables import property_rules
from virtual_soil.errors import InputError

#: Engine settings that decide whether a study may be compared with the paper.
PRINTED_ENGINE = ("rolling_model", "damping_model", "tangential_model", "gravity_m_s2")
#: Meaning of the key `soil`, which is given only on the command line.
SOIL_KEY = "of rule first_answer: a name in config/soils or a soil file; by default the study's soils"
#: Folders in results/ that are not studies.
RESERVED = ("first_answer", "verification")
#: Maximum nesting depth of a configuration (the schema's is five), maximum number of lines of a message.
MAX_DEPTH, SHOWN = 20, 20
#: Upper bound of grains times steps of one simulation: 600 years at 50 million per second.
MAX_GRAIN_STEPS = 1e18
#: Longest expected time in s of a simulation of the laboratory's own apparatus that nobody need insist on.
LONGEST_S = 24 * 3600.0


class StudyError(InputError, ValueError):
    """Error: a study cannot be run as configured; the message names key, value and the allowed values."""


def check_config(config: dict) -> None:
    """Refuse a configuration that violates the settings classes; the message names key, value and the allowed values."""
    lines = list(oddities(config)) or list(old_weights(config))
    if not lines:
        schema = settings.schema(Study)
        schema["properties"] |= {"soil": {"type": "string", "minLength": 1, "description": SOIL_KEY}, **asked.rules(schema)}
        lines = (
            described(config, schema)
            or list(reserved_names(config))
            or described_materials(config, property_rules(settings.schema(Material)["properties"], settings.schema))
            or list(unusual(config))
        )
    if lines:
        raise StudyError("The configuration is not valid:\n" + "\n".join(f"  {line}" for line in lines[:SHOWN]))


def reserved_names(config: dict):
    """Yield a line if the study has a reserved name: a folder in results/ that is not a study."""
    if config["study"] in RESERVED:
        yield f"study: {config['study']} is the folder of other results; allowed: another name than {', '.join(RESERVED)}."


def old_weights(config: dict):
    """Yield a line for every case whose weights are a list, the former format without names."""
    optimise = config.get("optimise")
    cases = optimise.get("cases") if isinstance(optimise, dict) else None
    for case in cases if isinstance(cases, list) else ():
        weights = case.get("weights") if isinstance(case, dict) else None
        if isinstance(weights, list):
            form = ", ".join(
                f"{name}: {value}"
                for name, value in itertools.zip_longest(USUAL_TERMS, weights[: len(USUAL_TERMS)], fillvalue="...")
            )
            yield f"optimise.cases: weights of {shortened(case.get('case'))} are a list; allowed: a weight by name, {{{form}}}."


def check_files(paths) -> None:
    """Refuse configuration files with duplicate keys: YAML would silently use the last."""
    for path in paths:
        try:
            yamls.load_file(path)
        except (OSError, ValueError, yaml.YAMLError) as error:
            raise StudyError(f"{path}: not a sound YAML file ({' '.join(str(error).split())}).") from None


def oddities(value, key: str = "", depth: int = 0):
    """Yield a line for every value that YAML and the schema accept but that no key of a study allows."""
    name = key or "the configuration"
    if depth > MAX_DEPTH:
        yield f"{name}: nested more than {MAX_DEPTH} deep."
    elif isinstance(value, dict):
        for inner, content in value.items():
            if isinstance(inner, str):
                yield from oddities(content, f"{key}.{inner}".lstrip("."), depth + 1)
            else:
                yield f"{name}: the key {inner!r} is no text."
    elif isinstance(value, list):
        for place, content in enumerate(value):
            yield from oddities(content, f"{key}.{place}", depth + 1)
    elif isinstance(value, int | float):
        if not abs(value) < LARGEST:  # also refuses NaN
            yield f"{name}: {shortened(value)} is no number below {LARGEST:g}."
    elif not isinstance(value, str | None):
        yield f"{name}: {shortened(value)} is neither a number nor a text, list or mapping."


def unusual(config: dict):
    """Yield a line for every number outside its usual range: most often it is in another unit. Keys in `insist` are left out."""
    ranges = {key: field.metadata["usual"] for key, field, _ in settings.leaves(Study)}
    values: dict[str, Any] = {key: reduce(getitem, key.split("."), config) for key, usual in ranges.items() if usual}
    for name, key in asked.KEYS.items():
        if isinstance(config.get(name), int | float):
            ranges[name], values[name] = ranges[key], config[name]
    for place, group in material_groups(config).items():
        for name, value in group.items():
            key = f"{place}.{name}"
            ranges[key], values[key] = ranges.get(f"material.{name}"), value
    for key, value in values.items():
        low, high = ranges[key] or (-math.inf, math.inf)
        numbers = [number for number in (value if isinstance(value, list) else [value]) if isinstance(number, int | float)]
        beyond = [number for number in numbers if not low <= number <= high]
        if beyond and key not in config["insist"]:
            yield (
                f"{key}: {beyond[0]:g} is unusual; usual: {low:g} to {high:g}, in the unit of the name. If it is meant, add "
                f"the key to the study's list: insist: [{key}]"
            )


def material_groups(config: dict) -> dict[str, dict]:
    """Return the parts of the design that give values to `material` keys, by their own keys."""
    design, check = config["design"], config["fidelity"]["check"]
    factors, material = config["screening"]["factors"], numbers(config["material"])
    changed = changed_materials(material, {"factors": {key: factors[key] for key in factors if key in material}})
    groups = {"design.grid": design["grid"], "design.sweep": design["sweep"]}
    if isinstance(design["variables"], dict):
        groups["design.variables"] = design["variables"]
    groups["screening.factors"] = {key: values[key] for key, values in changed.items()}
    groups |= {f"design.sweep_couples.{k}": couple for k, couple in enumerate(design["sweep_couples"])}
    return groups | {f"fidelity.check.couples.{k}": couple for k, couple in enumerate(check["couples"])}


def described_materials(config: dict, rules: dict[str, dict]) -> list[str]:
    """Return a line for every value in the design outside the range of its `material` key."""
    lines = []
    for place, group in material_groups(config).items():
        for name, values in group.items():
            for value in values if isinstance(values, list) else [values]:
                lines += [
                    f"{place}.{name}{line.removeprefix('the configuration')}" for line in described(value, rules.get(name, {}))
                ]
    return lines


def design_rows(config: dict) -> list[dict]:
    """Return the rows of the design with plain Python values (None if a value does not apply)."""
    try:
        table = expand(config)
    except ValueError as error:
        raise StudyError(str(error)) from None
    check_repeats(config, table)
    return plain_rows(table)


def check_repeats(config: dict, table: pd.DataFrame) -> None:
    """Refuse a design that repeats no point of an experiment whose responses are those of runs: their scatter is the noise."""
    for test in chosen(config["experiments"]):
        of_runs = any(response.error_column is None for response in test.RESPONSES)
        rows = table[table["experiment"] == test.NAME]
        if of_runs and rows.groupby(["point_id", "fidelity"]).size().max() < 2:
            key = f"{test.NAME}_seeds"
            raise StudyError(
                f"design.{key} is {config['design'][key]}; allowed: at least two seeds, as the scatter between them is the noise "
                "of the surrogates, and no other section repeats a point of this experiment."
            )


def simulations(config: dict, rows: list[dict], insist: Collection[str] = ()) -> dict[str, dict]:
    """Return simulation_id -> the simulated design row (without purposes) of all rows that share it; insist : see `check_times`."""
    found: dict[str, dict] = {}
    for row in rows:
        if row["simulation_id"] not in found:
            found[row["simulation_id"]] = simulated(config, row)
    check_costs(config, found)
    check_times(config, found, insist)
    return found


def simulated(config: dict, row: dict) -> dict:
    """Return the row of the simulation that a design row shares with others, without purposes; its seed is of this point."""
    material = BY_NAME[row["experiment"]].canonical({key: row[key] for key in numbers(config["material"])}, config)
    return {**{key: value for key, value in row.items() if key != "purposes"}, **material, "point_id": point_id(material)}


def check_times(config: dict, rows: dict[str, dict], insist: Collection[str]) -> None:
    """Refuse a laboratory's apparatus that takes more than a day with grains of this size, naming the size that would do.

    Only where sizes in SI are stated, unless `insist` has their section. Grains times steps go with 1/r^4, or 1/r^3 in a slice.
    """
    for test in chosen(config["experiments"]):
        section, experiment = test.APPARATUS, test.NAME
        here = [row for row in rows.values() if row["experiment"] == experiment]
        stated = [key for key, value in config[section].items() if key.endswith("_m") and value is not None]
        if section in insist or not here or not stated:
            continue
        time_s, row = max(((expected_s(row, experiment_settings(config, row)), row) for row in here), key=lambda pair: pair[0])
        if time_s > LONGEST_S:
            twice = row | {"radius_m": 2.0 * row["radius_m"]}
            power = max(1.0, math.log2(time_s / expected_s(twice, experiment_settings(config, twice))))
            larger = row | {"radius_m": float(f"{row['radius_m'] * (1.1 * time_s / LONGEST_S) ** (1.0 / power):.2g}")}
            then_s = expected_s(larger, experiment_settings(config, larger))
            n = BY_NAME[experiment].cost(row, experiment_settings(config, row))[0] / soil_of(row, config).n_spheres
            slice_ = f", or a slice (width_m) of {LONGEST_S / time_s:.1g} of its width" if "width_m" in config[section] else ""
            enough = f"{1e3 * larger['radius_m']:.2g} mm ({then_s / 3600:.2g} h){slice_}"
            raise StudyError(
                f"{section}: {n:.2g} grains of {1e3 * row['radius_m']:.3g} mm radius take {time_s / 3600:.3g} h of a core; "
                f"allowed: {LONGEST_S / 3600:g} h, as with scaled-up grains of {enough}. If it is meant: insist: [{section}]"
            )


def check_costs(config: dict, rows: dict[str, dict]) -> None:
    """Refuse a study with a simulation that cannot finish, or whose grains are too soft: a quantity is wrong by magnitudes."""
    largest_load_first = sorted(rows.values(), key=lambda row: -max((row[load] or 0.0 for load in LOADS), default=0.0))
    for row in largest_load_first:
        try:
            work = math.prod(BY_NAME[row["experiment"]].cost(row, experiment_settings(config, row)))
        except CalibrationError as error:
            raise StudyError(f"{row['experiment']}: {error}") from None
        except (ArithmeticError, ValueError):  # the engine refuses these settings
            work = math.inf
        if not work < MAX_GRAIN_STEPS:
            raise StudyError(
                f"{row['experiment']}: simulation {row['simulation_id']} would take {work:g} steps of grains; allowed: below "
                f"{MAX_GRAIN_STEPS:g}. Look at material, at the sizes in {row['experiment']} and at fidelity.{row['fidelity']}."
            )


def plain_rows(table) -> list[dict]:
    """Convert a design table to rows of plain Python values (None if a value does not apply)."""
    return [{key: plain_value(value) for key, value in row.items()} for row in table.to_dict("records")]


def plain_value(value):
    """Convert a numpy number to a Python number; None for NaN."""
    plain = value.item() if hasattr(value, "item") else value
    return None if isinstance(plain, float) and math.isnan(plain) else plain


def distance_from_base(config: dict, row) -> np.ndarray:
    """Squared distance (m,) of points from the base set, in extents of the design's coordinates; row : mapping or table."""
    space = space_of(config["design"])
    base = space.unit({name: config["material"][name] for name in space.variables})
    return ((space.unit(row) - base) ** 2).sum(axis=1)


def base_simulation(config: dict, rows: list[dict], experiment: str) -> dict:
    """Return the simulation at the campaign's point nearest to the base set, with the first seed and the largest load."""
    here = [row for row in rows if row["experiment"] == experiment and row["fidelity"] == "campaign"]
    designed = [row for row in here if set(DESIGNED) & set(row["purposes"].split(","))]
    first_at: dict[str, dict] = {}
    for row in designed:
        first_at.setdefault(row["point_id"], row)
    nearest = min(first_at.values(), key=lambda row: float(distance_from_base(config, row)[0]))
    same = [row for row in designed if row["point_id"] == nearest["point_id"] and row["seed"] == nearest["seed"]]
    return simulated(config, max(same, key=lambda row: max((row[load] or 0.0 for load in LOADS), default=0.0)))


def planned_stages(results: str) -> list[str]:
    """Return the campaign and the later stages planned so far, as folders below results/<study>."""
    later = [*Path(results).glob("rounds/*"), *Path(results).glob("verification/*")]
    folders = [f"{results}/verification", *sorted(map(str, later))]
    return ["", *(folder[len(results) :] for folder in folders if (Path(folder) / "design.parquet").is_file())]


def proposed_rows(path: str) -> list[dict]:
    """Read the rows of a later stage's design table."""
    try:
        return plain_rows(read_table(path, "design"))
    except TableError as error:
        raise StudyError(str(error)) from None


def as_printed(config: dict) -> list[str]:
    """Return the study's experiments whose results may stand beside those that the paper prints: same material, same protocol."""
    spheres = config.get("shape") is None and numbers(config["material"]) == numbers(settings.defaults(Material))
    grains = spheres and config["grading"] == settings.defaults(Grading)
    papers = grains and config["design"]["geometry"] == "scaled"
    engine = {key: config["engine"][key] == value for key, value in settings.defaults(Engine).items() if key in PRINTED_ENGINE}
    if not papers or not all(engine.values()):
        return []
    return [experiment.NAME for experiment in chosen(config["experiments"]) if experiment.as_printed(config)]


def experiment_settings(config: dict, row: dict) -> dict:
    """Return the settings of a simulation in addition to its design row: keyword arguments of the test's Setup and the engine."""
    return BY_NAME[row["experiment"]].setup(config, row)


def file_of_checkout(path: str, checkout: str | Path) -> str:
    """Return a path below the working directory if it exists there (as in the checkout itself), otherwise below the checkout."""
    return path if Path(path).exists() else (Path(checkout) / path).as_posix()


def soil_files(config: dict, checkout: str | Path = ".") -> list[str]:
    """Return the soil files of a study, of the working directory or the checkout; raises StudyError if one is missing."""
    files = [file_of_checkout(f"config/soils/{soil}.yaml", checkout) for soil in config["soils"]]
    for soil, file in zip(config["soils"], files, strict=True):
        if not Path(file).is_file():
            folders = {Path("config/soils"), Path(checkout) / "config/soils"}
            known = ", ".join(sorted({path.stem for folder in folders for path in folder.glob("*.yaml")}))
            raise StudyError(f"soils: there is no config/soils/{soil}.yaml; existing soils: {known}.")
    return files


def first_answer_soils(soil: str | None, config: dict, checkout: str | Path = ".") -> dict[str, str]:
    """Return name -> soil file for rule first_answer: one soil, given by name or file, or all soils of the study."""
    if soil is None:
        return dict(zip(config["soils"], soil_files(config, checkout), strict=True))
    path = soil if Path(soil).suffix in (".yaml", ".yml") else soil_files({"soils": [soil]}, checkout)[0]
    if not Path(path).is_file():
        raise StudyError(f"soil: there is no file {path}; allowed: a soil file (.yaml), or a name in config/soils.")
    name = Path(path).stem
    if not re.fullmatch(NAME, name):
        raise StudyError(f"soil: the file's name is {name!r}; allowed: letters, digits, - and _, as it names the result.")
    try:
        measure_soil(path)
    except CalibrationError as error:
        raise StudyError(str(error)) from None
    return {name: path}


def raw_files(soils: list[str]) -> list[str]:
    """Return the laboratory files named in soil files; they are inputs, so that a change reruns the measurement."""
    try:
        return [path.as_posix() for soil in soils for path in laboratory_files(soil)]
    except CalibrationError as error:
        raise StudyError(str(error)) from None


def check_strengths(config: dict, case: dict, targets: pd.DataFrame) -> None:
    """Refuse a case whose target is another strength than the simulated test measures; targets : soil table by property."""
    for name, stated in targets["strength"].items():
        simulated = BY_RESPONSE[str(name)].strength(config, str(name))
        demand(
            not stated or not simulated or stated == simulated,
            f"optimise.cases: target {name} of {case['case']}",
            f"a {stated} strength",
            f"a {simulated} strength, as the simulated test measures, or a weight for the responses of an experiment that measures "
            f"the {stated} strength",
        )


def check_soils(config: dict, checkout: str | Path = ".") -> None:
    """Read every soil file to refuse impossible targets before any simulation; also check that every case names a soil."""
    try:
        measured = {Path(path).stem: measure_soil(path) for path in soil_files(config, checkout)}
        targets = {soil: set(table["property"]) for soil, table in measured.items()}
        known, responses = [*config["soils"], *config["twins"]], responses_of(with_optional(config))
        for case in config["optimise"]["cases"]:
            demand(case["soil"] in known, f"optimise.cases: soil of {case['case']}", case["soil"], f"one of {known}")
            wanted = set(weighted(case, responses))
            given = wanted if case["soil"] in config["twins"] else targets[case["soil"]]
            demand(
                wanted <= given,
                f"optimise.cases: weights of {case['case']}",
                ", ".join(sorted(wanted - given)),
                f"those that {case['soil']} has a target for: {', '.join(sorted(given & set(responses)))}",
            )
            if case["soil"] in measured:
                check_strengths(config, case, measured[case["soil"]].set_index("property").loc[sorted(wanted)])
        both = sorted(set(config["soils"]) & set(config["twins"]))
        demand(not both, "twins", both, "names that are not in soils")
        names = [case["case"] for case in config["optimise"]["cases"]]
        demand(len(set(names)) == len(names), "optimise.cases: names", names, "each only once")
        models = [form["model"] for form in config["surrogate"].values()]
        demand(
            config["refine"]["rounds"] == 0 or set(models) != {"quadratic"},
            "refine.rounds",
            config["refine"]["rounds"],
            "0 when surrogate.*.model is quadratic throughout: polynomials cannot be refined at a point",
        )
    except CalibrationError as error:
        raise StudyError(str(error)) from None
