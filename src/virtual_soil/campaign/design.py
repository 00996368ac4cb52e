"""The design: the simulations of a study, one row each.

Grid: full factorial of the grid variables at the base material. Sweep: each swept variable alone, at constant couples of the
grid variables. Screening: one parameter changed at a time. Check: a few points at both fidelities. Twin: virtual soils whose
parameters the calibration must recover. A simulation with several purposes is run once and lists all of them.

A simulation's identifier is a hash of its inputs and does not depend on its row. Adding a value, a seed or a load therefore keeps
all other identifiers and results. Points for which an experiment simulates the same material share a simulation (see its
`canonical`); each has its own row.
"""

import itertools
import math

import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.points import hashed, point_at, point_id
from virtual_soil.calibration.screening import changed_materials
from virtual_soil.calibration.space import space_of
from virtual_soil.calibration.surrogate import n_factor_terms
from virtual_soil.campaign.experiments.registry import BY_NAME, EXPERIMENTS, LOADS, chosen
from virtual_soil.campaign.experiments.shapes import numbers
from virtual_soil.campaign.variables import SEED_KEYS

#: Purposes of the points that the surrogates' design consists of, whose nearest to the base set stands for it in figures.
DESIGNED = ("grid", "points")
#: Increment of the seeds per round of refinement, so that an unchanged optimum is simulated with new seeds.
SEED_STEP = 1000


def expand(config: dict) -> pd.DataFrame:
    """Return the design table of a study, one row per result of a point (a load is NaN if the experiment has none).

    Raises CalibrationError naming the key if the design is inconsistent.
    """
    check_design(config)
    rows: dict[tuple[str, str], dict] = {}
    for purpose, *what in wanted(config):
        row = design_row(config, *what)
        known = rows.setdefault((row["simulation_id"], row["point_id"]), {**row, "purposes": []})
        if purpose not in known["purposes"]:
            known["purposes"].append(purpose)
    table = pd.DataFrame(list(rows.values()))
    table["purposes"] = table["purposes"].map(",".join)
    return ordered(table)


def ordered(table: pd.DataFrame) -> pd.DataFrame:
    """Sort the design table independently of the order of keys in the configuration."""
    values = [column for column in table.columns if column not in ("simulation_id", "point_id", "purposes")]
    leading = ["experiment", "fidelity"]
    trailing = [*LOADS, "seed"]
    material = sorted(set(values) - set(leading) - set(trailing))
    return table.sort_values([*leading, *material, *trailing], ignore_index=True)


def further(config: dict, purpose: str, points: list[dict], seeds: dict) -> pd.DataFrame:
    """Return the design table of all experiments at further points: values of the design variables, rounded to four digits.

    config : material, design, engine, experiments and the experiments' sections of the study. seeds : <experiment>_seeds. Duplicate
    points are simulated once. Without points the table is empty.
    """
    rows = {}
    for values in points:
        material = point_at(config["material"], values)
        for _, *what in every_test(purpose, "campaign", material, campaign_loads(config, material), seeds):
            row = design_row(config, *what)
            rows[row["simulation_id"], row["point_id"]] = {**row, "purposes": purpose}
    template = {**make_row(EXPERIMENTS[0].NAME, "campaign", config["material"], math.nan, 0), "purposes": purpose}
    return ordered(pd.DataFrame(list(rows.values()), columns=list(template)).astype({k: type(v) for k, v in template.items()}))


def decisive(config: dict, undecided: dict[str, tuple[dict, list[str]]], seeds: dict, number: int) -> pd.DataFrame:
    """Return the design table of a round of further seeds: at every undecided optimum, the experiments that have to decide.

    undecided : case -> values of the design variables, names of experiments. seeds : <experiment>_seeds of the first round, whose
    number this round doubles for the number-th time; its seeds are those plus multiples of SEED_STEP.
    """
    steps = range(2 ** (number - 1), 2**number)
    more = {key: [seed + SEED_STEP * step for step in steps for seed in seeds[key]] for key in SEED_KEYS.values()}
    parts = [further(config | {"experiments": tests}, "verification", [values], more) for values, tests in undecided.values()]
    table = pd.concat(parts) if parts else further(config, "verification", [], more)
    return ordered(table.drop_duplicates(["simulation_id", "point_id"]))


def wanted(config: dict):
    """Yield (purpose, experiment, fidelity, material, load, seed) of every simulation, including duplicates."""
    base, design, check = config["material"], config["design"], config["fidelity"]["check"]
    filling = [point_at(base, point) for point in design.get("points", ())]
    grid = grid_points(base, design["grid"]) if design["grid"] else []
    for purpose, materials in (("grid", grid), ("sweep", sweep_points(base, design)), ("points", filling)):
        for material in materials:
            yield from every_test(purpose, "campaign", material, campaign_loads(config, material), design)
    yield from screened(config)
    checked = {experiment.NAME: experiment.check_loads(config) for experiment in chosen(config["experiments"])}
    for couple, fidelity in itertools.product(check["couples"], ("campaign", "reference")):
        material = {**base, **couple}
        yield from every_test("check", fidelity, material, checked, check)
    for twin in config["twins"].values():
        material = point_at(base, {name: twin[name] for name in design["variables"]})
        yield from every_test("twin", "campaign", material, campaign_loads(config, material), twin)


def screened(config: dict):
    """Yield the simulations of the screening: the base set and one parameter changed at a time, only in the screened test."""
    screening, experiment = config["screening"], screened_experiment(config)
    materials = [(config["material"], screening["base_seeds"])]
    materials += [(material, screening["changed_seeds"]) for material in changed_materials(config["material"], screening).values()]
    for material, seeds in materials:
        for load, seed in itertools.product(experiment.loads(config, material), seeds):
            yield "screening", experiment.NAME, "campaign", material, load, seed


def screened_experiment(config: dict):
    """Experiment that measures the screened response; raises CalibrationError if it is not one of the study's."""
    tests, wanted = chosen(config["experiments"]), config["screening"]["response"]
    measured = {response.name: test for test in tests for response in test.RESPONSES}
    demand(wanted in measured, "screening.response", wanted, f"one that the study's experiments measure: {', '.join(measured)}")
    return measured[wanted]


def campaign_loads(config: dict, material: dict) -> dict[str, list[float]]:
    """Return experiment -> loads of its simulations of a material in the campaign."""
    return {experiment.NAME: experiment.loads(config, material) for experiment in chosen(config["experiments"])}


def every_test(purpose: str, fidelity: str, material: dict, loads: dict[str, list[float]], seeds: dict):
    """Yield the simulations of all experiments on one material; loads : by experiment, seeds : <experiment>_seeds."""
    for experiment, its_loads in loads.items():
        for load, seed in itertools.product(its_loads, seeds[SEED_KEYS[experiment]]):
            yield purpose, experiment, fidelity, material, load, seed


def grid_points(base: dict, grid: dict[str, list[float]]) -> list[dict]:
    """Materials of the full factorial."""
    return [{**base, **dict(zip(grid, values, strict=True))} for values in itertools.product(*grid.values())]


def sweep_points(base: dict, design: dict) -> list[dict]:
    """Materials of the one-variable sweeps."""
    return [
        {**base, **couple, variable: value}
        for variable, values in design["sweep"].items()
        for couple in design["sweep_couples"]
        for value in values
    ]


def design_row(config: dict, experiment: str, fidelity: str, material: dict, load: float, seed: int) -> dict:
    """Return a row of the design table without purposes: the point's values and the simulation that gives its result."""
    canonical = BY_NAME[experiment].canonical(material, config)
    simulated = make_row(experiment, fidelity, canonical, load, seed)
    return {**make_row(experiment, fidelity, material, load, seed), "simulation_id": simulated["simulation_id"]}


def make_row(experiment: str, fidelity: str, material: dict, load: float, seed: int) -> dict:
    """Return a simulation of a material as a row of the design table, without purposes."""
    material = {key: float(value) for key, value in sorted(numbers(material).items())}
    what = [experiment, fidelity, material, None if math.isnan(load) else float(load), int(seed)]
    loads = {name: float(load) if name == BY_NAME[experiment].LOAD else math.nan for name in LOADS}
    return {
        "simulation_id": hashed(what, 10),
        "experiment": experiment,
        "fidelity": fidelity,
        "point_id": point_id(material),
        **material,
        **loads,
        "seed": int(seed),
    }


def screening_seeds(config: dict) -> list[int]:
    """Seeds of the screening."""
    return [*config["screening"]["base_seeds"], *config["screening"]["changed_seeds"]]


def check_sweep(name: str, levels: list[float], n_couples: int, forms: set[str]) -> None:
    """Raise CalibrationError if the points of a sweep are too few to determine its factor g."""
    if "quadratic" in forms:
        demand(len(levels) > 2, f"design.sweep.{name}", levels, "at least three values, or g's square is not determined")
    n_points, n_terms = n_couples * len(levels), max(n_factor_terms(form) for form in forms)
    demand(n_points > n_terms, f"number of points of design.sweep.{name}", n_points, f"more than the {n_terms} coefficients of g")


def check_seeds(config: dict) -> None:
    """Raise CalibrationError if the verification uses seeds that a fit has used."""
    for experiment in (test.NAME for test in chosen(config["experiments"])):
        key = SEED_KEYS[experiment]
        seen = {seed + SEED_STEP * k for seed in config["refine"][key] for k in range(config["refine"]["rounds"])}
        seen |= set(config["design"][key])
        if experiment == screened_experiment(config).NAME:
            seen |= set(screening_seeds(config))
        steps = range(2 ** config["verify"]["more_seeds"])
        again = sorted(seen & {seed + SEED_STEP * step for seed in config["verify"][key] for step in steps})
        demand(not again, f"verify.{key}", again, "seeds that the campaign and its refinement do not use")


def check_design(config: dict) -> None:
    """Raise CalibrationError, naming the key, if the design refers to an unknown name or does not determine the surrogates."""
    check_screening(config)
    check_box(config) if "ranges" in config["design"] else check_factorial(config)
    check_seeds(config)
    check_twins(config)


def check_screening(config: dict) -> None:
    """Raise CalibrationError if a factor of the screening changes nothing, or nothing that there is."""
    material, factors = set(numbers(config["material"])), set(config["screening"]["factors"])
    demand(factors <= material, "screening.factors", sorted(factors - material), f"keys of material: {sorted(material)}")
    for parameter, changed in changed_materials(config["material"], config["screening"]).items():
        same = changed[parameter] == config["material"][parameter]
        allowed = "a factor that changes material's value"
        demand(not same, f"screening.factors.{parameter}", config["screening"]["factors"][parameter], allowed)


def check_box(config: dict) -> None:
    """Raise CalibrationError if something else is asked of a design without a grid than it can give."""
    material, check = set(numbers(config["material"])), config["fidelity"]["check"]
    for couple in check["couples"]:
        known = f"values of keys of material: {sorted(material)}"
        demand(set(couple) <= material, "fidelity.check.couples", couple, known)
    for name, form in config["surrogate"].items():
        needs = "best or gaussian_process: a polynomial needs a grid, design.variables as a list"
        demand(form["model"] != "quadratic", f"surrogate.{name}.model", form["model"], needs)


def check_factorial(config: dict) -> None:
    """Raise CalibrationError if grid and sweeps do not fit each other, or have too few points for f and g."""
    material, design = set(numbers(config["material"])), config["design"]
    grid, sweep = set(design["grid"]), set(design["sweep"])
    demand(bool(grid), "design.grid", design["grid"], "values of at least one of design.variables; or give their ranges there")
    demand(grid <= material, "design.grid", sorted(grid - material), f"keys of material: {sorted(material)}")
    demand(sweep <= material, "design.sweep", sorted(sweep - material), f"keys of material: {sorted(material)}")
    demand(not grid & sweep, "design.sweep", sorted(grid & sweep), "variables that are not in design.grid")
    demand(
        set(design["variables"]) == grid | sweep,
        "design.variables",
        design["variables"],
        f"just those of grid and sweep, {sorted(grid | sweep)}; or a range for each: {{name: [low, high]}}",
    )
    for key, couples in (
        ("design.sweep_couples", design["sweep_couples"]),
        ("fidelity.check.couples", config["fidelity"]["check"]["couples"]),
    ):
        for couple in couples:
            demand(set(couple) == grid, key, couple, f"a value for each grid variable: {sorted(grid)}")
    values = {**design["grid"], **design["sweep"]}
    for name in design["variables"]:
        demand(len(values[name]) > 1, f"design values of {name}", values[name], "at least two")
    n_points, n_terms = math.prod(map(len, design["grid"].values())), (len(grid) + 1) * (len(grid) + 2) // 2
    demand(n_points > n_terms, "number of points of design.grid", n_points, f"more than the {n_terms} coefficients of f")
    for name, levels in design["grid"].items():
        demand(len(levels) > 2, f"design.grid.{name}", levels, "at least three values, or f's square is not determined")
    for name, levels in design["sweep"].items():
        check_sweep(name, levels, len(design["sweep_couples"]), {form["g"] for form in config["surrogate"].values()})
    for couple in design["sweep_couples"]:
        for name, value in couple.items():
            demand(
                value in design["grid"][name],
                f"design.sweep_couples {name}",
                value,
                f"a value of design.grid.{name}: {design['grid'][name]}",
            )


def check_twins(config: dict) -> None:
    """Raise CalibrationError if a twin has other variables or experiments than the design, or lies outside."""
    design, ranges = config["design"], space_of(config["design"]).ranges
    needed = {SEED_KEYS[experiment.NAME] for experiment in chosen(config["experiments"])}
    for twin, entry in config["twins"].items():
        demand(
            set(entry) - set(SEED_KEYS.values()) == set(design["variables"]) and needed <= set(entry),
            f"twins.{twin}",
            sorted(entry),
            f"{design['variables']} and {sorted(needed)}",
        )
        for name, (low, high) in ranges.items():
            demand(low <= entry[name] <= high, f"twins.{twin}.{name}", entry[name], f"within the design, {low:g} to {high:g}")
