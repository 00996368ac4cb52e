"""What the experiments of a campaign share: soil and engine of a design row, and the closed forms of their costs."""

import math
from collections.abc import Callable

from dem import stable_time_step
from dem.contact.model import ROLLING
from dem.experiments.soil import Engine, Soil
from dem.factory import SPACING_RATIO

SOIL_KEYS = tuple(Soil.__dataclass_fields__)
#: Solid fraction of grains in tube and box.
SOLID_FRACTION = 0.57


def soil_of(row: dict) -> Soil:
    """The virtual soil of a design row."""
    return Soil(**{key: row[key] for key in SOIL_KEYS if key in row})


def engine_of(settings: dict) -> Engine:
    """The engine settings of a simulation."""
    return Engine(**settings["engine"])


def scale_m(config: dict, row: dict) -> float:
    """Radius that the geometry is measured in: the grains' own, unless it keeps its size at material.radius_m."""
    return row["radius_m"] if config["design"]["geometry"] == "scaled" else config["material"]["radius_m"]


def sliding(material: dict, config: dict, wall_frictions: Callable[[dict, dict], tuple[float, float]]) -> dict:
    """The material that is simulated for a point: where grains can only slide, rolling friction is twice the static one.

    Friction turns a grain by at most mu_s F_n R at a contact, and a law that brakes spins (type A) stops whatever spin a torque
    of mu_r F_n R can stop. Where mu_s < mu_r at all its contacts, a grain at rest never begins to spin, so simulations that differ
    in nothing but such a mu_r are one to the last bit. Where mu_s = mu_r they are not: rounding decides then.
    wall_frictions(material, config) : static and rolling friction of the walls.
    """
    static = material["static_friction"]
    brakes = not ROLLING[config["engine"]["rolling_model"]].SEPARATE_SPINS
    if not brakes or material["rolling_friction"] <= static:
        return material
    simulated = {**material, "rolling_friction": 2.0 * static}
    wall_static, wall_rolling = wall_frictions(simulated, config)
    return simulated if wall_static == 0.0 or wall_static < wall_rolling else material


def time_step_s(soil: Soil, engine: Engine) -> float:
    """Time step in s of a test of this soil."""
    return stable_time_step(soil.sizes.smallest_m, soil.softened(engine.stiffness_reduction), engine.time_step_rayleigh_ratio)


def grain_volume_m3(soil: Soil) -> float:
    """Mean volume of a grain in m3."""
    return 4.0 / 3.0 * math.pi * soil.radius_m**3 * (1.0 + 3.0 * soil.radius_sd_ratio**2)


def loose_column_m(soil: Soil, n_grains: int, area_m2: float) -> float:
    """Height in m of the lattice that n grains are dropped from over an area (see `dem.factory`)."""
    spacing = 2.0 * SPACING_RATIO * soil.sizes.largest_m
    return n_grains * spacing**3 / area_m2


def filled_height_m(soil: Soil, n_grains: int, area_m2: float) -> float:
    """Height in m of n settled grains over an area."""
    return n_grains * grain_volume_m3(soil) / (SOLID_FRACTION * area_m2)
