"""The shape of the grains: spheres, or clumps of a preset, a file, or an aspect ratio.

A study states `material.shape` and, of dimers, `material.aspect_ratio`. Before any job runs they become the study's `shape`, part
of the settings of its simulations: None for spheres, else a name, and for a file the clump itself, so that jobs need no file. The
aspect ratio stays a number of the material, which may be a design variable.
"""

import functools
from pathlib import Path

from dem import Clump
from dem.clumps.shape import PRESETS
from virtual_soil.calibration.errors import CalibrationError, demand

SPHERE, DIMER = "sphere", "dimer"
#: Aspect ratio of dimers of which a study states none: the preset's.
USUAL_ASPECT_RATIO = 1.5
#: Digits of a file's clump in the settings; the last ones may differ between processors.
DIGITS = 9


def numbers(material: dict) -> dict:
    """Values of the material that are numbers, which a design may vary; of dimers the aspect ratio, too."""
    found = {key: value for key, value in material.items() if isinstance(value, int | float)}
    if material.get("shape") == DIMER:
        found.setdefault("aspect_ratio", USUAL_ASPECT_RATIO)
    return found


def resolved(config: dict) -> dict | None:
    """The study's `shape`; raises CalibrationError naming the key if it is none, or if others have an aspect ratio than dimers."""
    material = config["material"]
    name, ratio = material["shape"], material["aspect_ratio"]
    only = f"null with material.shape {name}: only a {DIMER} has one"
    demand(name == DIMER or ratio is None, "material.aspect_ratio", ratio, only)
    variables = list(config["design"]["variables"])
    others = f"others with material.shape {name}: only a {DIMER} has an aspect ratio"
    demand(name == DIMER or "aspect_ratio" not in variables, "design.variables", variables, others)
    if name in PRESETS:
        return None if name == SPHERE else {"name": name}
    allowed = f"{', '.join(PRESETS)}, or a file with a line `x y z r` for every sphere"
    demand(Path(name).is_file(), "material.shape", name, allowed)
    try:
        clump = Clump.read(name)
    except (OSError, ValueError) as error:  # also of a file that is no text
        raise CalibrationError(f"material.shape: {' '.join(str(error).split())}.") from None
    if clump.n_spheres == 1:
        return None
    spheres = [[round(value, DIGITS) for value in sphere] for sphere in clump.spheres]
    return {"name": Path(name).name, "spheres": spheres, "moments": [round(moment, DIGITS) for moment in clump.moments]}


def shape_of(config: dict) -> dict:
    """The shape as part of a simulation's settings; empty for spheres, so that they need no words."""
    return {} if config.get("shape") is None else {"shape": config["shape"]}


def clump_of(row: dict, settings: dict) -> Clump | None:
    """Prototype of a design row's grains; None for spheres. settings : of the simulation, or the configuration of the study."""
    shape = settings.get("shape")
    if shape is None:
        return None
    if "spheres" in shape:
        return Clump(shape["name"], tuple(map(tuple, shape["spheres"])), tuple(shape["moments"]))
    return preset(shape["name"], row.get("aspect_ratio", USUAL_ASPECT_RATIO))


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
