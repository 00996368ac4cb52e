"""The material card: all data of one calibrated soil that a reader needs to use and to assess it.

A dict that conforms to material.schema.json: parameters with 95 % intervals, responses predicted by the surrogates, verdicts of the
simulations, contact model in words and equations, simulation settings, and provenance. Missing numbers are null.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path

import jsonschema

from dem.clumps.mix import Shape
from dem.contact.model import words, work_of_adhesion
from virtual_soil.exports.shape import of_soil

#: Property of the grains -> (unit, meaning).
PARAMETERS = {
    "radius_m": ("m", "mean grain radius"),
    "radius_sd_ratio": ("1", "standard deviation of the radii over their mean"),
    "density_kg_m3": ("kg/m3", "density of the grains' solid"),
    "poisson_ratio": ("1", "Poisson's ratio of the grains' solid"),
    "shear_modulus_pa": ("Pa", "shear modulus of the grains' solid"),
    "static_friction": ("1", "coefficient of static friction between grains"),
    "rolling_friction": ("1", "coefficient of rolling friction between grains; see models.rolling for its definition"),
    "restitution": ("1", "coefficient of restitution"),
}
#: Formats of the cards of spheres without adhesion, of spheres with it, of clumps, and of mixes: a reader of an earlier one would
#: leave adhesion or shape out unseen.
PLAIN, STICKY, SHAPED, MIXED = 2, 3, 4, 5
#: The same of soils with adhesion, and of dimers.
ADHESIVE = {"adhesive_stress_pa": ("Pa", "pull-off force of two mean grains over their diameter squared")}
DIMER = {"aspect_ratio": ("1", "length over width of the grains, dimers")}
#: Columns of the verification table that a card has, its verdicts last.
VERDICTS = ("prediction", "match")
SIMULATED = ("response", "unit", "target", "predicted", "predicted_se", "simulated", "simulated_se", "n_seeds", *VERDICTS)
SCHEMA = json.loads(Path(__file__).with_name("material.schema.json").read_text(encoding="utf-8"))


def material_card(
    optimum: dict,
    verification: list[dict],
    config: dict,
    provenance: dict,
    responses: Mapping[str, str],
    clump: Shape | None = None,
) -> dict:
    """Return the card of one case.

    Parameters
    ----------
    optimum : the case's row of the calibration table. verification : its rows of the verification table. config : of the study.
    provenance : fingerprints (engine, inference, export) and versions. responses : column of each response -> its unit.
    clump : shape of the grains, or mix of shapes; None for spheres.
    """
    variables = list(config["design"]["variables"])
    walls = {name: optimum.get(f"wall_{name}", value) for name, value in wall_settings(config).items()}
    material = {**config["material"], **{name: optimum[name] for name in variables}}
    adhesive = material["adhesive_stress_pa"] > 0.0 or "adhesive_stress_pa" in variables
    law = config["engine"]["adhesion"] if adhesive else "none"
    shape = of_soil(clump, material["radius_m"], material["density_kg_m3"])
    further = (ADHESIVE if adhesive else {}) | (DIMER if clump is not None and material.get("aspect_ratio") is not None else {})
    card = {
        "format": "virtual-soil material card",
        "format_version": MIXED if "shapes" in shape else SHAPED if shape else STICKY if adhesive else PLAIN,
        "study": config["study"],
        "case": optimum["case"],
        "soil": optimum["soil"],
        "parameters": parameters(PARAMETERS | further, material, optimum, variables),
        **shape,
        **({"adhesion": adhesion(law, material, config, clump)} if adhesive else {}),
        "walls": {name: material[name] if value is None else value for name, value in walls.items()},
        "responses": predictions(optimum, responses),
        "verification": verdicts(optimum, verification),
        "models": words(config["engine"]["rolling_model"], law, config["engine"]["tangential_model"]),
        "simulated_with": conditions(config),
        "provenance": {"config_sha256": config_hash(config), **provenance},
    }
    return check_card(without_nan(card))


def parameters(described: Mapping[str, tuple[str, str]], material: dict, optimum: dict, variables: list[str]) -> dict:
    """Grain parameters with unit and meaning, and the interval of those that were calibrated."""
    return {
        name: {
            "value": material[name],
            "unit": unit,
            "meaning": meaning,
            "calibrated": name in variables,
            **interval(optimum, name),
        }
        for name, (unit, meaning) in described.items()
    }


def predictions(optimum: dict, responses: Mapping[str, str]) -> dict:
    """Target, prediction and its interval of each response; responses : column -> unit."""
    return {
        column: {"unit": unit, "target": optimum[f"target_{column}"], "predicted": optimum[column], **interval(optimum, column)}
        for column, unit in responses.items()
    }


def verdicts(optimum: dict, verification: list[dict]) -> dict:
    """Whether the optimum was confirmed and matches, and its simulations, of the rows of the verification table."""
    return {
        "prediction": optimum["prediction"],
        "match": optimum["match"],
        "missed": names(optimum["missed"]),
        "extrapolated": names(optimum["extrapolated"]),
        "simulations": [{key: row[key] for key in SIMULATED} for row in verification],
    }


def conditions(config: dict) -> dict:
    """Fidelity, sizes, gravity, grading and laboratory tests of the simulations."""
    tests = {name: stated for name, stated in config.items() if name.endswith("_test")}
    engine = {"gravity_m_s2": config["engine"]["gravity_m_s2"], "grading": config["grading"]}
    return config["fidelity"]["campaign"] | sizes(config) | engine | tests


def adhesion(law: str, material: dict, config: dict, clump: Shape | None) -> dict:
    """Return law, pull-off force and energies of two mean grains, and test -> True if its samples were prepared with adhesion.

    Of clumps they are those of two of their spheres, of mean radius.
    """
    radius_m = material["radius_m"]
    pull_off_n = material["adhesive_stress_pa"] * (2.0 * radius_m) ** 2
    touching = 1.0 if clump is None else clump.mean_ratio
    w = work_of_adhesion(law, pull_off_n, 0.5 * radius_m * touching)
    tests = [name for name in config["experiments"] if "prepared_with_adhesion" in config[name]]
    return {
        "law": law,
        "pull_off_force_n": pull_off_n,
        "work_of_adhesion_j_m2": w,
        "surface_energy_j_m2": 0.5 * w,
        "prepared_with_adhesion": {name: config[name]["prepared_with_adhesion"] for name in tests},
    }


def wall_settings(config: dict) -> dict[str, float | None]:
    """Return static and rolling friction of the heap's plate, None where it is the grains'; the laboratory's plate goes before."""
    plate, section = config["repose_test"]["plate"], config["repose"]
    static = section["wall_static_friction"] if plate is None else None if isinstance(plate, str) else plate
    return {"static_friction": static, "rolling_friction": section["wall_rolling_friction"]}


def sizes(config: dict) -> dict[str, float]:
    """Return the number of grains of a heap, unless it follows from a tube in SI, and the laboratory's lift speed if known."""
    stated = config["repose_test"]
    number = {} if stated["tube_diameter_m"] else {"n_particles": config["repose"]["n_particles"]}
    return number | ({"lift_speed_m_s": stated["lift_speed_m_s"]} if stated["lift_speed_m_s"] else {})


def interval(row: dict, name: str) -> dict:
    """Return the 95 % interval of a column; null if there is none."""
    return {side: row.get(f"{name}_{side}") for side in ("low_95", "high_95")}


def names(text: str) -> list[str]:
    """Split a comma-separated text into names."""
    return [name for name in text.split(",") if name]


def config_hash(config: dict) -> str:
    """SHA-256 of the configuration, independent of the order of its keys."""
    return hashlib.sha256(json.dumps(config, sort_keys=True).encode()).hexdigest()


def without_nan(value):
    """Convert to plain Python numbers, with None for NaN."""
    if isinstance(value, dict):
        return {key: without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [without_nan(item) for item in value]
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def check_card(card: dict) -> dict:
    """Return the card if it conforms to material.schema.json; raise jsonschema.ValidationError naming key, value and rule."""
    jsonschema.Draft202012Validator(SCHEMA).validate(card)
    return card
