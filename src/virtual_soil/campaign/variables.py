"""The design of a study in its normal form: variables, their ranges and the points, whichever way the study states them.

`design.variables` as a list: the paper's full factorial and sweeps, `design.grid` and `design.sweep`. As a mapping of ranges,
{static_friction: [0.1, 1.0]}: points that fill the box of the variables, or those of the file `design.points_csv`.
A variable is any key of `material`, or a setting that its experiment declares as a property of the walls (PROPERTIES).
"""

import csv
import math
from pathlib import Path

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.space import filling, space_of
from virtual_soil.campaign.experiments.registry import BY_NAME, EXPERIMENTS, chosen
from virtual_soil.campaign.experiments.shapes import numbers

#: Properties that stand in the tables of every study, as variables or as fixed values.
PRINTED = ("radius_m", "static_friction", "rolling_friction")
#: Points of a space-filling design that states no number, for every variable; the least number for every variable.
POINTS_PER_VARIABLE, LEAST_PER_VARIABLE = 16, 5
#: Experiment -> configuration key of its seeds, the same in every stage of a study.
SEED_KEYS = {experiment.NAME: f"{experiment.NAME}_seeds" for experiment in EXPERIMENTS}
#: Property of walls -> the experiment whose setting it is, and the key of material that the setting's null stands for.
WALLS = {name: (test.NAME, grains) for test in EXPERIMENTS for name, grains in test.PROPERTIES.items()}


def with_walls(config: dict) -> dict:
    """Material of a study as numbers, with the properties of walls that are variables of its design at their settings' values."""
    material = numbers(config["material"])
    for name in config["design"]["variables"]:
        if name in WALLS:
            experiment, grains = WALLS[name]
            value = config[experiment][name]
            material[name] = material[grains] if value is None else value
    return material


def adhesion_laws(config: dict) -> list[str]:
    """Laws of adhesion that a study's simulations have, "none" among them where grains may be without an adhesive stress."""
    stress, law = config["material"]["adhesive_stress_pa"], config["engine"]["adhesion"]
    if "adhesive_stress_pa" in config["design"]["variables"]:
        return ["none", law]
    return ["none" if stress == 0.0 else law]


def normal_form(config: dict) -> dict:
    """The design with a list of its variables, and in `fixed` what tables show beside them; material : see `with_walls`.

    A factorial has no grid values, sweeps and couples of what is no variable: grid and sweep of the default configuration, which a
    study is merged with, may have more. A box has `ranges` and `points` in their place, and no grid.
    Raises CalibrationError naming the key or the file.
    """
    design = config["design"]
    names = list(design["variables"])
    fixed = {name: config["material"][name] for name in PRINTED if name not in names}
    common = {key: value for key, value in design.items() if key not in ("n_points", "points_csv")}
    common |= {"variables": names, **({"fixed": fixed} if fixed else {})}
    if not isinstance(design["variables"], dict) and design.get("points_csv") is None:
        number = "null where design.variables are names: their points are those of grid and sweep"
        demand(design.get("n_points") is None, "design.n_points", design.get("n_points"), number)
        kept = {part: {name: design[part][name] for name in design[part] if name in names} for part in ("grid", "sweep")}
        couples = [{name: couple[name] for name in couple if name in kept["grid"]} for couple in design["sweep_couples"]]
        return common | kept | {"sweep_couples": couples}
    known = {**numbers(config["material"]), **WALLS}
    demand(set(names) <= set(known), "design.variables", sorted(set(names) - set(known)), f"some of {sorted(known)}")
    common |= {"grid": {}, "sweep": {}, "sweep_couples": []}
    if design.get("points_csv") is not None:
        return common | from_file(design["points_csv"], design["variables"])
    ranges = checked_ranges(design["variables"])
    n = POINTS_PER_VARIABLE * len(names) if design.get("n_points") is None else design["n_points"]
    check_number(n, names, "design.n_points")
    return common | {"ranges": ranges, "points": filling(space_of(common | {"ranges": ranges}), n)}


def checked_ranges(variables: dict) -> dict[str, list[float]]:
    """Range of every variable; raises CalibrationError unless each rises."""
    for name, (low, high) in variables.items():
        demand(low < high, f"design.variables.{name}", [low, high], "the lowest value, then a higher one")
    return {name: [float(low), float(high)] for name, (low, high) in variables.items()}


def check_number(n: int, names: list[str], key: str) -> None:
    """Raise CalibrationError if points are too few for a surrogate over the variables."""
    least = LEAST_PER_VARIABLE * len(names)
    demand(n >= least, key, n, f"at least {least}: {LEAST_PER_VARIABLE} for every variable")


def from_file(path: str, variables: list | dict) -> dict:
    """Ranges and points of a design from a CSV file with a column for every variable.

    variables : names, whose ranges are then those of the points, or ranges, which hold all points.
    """
    where = f"design.points_csv {path}"
    demand(Path(path).is_file(), "design.points_csv", path, "a file with a column for every variable")
    with open(path, encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(line for line in file if line.strip() and not line.startswith("#")))
    columns = [name.strip() for name in (rows[0] if rows else {}) if name]
    missing = [name for name in variables if name not in columns]
    demand(not missing, f"{where}: columns", columns, f"those of design.variables; there is no {', '.join(missing)}")
    points = []
    for number, row in enumerate(rows, 1):
        cells = {str(name).strip(): cell for name, cell in row.items()}
        points.append({name: numeric(cells[name], f"{where}: {name} of point {number}") for name in variables})
    check_number(len(points), list(variables), f"{where}: number of points")
    demand(len({tuple(point.values()) for point in points}) == len(points), f"{where}: points", "some twice", "each once")
    found = {name: [min(point[name] for point in points), max(point[name] for point in points)] for name in variables}
    ranges = checked_ranges(variables if isinstance(variables, dict) else found)
    for name, (low, high) in found.items():
        inside = ranges[name][0] <= low and high <= ranges[name][1]
        demand(inside, f"{where}: {name}", [low, high], f"within design.variables, {ranges[name][0]:g} to {ranges[name][1]:g}")
    return {"ranges": ranges, "points": points}


def numeric(cell: str | None, name: str) -> float:
    """A cell as a number; raises CalibrationError for any other content."""
    try:
        value = float(cell or "")
    except ValueError:
        value = math.nan
    demand(math.isfinite(value), name, repr(cell), "a number")
    return value


def fitting_twins(config: dict) -> tuple[dict, list[str]]:
    """The twins of a study, and a line for each that is left out: named by no case, and of other variables or experiments.

    A study that is merged with another, as with config/smoke.yaml, has its twins but not its cases.
    """
    cases, variables = {case["soil"] for case in config["optimise"]["cases"]}, set(config["design"]["variables"])
    needed = {SEED_KEYS[experiment.NAME] for experiment in chosen(config["experiments"])}
    kept, lines = {}, []
    for name, entry in config["twins"].items():
        if name in cases or (set(entry) - set(SEED_KEYS.values()) == variables and needed <= set(entry)):
            kept[name] = entry
        else:
            lines.append(f"twins.{name} is left out: no case names it, and it is of another design.")
    return kept, lines


def property_rules(rules: dict[str, dict], schema_of_test) -> dict[str, dict]:
    """Schemas of all possible variables: those of material, and of the walls' settings; schema_of_test : Settings -> schema."""
    return {**rules, **{name: schema_of_test(BY_NAME[test].Settings)["properties"][name] for name, (test, _) in WALLS.items()}}
