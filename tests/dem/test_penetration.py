"""Plates and a cone pressed into a small bed."""

import copy
import dataclasses

import numpy as np
import pytest

import dem
from dem import solids
from dem.experiments import penetration, soil_bed
from dem.experiments.penetration import PressTest, Tool
from dem.experiments.soil import Engine, Soil
from dem.experiments.state import load_state, save_state

SOIL = Soil(
    radius_m=1e-3, density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e6, static_friction=0.5, rolling_friction=0.1,
    restitution=0.3, radius_sd_ratio=0.05,
)  # fmt: skip
SETUP = soil_bed.Setup(length_m=0.030, width_m=0.030, depth_m=0.020)
TEST = PressTest(depth_m=4e-3, speed_m_s=0.05)
DIAMETER_M = 0.012


@pytest.fixture(scope="module")
def bed():
    return soil_bed.prepare(SOIL, SETUP, Engine(time_step_rayleigh_ratio=0.4), 1)


@pytest.fixture(scope="module")
def pressed(bed):
    """A run, and its state in the middle."""
    states = []

    def keep(state):
        if len(state.notes["samples"]) == 200:
            states.append(copy.deepcopy(state))

    return penetration.press_plate(bed, SOIL, DIAMETER_M, TEST, keep=keep), states[0]


def test_pressure_grows_with_depth_to_the_one_that_was_asked_for(pressed):
    run, _ = pressed
    depth, pressure = run.history["depth_m"], run.history["pressure_pa"]
    assert depth[-1] == pytest.approx(TEST.depth_m, abs=1e-5)
    assert depth[0] < 0.0
    assert pressure[depth < -1.5e-3].max(initial=0.0) == 0.0
    shallow, deep = (pressure[np.abs(depth - at) < 4e-4].mean() for at in (1e-3, 3.5e-3))
    assert deep > 1.5 * shallow > 0.0
    assert run.history["force_n"] == pytest.approx(pressure * np.pi / 4.0 * DIAMETER_M**2)


def test_a_run_that_was_interrupted_ends_with_the_same_bytes(pressed, bed, tmp_path):
    run, state = pressed
    save_state(state, tmp_path / "half.npz")
    again = penetration.press_plate(bed, SOIL, DIAMETER_M, TEST, state=load_state(tmp_path / "half.npz"))
    assert all(np.array_equal(again.history[name], run.history[name]) for name in run.history)
    assert np.array_equal(again.after.positions_m, run.after.positions_m)


def test_a_plate_of_triangles_is_a_box(bed):
    """The same plate in both descriptions: the same contacts, up to rounding that chaos has not amplified yet."""
    half, height = 0.006, 0.01
    box = dem.Box(low_m=(-half, -half, 0.0), high_m=(half, half, height))
    mesh = solids.box((2.0 * half, 2.0 * half, height), position_m=(0.0, 0.0, 0.5 * height))
    test = dataclasses.replace(TEST, depth_m=1e-3)
    plain, meshed = (
        penetration.press(bed, SOIL, Tool(name="plate", shape=shape, diameter_m=2.0 * half, area_m2=4.0 * half**2), test).history
        for shape in (box, mesh)
    )
    assert plain["pressure_pa"].max() > 100.0
    assert meshed["pressure_pa"] == pytest.approx(plain["pressure_pa"], rel=1e-3, abs=1e-3 * plain["pressure_pa"].max())


def test_a_cone_is_measured_at_its_base(bed):
    test = PressTest(depth_m=2e-3, speed_m_s=0.05)
    run = penetration.push_cone(bed, SOIL, np.pi * 3.5e-3**2, 60.0, test)
    height = 3.5e-3 / np.tan(np.radians(30.0))
    tool = penetration.cone(np.pi * 3.5e-3**2, 60.0, test, SOIL)
    assert tool.reference_m == pytest.approx(height)
    assert np.ptp(tool.shape.vertices_m[:, :2], axis=0).max() == pytest.approx(7e-3, rel=1e-2)
    depth, resistance = run.history["depth_m"], run.history["pressure_pa"]
    assert depth[-1] == pytest.approx(test.depth_m, abs=1e-5)
    assert depth[0] < -height + 2e-3
    assert resistance[depth > 0.0].mean() > 2.0 * resistance[(depth < -0.3 * height) & (depth > -0.8 * height)].mean() > 0.0


@pytest.mark.parametrize(
    ("diameter", "depth", "message"),
    [
        (0.005, 4e-3, r"diameter of the plate is 0.005 m, 2.5 grain diameters; allowed: at least 3: smaller grains"),
        (0.025, 4e-3, r"diameter of the plate is 0.025; allowed: at most 0.024 in this bed, whose images it would touch"),
        (0.012, 0.02, r"depth_m of the plate is 0.02; allowed: at most 0.012 in this bed"),
    ],
)
def test_plates_that_do_not_fit_grains_and_bed_are_refused(diameter, depth, message):
    bed = soil_bed.SoilBed(SETUP, None, "done", 0.02, np.zeros((1, 1)), 0.5, 1250.0, np.zeros(0, int), 1, 0.0)
    test = PressTest(depth_m=depth, speed_m_s=0.05)
    with pytest.raises(ValueError, match=message):
        penetration.check(bed, SOIL, penetration.disc(diameter, test, SOIL), test)


@pytest.mark.parametrize("name", ["depth_m", "speed_m_s", "static_friction"])
def test_negative_settings_are_refused(name):
    with pytest.raises(ValueError, match=f"{name} of the tool is -1.0; allowed: a (zero or )?positive number|zero or positive"):
        dataclasses.replace(TEST, **{name: -1.0})


@pytest.mark.parametrize(("area", "angle", "message"), [(0.0, 60.0, "base_area_m2"), (1e-4, 170.0, "angle_deg of the cone is 170")])
def test_impossible_cones_are_refused(area, angle, message):
    with pytest.raises(ValueError, match=message):
        penetration.cone(area, angle, TEST, SOIL)


def test_what_is_coarse_or_near_its_images_is_warned_of(pressed):
    run, _ = pressed
    said = " | ".join(run.warnings)
    assert "diameter of the plate is 0.012 m, 6 grain diameters; results depend on the grain size below 10" in said
    assert "its images are felt" not in said
