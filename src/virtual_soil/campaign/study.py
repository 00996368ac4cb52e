"""What the Snakefile knows of a study before any job runs: its checked configuration, its simulations, its code."""

import ast
import hashlib
import math
import re
from pathlib import Path

import jsonschema
import yaml
from snakemake.exceptions import WorkflowError

from virtual_soil.calibration import CalibrationError, laboratory_files, measure_soil, weights_of
from virtual_soil.calibration.design import as_simulated, expand, point_id
from virtual_soil.calibration.errors import demand
from virtual_soil.campaign.cost import grains_and_steps
from virtual_soil.campaign.experiments import RESPONSES
from virtual_soil.campaign.tables import TableError, read_table

ROOT = Path(__file__).resolve().parents[3]

#: A soil's name is part of the paths of its results.
SOIL_NAME = "[A-Za-z0-9][A-Za-z0-9_-]*"
#: How deep a configuration may be nested (its schema is five deep), the magnitude no number in it reaches, and how many lines a
#: message about it has.
MAX_DEPTH, LARGEST, SHOWN = 20, 2.0**62, 20
#: Grains times steps that one simulation stays below: at 50 million a second, 600 years.
MAX_GRAIN_STEPS = 1e18
#: What each experiment's setup takes over from its part of the configuration.
PROTOCOL = {
    "repose": (
        "n_particles",
        "tube_diameter_ratio",
        "plate_half_width_ratio",
        "wall_static_friction",
        "wall_rolling_friction",
        "max_time_s",
    ),
    "shear": (
        "length_ratio",
        "height_ratio",
        "width_ratio",
        "displacement_ratio",
        "frame_static_friction",
        "preparation_friction_ratio",
    ),
}


def check_config(config: dict) -> None:
    """Refuse a configuration that does not obey config/schema.yaml; the message names key, value and what is allowed."""
    schema = yaml.safe_load((ROOT / "config" / "schema.yaml").read_text())
    lines = list(oddities(config))
    if not lines:
        lines = described(config, schema) or described_materials(config, schema["properties"]["material"]["properties"])
    if lines:
        raise WorkflowError("The configuration is not valid:\n" + "\n".join(f"  {line}" for line in lines[:SHOWN]))


def oddities(value, key: str = "", depth: int = 0):
    """Yield a line for all that YAML can say but no key of a study can mean, and that a schema does not see."""
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
        if not abs(value) < LARGEST:  # NaN is not, either
            yield f"{name}: {shortened(value)} is no number below {LARGEST:g}."
    elif not isinstance(value, str | None):
        yield f"{name}: {shortened(value)} is neither a number nor a text, list or mapping."


def shortened(value) -> str:
    """A value in a message, shortened; Python refuses to print very long integers."""
    text = "a whole number of more than 18 digits" if isinstance(value, int) and abs(value) >= LARGEST else str(value)
    return text if len(text) <= 200 else f"{text[:200]}..."


def described(value, schema: dict) -> list[str]:
    """A line for everything in which a value does not obey a schema, in the order of the keys."""
    errors = jsonschema.Draft202012Validator(schema).iter_errors(value)
    return [describe(error) for error in sorted(errors, key=lambda error: list(map(str, error.path)))]


def described_materials(config: dict, rules: dict[str, dict]) -> list[str]:
    """A line for every value in the design that its key of `material` may not have."""
    design, check = config["design"], config["fidelity"]["check"]
    groups = {"design.grid": design["grid"], "design.sweep": design["sweep"], "screening.changes": config["screening"]["changes"]}
    groups |= {f"design.sweep_couples.{k}": couple for k, couple in enumerate(design["sweep_couples"])}
    groups |= {f"fidelity.check.couples.{k}": couple for k, couple in enumerate(check["couples"])}
    lines = []
    for place, group in groups.items():
        for name, values in group.items():
            for value in values if isinstance(values, list) else [values]:
                lines += [
                    f"{place}.{name}{line.removeprefix('the configuration')}" for line in described(value, rules.get(name, {}))
                ]
    return lines


def describe(error: jsonschema.ValidationError) -> str:
    """One line for one schema error."""
    key = ".".join(map(str, error.absolute_path)) or "the configuration"
    if error.validator == "additionalProperties":
        known = set(error.schema.get("properties", {}))
        unknown = sorted(set(error.instance) - known)
        return f"{key}: unknown key {', '.join(map(repr, unknown))}; allowed: {', '.join(sorted(known))}."
    if error.validator == "required":
        return f"{key}: {error.message}."
    meaning = error.schema.get("description", "")
    return f"{key}: {shortened(error.message)}." + (f" It means: {meaning}" if meaning else "")


def design_rows(config: dict) -> list[dict]:
    """Rows of the design, with plain Python values (None where a value does not apply)."""
    design = config["design"]
    try:
        demand(
            {"static_friction", "rolling_friction"} <= set(design["grid"]) and "radius_m" in design["sweep"],
            "design.variables",
            design["variables"],
            "any keys of material beside static_friction and rolling_friction in design.grid and radius_m in design.sweep, which "
            "tables and figures are about",
        )
        table = expand(config)
    except ValueError as error:
        raise WorkflowError(str(error)) from None
    return plain_rows(table)


def simulations(config: dict, rows: list[dict]) -> dict[str, dict]:
    """simulation_id -> what is simulated for the rows of a design that share it, without what it is for."""
    found = {}
    for row in rows:
        if row["simulation_id"] not in found:
            material = as_simulated({key: row[key] for key in config["material"]}, config, row["experiment"])
            plain = {key: value for key, value in row.items() if key != "purposes"}
            found[row["simulation_id"]] = {**plain, **material, "point_id": point_id(material)}
    check_costs(config, found)
    return found


def check_costs(config: dict, rows: dict[str, dict]) -> None:
    """Refuse a study with a simulation that no machine could ever finish: some size, speed or time is wrong by magnitudes."""
    for row in rows.values():
        try:
            work = math.prod(grains_and_steps(row, experiment_settings(config, row)))
        except ArithmeticError:
            work = math.inf
        if not work < MAX_GRAIN_STEPS:
            raise WorkflowError(
                f"{row['experiment']}: simulation {row['simulation_id']} would take {work:g} steps of grains; allowed: below "
                f"{MAX_GRAIN_STEPS:g}. Look at material, at the sizes in {row['experiment']} and at fidelity.{row['fidelity']}."
            )


def plain_rows(table) -> list[dict]:
    """Rows of a design table, with plain Python values (None where a value does not apply)."""
    return [{key: plain_value(value) for key, value in row.items()} for row in table.to_dict("records")]


def plain_value(value):
    """Python's own number for numpy's; None for NaN."""
    plain = value.item() if hasattr(value, "item") else value
    return None if isinstance(plain, float) and math.isnan(plain) else plain


def base_simulation(config: dict, rows: list[dict], experiment: str) -> dict:
    """The campaign's row at the grid point nearest to the base set: its first seed, the largest normal stress."""
    grid = [row for row in rows if row["experiment"] == experiment and row["fidelity"] == "campaign" and "grid" in row["purposes"]]
    nearest = min(grid, key=lambda row: sum(abs(row[name] - config["material"][name]) for name in config["design"]["grid"]))
    same = [row for row in grid if row["point_id"] == nearest["point_id"] and row["seed"] == nearest["seed"]]
    return max(same, key=lambda row: row["normal_stress_pa"] or 0.0)


def planned_stages(results: str) -> list[str]:
    """The campaign and the later stages that are planned so far, by their folders below results/<study>."""
    folders = [f"{results}/verification", *sorted(map(str, Path(results).glob("rounds/*")))]
    return ["", *(folder[len(results) :] for folder in folders if (Path(folder) / "design.parquet").is_file())]


def proposed_rows(path: str) -> list[dict]:
    """Rows of the design table of a later stage."""
    try:
        return plain_rows(read_table(path, "design"))
    except TableError as error:
        raise WorkflowError(str(error)) from None


def experiment_settings(config: dict, row: dict) -> dict:
    """What a simulation depends on beside its design row: protocol, engine and fidelity (purposes do not count)."""
    experiment, fidelity = row["experiment"], config["fidelity"][row["fidelity"]]
    protocol = PROTOCOL[experiment]
    settings = {key: config[experiment][key] for key in protocol}
    scaled = config["design"]["geometry"] == "scaled"
    settings["scale_radius_m"] = row["radius_m"] if scaled else config["material"]["radius_m"]
    grown = settings["scale_radius_m"] / config["material"]["radius_m"]
    if experiment == "repose":
        settings["lift_speed_m_s"] = fidelity["lift_speed_m_s"]
        # the tube's way grows with the geometry, so the time to lift it does too; the column's stress grows as well
        settings["max_time_s"] *= grown
        softening = {"repose_stiffness_reduction": repose_softening(fidelity["repose_stiffness_reduction"], grown)}
    else:
        settings["inertial_number"] = fidelity["shear_inertial_number"]
        softening = {"shear_stiffness_number": fidelity["shear_stiffness_number"]}
    return {
        "setup": settings,
        "engine": {
            "rolling_model": config["engine"]["rolling_model"],
            "damping_model": config["engine"]["damping_model"],
            "precision": config["engine"]["precision"],
            "energy_ledger": config["engine"]["energy_ledger"],
            "gravity_m_s2": config["engine"]["gravity_m_s2"],
            "time_step_rayleigh_ratio": fidelity[f"{experiment}_time_step_rayleigh_ratio"],
        },
        "softening": softening,
    }


def repose_softening(reduction: float, grown: float) -> float:
    """Stiffness reduction of a heap whose geometry is `grown` times the base's: in proportion less where it is larger.

    E*/(rho g r) is then the same for all radii from the base's on. Never more than configured: 1 stays the grains' own stiffness.
    """
    return max(1.0, reduction / max(1.0, grown))


def soil_files(config: dict) -> list[str]:
    """The soil files of a study, refused with a message that lists what exists when one is missing."""
    folder = ROOT / "config" / "soils"
    for soil in config["soils"]:
        if not (folder / f"{soil}.yaml").is_file():
            known = ", ".join(sorted(path.stem for path in folder.glob("*.yaml")))
            raise WorkflowError(f"soils: there is no config/soils/{soil}.yaml; existing soils: {known}.")
    return [f"config/soils/{soil}.yaml" for soil in config["soils"]]


def first_answer_soils(soil: str | None, config: dict) -> dict[str, str]:
    """Name -> soil file of what rule first_answer calibrates: one soil by its name or its file, or all soils of the study."""
    if soil is None:
        return dict(zip(config["soils"], soil_files(config), strict=True))
    path = soil if Path(soil).suffix in (".yaml", ".yml") else soil_files({"soils": [soil]})[0]
    if not Path(path).is_file():
        raise WorkflowError(f"soil: there is no file {path}; allowed: a soil file (.yaml), or a name in config/soils.")
    name = Path(path).stem
    if not re.fullmatch(SOIL_NAME, name):
        raise WorkflowError(f"soil: the file's name is {name!r}; allowed: letters, digits, - and _, as it names the result.")
    try:
        measure_soil(path)
    except CalibrationError as error:
        raise WorkflowError(str(error)) from None
    return {name: path}


def raw_files(soils: list[str]) -> list[str]:
    """The laboratory files that soil files name, so that a change in one measures its soil again."""
    try:
        return [path.as_posix() for soil in soils for path in laboratory_files(soil)]
    except CalibrationError as error:
        raise WorkflowError(str(error)) from None


def check_soils(config: dict) -> None:
    """Read every soil file, so that an impossible target is refused before anything is simulated; cases must name a soil."""
    try:
        for path in soil_files(config):
            measure_soil(ROOT / path)
        known = [*config["soils"], *config["twins"]]
        for case in config["optimise"]["cases"]:
            demand(case["soil"] in known, f"optimise.cases: soil of {case['case']}", case["soil"], f"one of {known}")
            weights_of(case, RESPONSES)
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
        raise WorkflowError(str(error)) from None


def fingerprint(folder: str, without: str | None = None) -> str:
    """Hash of the parsed source of a package, so that comments and layout do not count (12 hex digits)."""
    digest = hashlib.sha256()
    for path in sorted((ROOT / folder).rglob("*.py")):
        if without is not None and (ROOT / without) in path.parents:
            continue
        digest.update(path.relative_to(ROOT).as_posix().encode())
        digest.update(ast.unparse(without_docstrings(ast.parse(path.read_text()))).encode())
    return digest.hexdigest()[:12]


def without_docstrings(tree: ast.Module) -> ast.Module:
    """The tree with every docstring removed: they are comments too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return tree
