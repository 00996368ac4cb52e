"""The design: which simulations a study needs, one row each.

Grid: full factorial of the grid variables at the base material. Sweep: each swept variable alone, at constant couples of the
grid variables. Screening: one parameter changed at a time. Check: a few points at both fidelities. Twin: hidden soils, simulated
to be found again. Simulations that several of these need are made once and carry all their purposes.

A simulation's identifier is a hash of what is simulated, not of its place in the table: adding a value, a seed or a stress leaves
all other identifiers, and so their results, as they are. Points whose grains can only slide share a simulation (see
`as_simulated`); each has its own row.
"""

import itertools
import math

import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.points import hashed, point_at, point_id
from virtual_soil.calibration.surrogate import n_factor_terms

SEED_KEYS = {"repose_seeds", "shear_seeds"}
#: Each round of refinement adds this to its seeds, so that an optimum that stays where it is is still simulated anew.
SEED_STEP = 1000


def expand(config: dict) -> pd.DataFrame:
    """The design table of a study, a row for each result of a point (`normal_stress_pa` is NaN for heaps).

    Raises CalibrationError naming the key when the design contradicts itself.
    """
    check_design(config)
    rows: dict[tuple[str, str], dict] = {}
    for purpose, experiment, fidelity, material, stress, seed in wanted(config):
        row = design_row(config, experiment, fidelity, material, stress, seed)
        known = rows.setdefault((row["simulation_id"], row["point_id"]), {**row, "purposes": []})
        if purpose not in known["purposes"]:
            known["purposes"].append(purpose)
    table = pd.DataFrame(list(rows.values()))
    table["purposes"] = table["purposes"].map(",".join)
    return ordered(table)


def ordered(table: pd.DataFrame) -> pd.DataFrame:
    """The design table in an order that does not depend on the order of keys in a file."""
    values = [column for column in table.columns if column not in ("simulation_id", "point_id", "purposes")]
    leading = ["experiment", "fidelity"]
    trailing = ["normal_stress_pa", "seed"]
    material = sorted(set(values) - set(leading) - set(trailing))
    return table.sort_values([*leading, *material, *trailing], ignore_index=True)


def further(config: dict, purpose: str, points: list[dict], seeds: dict) -> pd.DataFrame:
    """Design table of both experiments at further points: values of the design variables, rounded to four digits.

    config : material, design, repose, shear, engine of the study. seeds : repose_seeds, shear_seeds. A point that occurs twice is
    simulated once. Without points the table is empty.
    """
    rows = {}
    for values in points:
        material = point_at(config["material"], values)
        stresses = config["shear"]["normal_stresses_pa"]
        for _, *what in both(purpose, "campaign", material, stresses, seeds["repose_seeds"], seeds["shear_seeds"]):
            row = design_row(config, *what)
            rows[row["simulation_id"], row["point_id"]] = {**row, "purposes": purpose}
    template = {**make_row("repose", "campaign", config["material"], math.nan, 0), "purposes": purpose}
    return ordered(pd.DataFrame(list(rows.values()), columns=list(template)).astype({k: type(v) for k, v in template.items()}))


def wanted(config: dict):
    """Yield (purpose, experiment, fidelity, material, normal stress, seed) of every simulation, repeats included."""
    base, design, screening = config["material"], config["design"], config["screening"]
    check, stresses = config["fidelity"]["check"], config["shear"]["normal_stresses_pa"]
    for purpose, materials in (("grid", grid_points(base, design["grid"])), ("sweep", sweep_points(base, design))):
        for material in materials:
            yield from both(purpose, "campaign", material, stresses, design["repose_seeds"], design["shear_seeds"])
    for seed in screening["base_seeds"]:
        yield "screening", "repose", "campaign", base, math.nan, seed
    for parameter, value in screening["changes"].items():
        for seed in screening["changed_seeds"]:
            yield "screening", "repose", "campaign", {**base, parameter: value}, math.nan, seed
    for couple, fidelity in itertools.product(check["couples"], ("campaign", "reference")):
        material = {**base, **couple}
        yield from both("check", fidelity, material, check["normal_stresses_pa"], check["repose_seeds"], check["shear_seeds"])
    for twin in config["twins"].values():
        material = point_at(base, {name: twin[name] for name in design["variables"]})
        yield from both("twin", "campaign", material, stresses, twin["repose_seeds"], twin["shear_seeds"])


def both(purpose, fidelity, material, stresses, repose_seeds, shear_seeds):
    """Both experiments on one material."""
    for seed in repose_seeds:
        yield purpose, "repose", fidelity, material, math.nan, seed
    for stress, seed in itertools.product(stresses, shear_seeds):
        yield purpose, "shear", fidelity, material, stress, seed


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


def design_row(config: dict, experiment, fidelity, material, stress, seed) -> dict:
    """One row of the design table, purposes excepted: the point's values, and the simulation that gives its result."""
    simulated = make_row(experiment, fidelity, as_simulated(material, config, experiment), stress, seed)
    return {**make_row(experiment, fidelity, material, stress, seed), "simulation_id": simulated["simulation_id"]}


def as_simulated(material: dict, config: dict, experiment: str) -> dict:
    """The material that is simulated for a point: where grains can only slide, rolling friction is twice the static one.

    Friction turns a grain by at most mu_s F_n R at a contact, and resistance of type A (`dem.contact.rolling`) stops whatever spin
    a torque of mu_r F_n R can stop. Where mu_s < mu_r at all its contacts, a grain at rest never begins to spin, so simulations
    that differ in nothing but such a mu_r are one to the last bit. Where mu_s = mu_r they are not: rounding decides then.
    """
    sliding = material["static_friction"]
    if config["engine"]["rolling_model"] != "type_a" or material["rolling_friction"] <= sliding:
        return material
    rolling = 2.0 * sliding
    if experiment == "repose":
        wall_sliding, wall_rolling = config["repose"]["wall_static_friction"], config["repose"]["wall_rolling_friction"]
        wall_sliding = sliding if wall_sliding is None else wall_sliding
        wall_rolling = rolling if wall_rolling is None else wall_rolling
    else:
        wall_sliding, wall_rolling = config["shear"]["frame_static_friction"], 0.0
    only_slide = wall_sliding == 0.0 or wall_sliding < wall_rolling
    return {**material, "rolling_friction": rolling} if only_slide else material


def make_row(experiment, fidelity, material, stress, seed) -> dict:
    """What a simulation of a material is, as a row of the design table, purposes excepted."""
    material = {key: float(material[key]) for key in sorted(material)}
    what = [experiment, fidelity, material, None if math.isnan(stress) else float(stress), int(seed)]
    return {
        "simulation_id": hashed(what, 10),
        "experiment": experiment,
        "fidelity": fidelity,
        "point_id": point_id(material),
        **material,
        "normal_stress_pa": float(stress),
        "seed": int(seed),
    }


def screening_seeds(config: dict) -> list[int]:
    """Seeds of the screening's heaps."""
    return [*config["screening"]["base_seeds"], *config["screening"]["changed_seeds"]]


def check_sweep(name: str, levels: list[float], n_couples: int, forms: set[str]) -> None:
    """Raise CalibrationError for a sweep whose points, with a result at each, would not determine its factor g."""
    if "quadratic" in forms:
        demand(len(levels) > 2, f"design.sweep.{name}", levels, "at least three values, or g's square is not determined")
    n_points, n_terms = n_couples * len(levels), max(n_factor_terms(form) for form in forms)
    demand(n_points > n_terms, f"number of points of design.sweep.{name}", n_points, f"more than the {n_terms} coefficients of g")


def check_design(config: dict) -> None:
    """Raise CalibrationError, naming the key, when the design refers to something that does not exist."""
    material, design = set(config["material"]), config["design"]
    grid, sweep = set(design["grid"]), set(design["sweep"])
    demand(grid <= material, "design.grid", sorted(grid - material), f"keys of material: {sorted(material)}")
    demand(sweep <= material, "design.sweep", sorted(sweep - material), f"keys of material: {sorted(material)}")
    demand(not grid & sweep, "design.sweep", sorted(grid & sweep), "variables that are not in design.grid")
    demand(
        set(design["variables"]) == grid | sweep,
        "design.variables",
        design["variables"],
        f"just those of grid and sweep: {sorted(grid | sweep)}",
    )
    changes = set(config["screening"]["changes"])
    demand(changes <= material, "screening.changes", sorted(changes - material), f"keys of material: {sorted(material)}")
    for parameter, value in config["screening"]["changes"].items():
        demand(value != config["material"][parameter], f"screening.changes.{parameter}", value, "another value than material's")
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
    for test in ("repose_seeds", "shear_seeds"):
        refined = {seed + SEED_STEP * k for seed in config["refine"][test] for k in range(config["refine"]["rounds"])}
        seen = refined | set(design[test]) | (set(screening_seeds(config)) if test == "repose_seeds" else set())
        again = sorted(seen & set(config["verify"][test]))
        demand(not again, f"verify.{test}", again, "seeds that the campaign and its refinement do not use")
    for twin, entry in config["twins"].items():
        demand(
            set(entry) - SEED_KEYS == set(design["variables"]), f"twins.{twin}", sorted(entry), f"{design['variables']} and seeds"
        )
        for name in design["variables"]:
            low, high = min(values[name]), max(values[name])
            demand(low <= entry[name] <= high, f"twins.{twin}.{name}", entry[name], f"within the design, {low:g} to {high:g}")
    for couple in design["sweep_couples"]:
        for name, value in couple.items():
            demand(
                value in design["grid"][name],
                f"design.sweep_couples {name}",
                value,
                f"a value of design.grid.{name}: {design['grid'][name]}",
            )
