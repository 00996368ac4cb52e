"""The plane shear test on a small bed of rough grains."""

import copy
import dataclasses

import numpy as np
import pytest

from dem.experiments import plane_shear, specimen
from dem.experiments.soil import Engine, Soil

SOIL = Soil(
    radius_m=1e-3, density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e7, static_friction=0.5, rolling_friction=0.1,
    restitution=0.5,
)  # fmt: skip
SETUP = plane_shear.Setup(
    length_ratio=16.0, height_ratio=16.0, width_ratio=10.0, normal_stress_pa=2000.0, preparation_friction_ratio=0.3,
    scale_radius_m=1e-3, shear_strain=1.5, max_shear_strain=1.5, inertial_number=0.02,
)  # fmt: skip
ENGINE = Engine(time_step_rayleigh_ratio=0.3)


@pytest.fixture(scope="module")
def sheared():
    return plane_shear.run(SOIL, SETUP, ENGINE, 1)


def test_the_bed_carries_the_lid_and_resists_the_floor(sheared):
    history, steady = sheared.history, slice(len(sheared.history["time_s"]) // 2, None)
    assert history["shear_strain"][-1] == pytest.approx(SETUP.shear_strain, rel=0.01)
    assert history["plane_normal_stress_pa"][steady].mean() == pytest.approx(SETUP.normal_stress_pa, rel=0.03)  # no weight
    ratio = history["shear_stress_pa"][steady].mean() / history["plane_normal_stress_pa"][steady].mean()
    assert 0.4 < ratio < 1.0  # wider than the scatter of so small a bed
    assert 0.4 < history["solid_fraction"].min() < history["solid_fraction"].max() < 0.7


def test_the_floor_drags_the_soil_along_and_the_lid_holds_it(sheared):
    profile = sheared.velocity_profile
    assert profile[0] > 0.8
    assert abs(profile[-1]) < 0.2
    assert sheared.localisation >= 1.0


def test_the_specimen_dilates(sheared):
    assert sheared.history["lid_height_m"].max() > sheared.history["lid_height_m"][0]


def test_a_run_that_was_interrupted_ends_with_the_same_bytes(sheared):
    class Stopped(Exception):
        pass

    states = []

    def keep(state):
        if state.stage == "strain" and len(state.notes["samples"]) == 50:
            states.append(copy.deepcopy(state))
            raise Stopped

    with pytest.raises(Stopped):
        plane_shear.run(SOIL, SETUP, ENGINE, 1, keep=keep)
    again = plane_shear.run(SOIL, SETUP, ENGINE, 1, state=states[0])
    for name, values in sheared.history.items():
        assert np.array_equal(values, again.history[name]), name
    assert np.array_equal(sheared.velocity_profile, again.velocity_profile)


def test_the_number_of_grains_fills_the_box(sheared):
    assert sheared.n_particles == specimen.n_grains(SOIL, SETUP)
    assert len(sheared.after) == sheared.n_particles


def test_it_goes_on_until_the_strength_is_steady_or_says_that_it_is_not(monkeypatch):
    looks = []

    def after_three(samples):
        looks.append(len(samples))
        return len(looks) >= 3

    monkeypatch.setattr(plane_shear, "is_steady", after_three)
    longer = dataclasses.replace(SETUP, shear_strain=0.5, max_shear_strain=3.0, inertial_number=0.05)
    test = plane_shear.run(SOIL, longer, ENGINE, 1)
    assert looks == [25, 50, 75]
    assert (test.status, len(test.history["time_s"])) == ("steady", 75)
    monkeypatch.setattr(plane_shear, "is_steady", lambda samples: False)
    test = plane_shear.run(SOIL, dataclasses.replace(longer, max_shear_strain=0.6), ENGINE, 1)
    assert (test.status, len(test.history["time_s"])) == ("unsteady", 30)


def test_strength_has_no_scale_of_its_own():
    """Ten times the stress on grains ten times as stiff is the same test, but for rounding, which sheared grains amplify."""
    other = dataclasses.replace(SOIL, shear_modulus_pa=10 * SOIL.shear_modulus_pa)
    short = dataclasses.replace(SETUP, shear_strain=0.1, max_shear_strain=0.1)
    one, ten = (
        plane_shear.run(soil, dataclasses.replace(short, normal_stress_pa=p), ENGINE, 1) for soil, p in ((SOIL, 2e3), (other, 2e4))
    )
    ratios = [test.history["shear_stress_pa"] / test.history["applied_normal_stress_pa"] for test in (one, ten)]
    assert ratios[1] == pytest.approx(ratios[0], rel=0.2)
