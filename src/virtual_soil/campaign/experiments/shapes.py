"""The shape of the grains: spheres, clumps of a preset, a file or an aspect ratio, or a mix of such shapes.

A study states `material.shape` and, of dimers, `material.aspect_ratio`. Before any job runs they become the study's `shape`, part
of the settings of its simulations: None for spheres, else a name, and for a file the clump itself, so that jobs need no file; of a
mix all that for every shape, with its share. The aspect ratio stays a number of the material, which may be a design variable.
"""

import functools
import math
from pathlib import Path

from dem import Clump, Mix
from dem.clumps.mix import Shape, name_of
from dem.clumps.shape import PRESETS
from virtual_soil.calibration.errors import CalibrationError, demand

SPHERE, DIMER = "sphere", "dimer"
#: Aspect ratio of dimers of which a study states none: the preset's.
USUAL_ASPECT_RATIO = 1.5
#: Digits of a file's clump in the settings; the last ones may differ between processors.
DIGITS = 9


def mixed(shape: str | list[dict] | None) -> list[dict]:
    """Entries {shape, share, key} of a `material.shape`, without those of share 0; one for a single shape, none where is none."""
    if isinstance(shape, list):
        return [{**entry, "key": f"material.shape.{k}.shape"} for k, entry in enumerate(shape) if entry["share"] != 0.0]
    return [] if shape is None else [{"shape": shape, "share": 1.0, "key": "material.shape"}]


def has_dimers(shape: str | list[dict] | None) -> bool:
    """True if dimers are among the grains of a `material.shape`."""
    return any(entry["shape"] == DIMER for entry in mixed(shape))


def numbers(material: dict) -> dict:
    """Values of the material that are numbers, which a design may vary; of dimers the aspect ratio, too."""
    found = {key: value for key, value in material.items() if isinstance(value, int | float)}
    if has_dimers(material.get("shape")):
        found.setdefault("aspect_ratio", USUAL_ASPECT_RATIO)
    return found


def resolved(config: dict) -> dict | None:
    """The study's `shape`; raises CalibrationError naming the key if it is none, or if others have an aspect ratio than dimers."""
    material = config["material"]
    shape, ratio = material["shape"], material["aspect_ratio"]
    check_shares(shape)
    entries, dimers = mixed(shape), has_dimers(shape)
    said = ", ".join(entry["shape"] for entry in entries)
    demand(dimers or ratio is None, "material.aspect_ratio", ratio, f"null with material.shape {said}: only a {DIMER} has one")
    variables = list(config["design"]["variables"])
    others = f"others with material.shape {said}: only a {DIMER} has an aspect ratio"
    demand(dimers or "aspect_ratio" not in variables, "design.variables", variables, others)
    shapes = [of_name(entry["shape"], entry["key"]) for entry in entries]
    if all(found is None for found in shapes):
        return None
    kinds = [{"name": SPHERE} if found is None else found for found in shapes]
    if len(kinds) == 1:
        return kinds[0]
    total = sum(entry["share"] for entry in entries)
    shares = [round(entry["share"] / total, DIGITS) for entry in entries]
    name = name_of([kind["name"] for kind in kinds], shares)
    found = {"name": name, "mix": [{"share": share, **kind} for share, kind in zip(shares, kinds, strict=True)]}
    clump_of({}, {"shape": found})
    return found


def check_shares(shape: str | list[dict]) -> None:
    """Refuse a mix without shapes, or whose shares are no shares."""
    if not isinstance(shape, list):
        return
    demand(len(shape) > 0, "material.shape", shape, "a shape, or a list of {shape, share}, one at least")
    for k, entry in enumerate(shape):
        allowed = "a number, zero or positive: the share of this shape in the number of grains"
        demand(0.0 <= entry["share"] < math.inf, f"material.shape.{k}.share", entry["share"], allowed)
    total = sum(entry["share"] for entry in shape)
    demand(0.0 < total < math.inf, "sum of the shares in material.shape", f"{total:g}", "a positive number")


def of_name(name: str, key: str) -> dict | None:
    """The shape of a preset or a file, None for spheres; raises CalibrationError naming the key."""
    if name in PRESETS:
        return None if name == SPHERE else {"name": name}
    allowed = f"{', '.join(PRESETS)}, or a file with a line `x y z r` for every sphere"
    demand(Path(name).is_file(), key, name, allowed)
    try:
        found = Clump.read(name)
    except (OSError, ValueError) as error:  # also of a file that is no text
        raise CalibrationError(f"{key}: {' '.join(str(error).split())}.") from None
    if found.n_spheres == 1:
        return None
    spheres = [[round(value, DIGITS) for value in sphere] for sphere in found.spheres]
    return {"name": Path(name).name, "spheres": spheres, "moments": [round(moment, DIGITS) for moment in found.moments]}


def shape_of(config: dict) -> dict:
    """The shape as part of a simulation's settings; empty for spheres, so that they need no words."""
    return {} if config.get("shape") is None else {"shape": config["shape"]}


def clump_of(row: dict, settings: dict) -> Shape | None:
    """Shape of a design row's grains; None for spheres. settings : of the simulation, or the configuration of the study.

    Raises CalibrationError if the shapes of a mix do not go together.
    """
    shape = settings.get("shape")
    if shape is None:
        return None
    if "mix" in shape:
        kinds = shape["mix"]
        prototypes = tuple(prototype(kind, row) for kind in kinds)
        try:
            return Mix(prototypes, tuple(kind["share"] for kind in kinds))
        except ValueError as error:
            raise CalibrationError(f"material.shape: {error}") from None
    return prototype(shape, row)


def prototype(kind: dict, row: dict) -> Clump:
    """Prototype of one shape; row : a design row, with the aspect ratio if there are dimers."""
    if "spheres" in kind:
        return Clump(kind["name"], tuple(map(tuple, kind["spheres"])), tuple(kind["moments"]))
    return preset(kind["name"], row.get("aspect_ratio", USUAL_ASPECT_RATIO))


@functools.cache
def preset(name: str, aspect_ratio: float) -> Clump:
    """A preset; its volume is an integral, which a design would ask for in every row."""
    return Clump.dimer(aspect_ratio) if name == DIMER else Clump.preset(name)


def screened_factors(config: dict) -> dict[str, float]:
    """Factors of the screening, of clumps without that of a rolling friction of 0: their shape stands in for it.

    A study is merged with the default's factors, so it cannot take one back itself.
    """
    factors, none = config["screening"]["factors"], config["material"]["rolling_friction"] == 0.0
    return {key: value for key, value in factors.items() if not (config["shape"] and none and key == "rolling_friction")}
