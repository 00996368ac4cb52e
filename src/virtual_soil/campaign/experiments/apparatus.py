"""The laboratory's apparatus in SI: what was done in the tests whose results are the targets.

A study states it, or the soil file does (`campaign.apparatus`). What is stated goes before the ratios, speeds and stresses of the
experiments' own sections, which are the paper's: its tests have no size of their own but that of the grains.
"""

import math
from dataclasses import dataclass

from virtual_soil.calibration.errors import demand
from virtual_soil.campaign.experiments.common import SOLID_FRACTION, USUAL_STRESSES_PA, soil_of
from virtual_soil.campaign.settings import setting

#: Names of gravitational accelerations in m/s2.
GRAVITIES_M_S2 = {"earth": 9.81, "moon": 1.62, "mars": 3.71}
#: Schema of a gravity: a name or a number.
GRAVITY = {"type": ["number", "string", "null"], "exclusiveMinimum": 0, "pattern": f"^({'|'.join(GRAVITIES_M_S2)})$"}
#: Solid fraction of poured grains, which turns a mass or a height into a number of grains; that of the simulated fill is measured.
POURED = SOLID_FRACTION
#: The plate reaches beyond the foot of the flattest heap: a cone of the fill with this slope, times this factor.
FLATTEST_DEG, MARGIN = 10.0, 1.5
#: Fewest grains across the tube that still flow out of it, and fewest grains of a heap.
LEAST_ACROSS, LEAST_GRAINS = 4.0, 50
#: Lowest slope in grain radii: a lower one is no continuum.
LEAST_HEIGHT = 12.0
#: Word for a plate that is as rough as the grains.
ROUGH = "rough"


@dataclass(frozen=True, kw_only=True)
class ReposeTest:
    """The laboratory's angle-of-repose test in SI, if it is known. What is stated here or in a soil file goes before repose."""

    tube_diameter_m: float | None = setting("inner diameter; null: repose.tube_diameter_ratio", None, above=0, usual=(1e-4, 2.0))
    fill_height_m: float | None = setting("height of the soil in the tube", None, above=0, usual=(1e-4, 5.0))
    fill_mass_kg: float | None = setting("or the mass of the soil in the tube", None, above=0, usual=(1e-7, 1e4))
    lift_speed_m_s: float | None = setting(
        "speed at which the tube is lifted; null: fidelity.*.lift_speed_m_s", None, above=0, usual=(1e-5, 1.0)
    )
    plate: float | None = setting(
        "rough (as between grains), or static friction between plate and grains; null: repose.wall_static_friction",
        None,
        of={"type": ["number", "string", "null"], "minimum": 0, "pattern": f"^{ROUGH}$"},
    )
    plate_width_m: float | None = setting("width of the square plate; null: wider than any heap", None, above=0, usual=(1e-3, 10.0))
    tube_static_friction: float | None = setting(
        "static friction between tube and grains; null: that of the plate", None, minimum=0
    )
    gravity_m_s2: float | None = setting(
        "gravity of the test: a number, or earth, moon, mars; null: engine.gravity_m_s2", None, of=GRAVITY
    )


@dataclass(frozen=True, kw_only=True)
class ShearTest:
    """The laboratory's shear test in SI, if it is known. The plane shear test has no walls, so it takes the stresses alone."""

    length_m: float | None = setting("inner length of the box; null: shear.length_ratio", None, above=0, usual=(1e-3, 2.0))
    height_m: float | None = setting("height of the soil in the box; null: shear.height_ratio", None, above=0, usual=(1e-3, 2.0))
    width_m: float | None = setting(
        "width that is simulated, a periodic slice of the box; null: shear.width_ratio", None, above=0, usual=(1e-4, 2.0)
    )
    displacement_m: float | None = setting(
        "displacement of the lower frame; null: shear.displacement_ratio", None, above=0, usual=(1e-5, 1.0)
    )
    normal_stresses_pa: list[float] | None = setting(
        "normal stresses of the laboratory, for all radii; null: those of the soil's shear file if the soil file has shear_test, "
        "else those of the experiment's section",
        None,
        above=0,
        usual=USUAL_STRESSES_PA,
        of={"minItems": 3, "uniqueItems": True},
    )


@dataclass(frozen=True, kw_only=True)
class SlopeTest:
    """The laboratory's cut slope in SI, if it is known: a bank, a trench wall, or soil cut with a spatula."""

    height_m: float | None = setting("height from toe to crest; null: slope.height_ratio", None, above=0, usual=(1e-3, 20.0))
    gravity_m_s2: float | None = setting(
        "gravity of the slope: a number, or earth, moon, mars; null: engine.gravity_m_s2", None, of=GRAVITY
    )


@dataclass(frozen=True, kw_only=True)
class DrawDownTest:
    """The laboratory's draw-down test in SI, if it is known: a flat-bottomed box with a slot in the middle of its floor."""

    box_length_m: float | None = setting(
        "distance of the end walls, across the slot; null: draw_down.length_ratio", None, above=0, usual=(1e-3, 5.0)
    )
    slot_width_m: float | None = setting("width of the slot, all along the box", None, above=0, usual=(1e-4, 1.0))
    fill_height_m: float | None = setting("height of the soil in the box", None, above=0, usual=(1e-3, 5.0))
    thickness_m: float | None = setting(
        "length of the slot that is simulated, a periodic slice; null: draw_down.thickness_ratio", None, above=0, usual=(1e-4, 2.0)
    )
    gravity_m_s2: float | None = setting(
        "gravity of the test: a number, or earth, moon, mars; null: engine.gravity_m_s2", None, of=GRAVITY
    )


@dataclass(frozen=True, kw_only=True)
class DrumTest:
    """The laboratory's rotating drum in SI, if it is known: a horizontal cylinder, lined so that the soil does not slip."""

    diameter_m: float | None = setting("inner diameter; null: rotating_drum.diameter_ratio", None, above=0, usual=(1e-3, 10.0))
    fill_ratio: float | None = setting("share of its volume that the soil fills", None, above=0, maximum=1)
    rate_rpm: float | None = setting("turns a minute, beside diameter_m", None, above=0, usual=(1e-2, 1e3))
    froude_number: float | None = setting("or omega^2 R / g, which says the same; null: rotating_drum.froude_number", None, above=0)
    thickness_m: float | None = setting(
        "length of the drum that is simulated, a periodic slice; null: rotating_drum.thickness_ratio",
        None,
        above=0,
        usual=(1e-4, 2.0),
    )
    gravity_m_s2: float | None = setting(
        "gravity of the test: a number, or earth, moon, mars; null: engine.gravity_m_s2", None, of=GRAVITY
    )


#: Key of a study and of a soil file -> its class.
SECTIONS = {
    "repose_test": ReposeTest,
    "shear_test": ShearTest,
    "slope_test": SlopeTest,
    "draw_down_test": DrawDownTest,
    "drum_test": DrumTest,
}


def gravity_m_s2(stated: float | str) -> float:
    """Gravity in m/s2 that a number or a name states."""
    return GRAVITIES_M_S2[stated] if isinstance(stated, str) else float(stated)


def gravity_of(config: dict, section: str) -> float:
    """Gravity in m/s2 of the test that a section describes: the laboratory's, else the engine's."""
    stated = config[section]["gravity_m_s2"]
    return gravity_m_s2(config["engine"]["gravity_m_s2"] if stated is None else stated)


def is_stated(section: dict) -> bool:
    """True if an apparatus states anything."""
    return any(value is not None for value in section.values())


def frictions(config: dict) -> dict:
    """Keyword arguments of the heap's Setup for what the apparatus states of plate and tube."""
    stated, found = config["repose_test"], {}
    if stated["plate"] is not None:
        found["wall_static_friction"] = None if stated["plate"] == ROUGH else stated["plate"]
    if stated["tube_static_friction"] is not None:
        found["tube_static_friction"] = stated["tube_static_friction"]
    return found


def tube(config: dict, row: dict) -> dict:
    """Keyword arguments of the heap's Setup that follow from the apparatus, for the grains of a design row; empty without a tube.

    Raises CalibrationError if fill and tube do not go together, or if the grains are too large for the tube.
    """
    stated = config["repose_test"]
    diameter, height, mass = (stated[key] for key in ("tube_diameter_m", "fill_height_m", "fill_mass_kg"))
    if diameter is None:
        for key in ("fill_height_m", "fill_mass_kg", "plate_width_m"):
            demand(stated[key] is None, f"repose_test.{key}", stated[key], "null without repose_test.tube_diameter_m")
        return frictions(config)
    fills = f"fill_height_m {height}, fill_mass_kg {mass}"
    demand((height is None) != (mass is None), "repose_test", fills, "just one of the two, beside tube_diameter_m")
    soil = soil_of(row, config)
    area, grain = math.pi * (0.5 * diameter) ** 2, soil.grain_volume_m3
    solid = POURED * area * height if mass is None else mass / soil.density_kg_m3
    n, across = round(solid / grain), diameter / (2.0 * soil.radius_m)
    sizes = f"{1e3 * diameter:.3g} mm with grains of {1e3 * soil.radius_m:.3g} mm radius"
    demand(across >= LEAST_ACROSS, "repose_test.tube_diameter_m", sizes, f"at least {LEAST_ACROSS:g} grains across")
    demand(
        n >= LEAST_GRAINS, "repose_test", f"{n} grains in the tube", f"at least {LEAST_GRAINS}: a higher fill, or smaller grains"
    )
    foot = (3.0 * solid / POURED / (math.pi * math.tan(math.radians(FLATTEST_DEG)))) ** (1.0 / 3.0)
    half = MARGIN * foot if stated["plate_width_m"] is None else 0.5 * stated["plate_width_m"]
    return frictions(config) | {
        "n_particles": n,
        "tube_diameter_ratio": across,
        "plate_half_width_ratio": half / soil.radius_m,
        "scale_radius_m": soil.radius_m,
    }


def box(config: dict, row: dict) -> dict:
    """Keyword arguments of the shear box's Setup that follow from the apparatus, for the grains of a design row."""
    stated, radius = config["shear_test"], row["radius_m"]
    ratios = {key: stated[f"{key}_m"] for key in ("length", "height", "width", "displacement") if stated[f"{key}_m"] is not None}
    if not ratios:
        return {}
    scale = {"scale_radius_m": radius} if {"length", "height"} <= set(ratios) else {}
    demand(bool(scale), "shear_test", sorted(f"{key}_m" for key in ratios), "length_m and height_m, if one size is given")
    return scale | {f"{key}_ratio": value / radius for key, value in ratios.items()}


def slope(config: dict, row: dict) -> dict:
    """Keyword arguments of the cut slope's Setup that follow from the apparatus, for the grains of a design row."""
    height, radius = config["slope_test"]["height_m"], row["radius_m"]
    if height is None:
        return {}
    sizes = f"{1e3 * height:.3g} mm with grains of {1e3 * radius:.3g} mm radius"
    demand(height >= LEAST_HEIGHT * radius, "slope_test.height_m", sizes, f"at least {LEAST_HEIGHT:g} radii: smaller grains")
    return {"height_ratio": height / radius, "scale_radius_m": radius}


def draw_down_box(config: dict, row: dict) -> dict:
    """Keyword arguments of the draw-down's Setup that follow from the apparatus, for the grains of a design row.

    Raises CalibrationError if the box is stated in part.
    """
    stated, radius = config["draw_down_test"], row["radius_m"]
    names = {"box_length_m": "length_ratio", "slot_width_m": "slot_ratio", "fill_height_m": "height_ratio"}
    missing = [key for key in names if stated[key] is None]
    if len(missing) == len(names):
        demand(
            stated["thickness_m"] is None, "draw_down_test.thickness_m", stated["thickness_m"], f"null without {', '.join(names)}"
        )
        return {}
    demand(not missing, f"draw_down_test: {', '.join(missing)}", "missing", f"{', '.join(names)} together")
    found = {ratio: stated[key] / radius for key, ratio in names.items()} | {"scale_radius_m": radius}
    return found if stated["thickness_m"] is None else found | {"thickness_ratio": stated["thickness_m"] / radius}


def drum(config: dict, row: dict, gravity_m_s2: float) -> dict:
    """Keyword arguments of the rotating drum's Setup that follow from the apparatus, for the grains of a design row.

    Raises CalibrationError if a size or a rate is stated without the diameter, or the rate twice.
    """
    stated, radius = config["drum_test"], row["radius_m"]
    found = {key: stated[key] for key in ("fill_ratio", "froude_number") if stated[key] is not None}
    if stated["diameter_m"] is None:
        for key in ("rate_rpm", "thickness_m"):
            demand(stated[key] is None, f"drum_test.{key}", stated[key], "null without drum_test.diameter_m")
        return found
    found |= {"diameter_ratio": stated["diameter_m"] / radius, "scale_radius_m": radius}
    if stated["rate_rpm"] is not None:
        rates = f"rate_rpm {stated['rate_rpm']:g}, froude_number {stated['froude_number']}"
        demand(stated["froude_number"] is None, "drum_test", rates, "one of the two")
        rate = stated["rate_rpm"] * 2.0 * math.pi / 60.0
        found["froude_number"] = rate**2 * 0.5 * stated["diameter_m"] / gravity_m_s2
    return found if stated["thickness_m"] is None else found | {"thickness_ratio": stated["thickness_m"] / radius}


def stresses_pa(config: dict) -> list[float] | None:
    """Normal stresses in Pa that the apparatus states; None if it states none."""
    return config["shear_test"]["normal_stresses_pa"]


def check_stresses_pa(config: dict) -> list[float]:
    """Normal stresses in Pa of the check points: the laboratory's middle one, else those of fidelity.check."""
    stated = stresses_pa(config)
    return config["fidelity"]["check"]["normal_stresses_pa"] if stated is None else [sorted(stated)[len(stated) // 2]]
