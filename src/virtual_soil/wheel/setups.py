"""Bed, wheel and tests of the configuration as the engine's own; what cannot be run is refused before any simulation."""

import contextlib
from types import SimpleNamespace
from typing import Any, cast

import dem
from dem.experiments import soil_bed, wheel_setup
from dem.experiments.penetration import PressTest
from dem.experiments.soil import Engine, Soil
from dem.experiments.soil_bed import Setup, SoilBed
from dem.experiments.wheel_setup import WheelShape, WheelTest
from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.campaign.experiments.common import soil_of

#: Largest difference of a mesh's width from the stated one, and largest outer radius, over those of wheel.shape.
WIDTH_TOLERANCE, OUTER_RATIO = 0.02, 1.5
#: Stands between warnings in a column.
BETWEEN_WARNINGS = " | "
#: Name of the only run of a wheel that is free to travel: it has no given slip.
FREE = "free"
#: Keys of section `wheel` that are arguments of `dem.experiments.wheel_setup.WheelTest`: on which the lowering depends, and all.
LOWERED = ("load_n", "mass_kg", "travel_ratio", "wheel_static_friction", "wheel_rolling_friction")
TESTED = (*LOWERED, "held", "drawbar_load_n", "speed_m_s")


@contextlib.contextmanager
def refused(key: str):
    """Context manager: the engine's refusals as CalibrationError, which names the section of the configuration, too."""
    try:
        yield
    except CalibrationError:
        raise
    except ValueError as error:
        raise CalibrationError(f"{key}: {error}") from None


def run_names(settings: dict) -> list[str]:
    """Names of the runs on every bed: the slips, or that of a free wheel."""
    return [FREE] if settings["held"] == "free" else [f"{slip:g}" for slip in settings["slips"]]


def slip_named(name: str) -> float | None:
    """Slip of a run; None of a free wheel."""
    return None if name == FREE else float(name)


def bed_settings(settings: dict) -> dict:
    """Arguments of `dem.experiments.soil_bed.Setup`; settings : section `wheel`."""
    bed, shape = settings["bed"], settings["shape"]
    return {
        "length_m": bed["length_ratio"] * shape["radius_m"],
        "width_m": bed["width_ratio"] * shape["width_m"],
        "depth_m": bed["depth_ratio"] * shape["radius_m"],
        "preparation_friction_ratio": bed["preparation_friction_ratio"],
        "prepared_with_adhesion": bed["prepared_with_adhesion"],
    }


def wheel_settings(settings: dict) -> dict:
    """The part of section `wheel` that acts on a run of the wheel on a given bed, but for the slip."""
    return {name: settings[name] for name in ("shape", "mesh", *TESTED)}


def lowering_settings(settings: dict) -> dict:
    """The part of section `wheel` that acts on the lowering of the wheel on a given bed."""
    return {name: settings[name] for name in ("shape", "mesh", *LOWERED)}


def shape_of(settings: dict) -> WheelShape:
    """The wheel of section `wheel`; raises CalibrationError if the mesh cannot be read or is not of the stated size."""
    shape, mesh = settings["shape"], settings["mesh"]
    grousers = shape["grousers"]
    with refused("wheel.shape" if mesh["file"] is None else "wheel.mesh"):
        if mesh["file"] is None:
            return WheelShape(
                radius_m=shape["radius_m"],
                width_m=shape["width_m"],
                rim=shape["rim"],
                grousers=grousers["count"],
                grouser_height_m=grousers["height_m"] if grousers["count"] else 0.0,
                grouser_thickness_m=grousers["thickness_m"] if grousers["count"] else 0.0,
            )
        demand(shape["rim"] == "smooth", "wheel.shape.rim", shape["rim"], "smooth with wheel.mesh.file")
        found = WheelShape.of_mesh(dem.read_mesh(mesh["file"], mesh["unit"]), mesh["axis"], shape["radius_m"])
        width, outer = shape["width_m"], OUTER_RATIO * shape["radius_m"]
        same = abs(found.width_m - width) <= WIDTH_TOLERANCE * width
        demand(same, "wheel.shape.width_m", width, f"the width of {mesh['file']}, {found.width_m:.4g} (unit {mesh['unit']})")
        allowed = f"at least {found.outer_radius_m / OUTER_RATIO:.4g} with {mesh['file']} (unit {mesh['unit']})"
        demand(found.outer_radius_m <= outer, "wheel.shape.radius_m", shape["radius_m"], allowed)
        return found


def test_of(settings: dict, name: str) -> WheelTest:
    """The test of a run; name : see `run_names`."""
    with refused("wheel"):
        return WheelTest(slip=slip_named(name), **{key: settings[key] for key in TESTED})


def lowering_of(settings: dict) -> WheelTest:
    """A test that begins as all runs do; settings : section `wheel`, or its part in `lowering_settings`."""
    with refused("wheel"):
        return WheelTest(slip=0.0, **{key: settings[key] for key in LOWERED})


def press_test(section: dict) -> PressTest:
    """The test of section `plate` or `cone`."""
    return PressTest(**{key: section[key] for key in ("depth_m", "speed_m_s", "static_friction")})


def soil_and_engine(job: dict) -> tuple[Soil, Engine]:
    """Soil and engine of a job; job : `soil` of `soil_of_case`, `grains` of `grain_settings`, `engine` of `engine_settings`."""
    return soil_of(job["soil"]["row"] | job["grains"], job["soil"]), Engine(**job["engine"])


def check_setups(settings: dict, job: dict) -> None:
    """Raise CalibrationError if the wheel is too large for its bed, or the grains are too coarse; settings : section `wheel`.

    The engine's own checks, on a stand-in for the bed, which takes minutes to prepare.
    """
    soil, engine = soil_and_engine(job)
    ratio, steered = settings["bed"]["preparation_friction_ratio"], settings["bed"]["bulk_density_kg_m3"] is not None
    key = "wheel.bed.preparation_friction_ratio"
    demand(not steered or ratio == 1.0, key, ratio, "1 with wheel.bed.bulk_density_kg_m3, for which it is found")
    setup = Setup(**bed_settings(settings))
    with refused("wheel.bed"):
        soil_bed.check(soil, setup, engine)
    materials = {soil_bed.TOOL_MATERIAL: soil.softened(engine.stiffness_reduction)}
    simulation = SimpleNamespace(materials=materials, gravity_m_s2=(0.0, 0.0, -engine.gravity_m_s2))
    stand_in: Any = SimpleNamespace(setup=setup, simulation=simulation)
    shape = shape_of(settings)
    for name in run_names(settings):
        test = test_of(settings, name)
        with refused("wheel"):
            wheel_setup.check(cast(SoilBed, stand_in), soil, shape, test)
