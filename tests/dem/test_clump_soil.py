"""The virtual tests with clumps: grains are whole clumps, and their radius is that of the sphere of equal volume."""

import copy
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem import Clump, Material, rayleigh_time
from dem.experiments import angle_of_repose, cut_slope, direct_shear, plane_shear, specimen
from dem.experiments.soil import Engine, Soil
from dem.measure.heap import measure_heap

RADIUS_M = 1e-3
#: Unequal spheres, whose centre of mass is not the mean of their centres.
PEAR = Clump.of_spheres([(0.0, 0.0, 0.0, 1.0), (0.9, 0.0, 0.0, 0.7), (0.5, 0.8, 0.0, 0.5)])
SPHERES = Soil(
    radius_m=RADIUS_M, density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=2e6, static_friction=0.8, rolling_friction=0.0,
    restitution=0.5,
)  # fmt: skip
DIMERS, PEARS = (replace(SPHERES, shape=shape) for shape in (Clump.preset("dimer"), PEAR))
HEAP = angle_of_repose.Setup(
    n_particles=700, tube_diameter_ratio=8.0, plate_half_width_ratio=20.0, lift_speed_m_s=0.04, max_time_s=1.0,
    scale_radius_m=RADIUS_M,
)  # fmt: skip
BED = plane_shear.Setup(
    length_ratio=12.0, height_ratio=12.0, width_ratio=8.0, normal_stress_pa=2000.0, preparation_friction_ratio=0.3,
    scale_radius_m=RADIUS_M, shear_strain=0.6, max_shear_strain=0.6, inertial_number=0.05,
)  # fmt: skip
BOX = direct_shear.Setup(
    length_ratio=24.0, height_ratio=14.0, width_ratio=8.0, normal_stress_pa=2000.0, preparation_friction_ratio=0.3,
    scale_radius_m=RADIUS_M, displacement_ratio=2.0, inertial_number=0.05, frame_static_friction=0.0,
)  # fmt: skip
SLOPE = cut_slope.Setup(
    length_ratio=30.0, height_ratio=12.0, thickness_ratio=8.0, tolerance_deg=20.0, preparation_friction_ratio=0.3,
    scale_radius_m=RADIUS_M,
)  # fmt: skip
ENGINE = Engine(time_step_rayleigh_ratio=0.4)


@pytest.fixture
def no_kernels(monkeypatch):
    """Nothing moves."""
    monkeypatch.setattr("dem.compiled.ensure", lambda *_, **__: None)


@pytest.fixture(scope="module")
def heap():
    return angle_of_repose.run(DIMERS, HEAP, ENGINE, 1)


def test_grains_as_wholes_are_the_clumps(no_kernels):
    simulation = angle_of_repose.build(PEARS, HEAP, ENGINE, 1)
    clumps, wholes = simulation.clumps, PEARS.wholes(simulation.grains)
    assert len(wholes) == HEAP.n_particles
    assert np.allclose(wholes.positions_m, clumps.positions_m, atol=1e-6 * RADIUS_M, rtol=0.0)
    assert np.allclose(wholes.radii_m, clumps.radii_m)
    spin = np.array([3.0, -2.0, 1.0])
    turns = Rotation.from_quat(clumps.orientations, scalar_first=True)
    spheres = simulation.grains
    for k, (x, y, z, _) in enumerate(PEAR.spheres):  # velocities of a rigid turn, and a drift
        spheres.velocities_m_s[k::3] = np.cross(spin, turns.apply([x, y, z])) + [0.5, 0.0, 0.0]
    assert np.allclose(PEARS.wholes(spheres).velocities_m_s, [0.5, 0.0, 0.0], atol=1e-6)


def test_spheres_are_their_own_wholes_and_a_clump_of_one_sphere_is_none(no_kernels):
    assert replace(SPHERES, shape=Clump.preset("sphere")) == SPHERES
    simulation = angle_of_repose.build(SPHERES, HEAP, ENGINE, 1)
    grains = simulation.grains
    assert SPHERES.wholes(grains) is grains
    assert len(simulation.clumps) == 0


@pytest.mark.parametrize("soil", [DIMERS, PEARS])
def test_the_time_step_is_that_of_the_smallest_sphere(no_kernels, soil):
    material = Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=2e6)
    smallest = min(r for *_, r in soil.shape.spheres) * RADIUS_M
    for simulation in (angle_of_repose.build(soil, HEAP, ENGINE, 1), plane_shear.build(soil, BED, ENGINE, 1)):
        assert simulation.time_step_s == pytest.approx(0.4 * rayleigh_time(smallest, material))


@pytest.mark.parametrize(("law", "factor"), [("constant", 2.0), ("jkr", 1.5)])
def test_the_adhesive_stress_is_one_contact_s_pull_off_force_over_the_diameter_of_equal_volume_squared(law, factor):
    sticky = replace(DIMERS, adhesive_stress_pa=200.0)
    member = DIMERS.shape.spheres[0][3] * RADIUS_M
    assert factor * math.pi * sticky.work_of_adhesion_j_m2(law) * 0.5 * member == pytest.approx(200.0 * (2.0 * RADIUS_M) ** 2)


def test_grains_are_softened_for_what_presses_on_their_smallest_sphere():
    smallest = min(r for *_, r in PEAR.spheres)
    soft, softer = (specimen.stiffness_reduction(soil, BED, 100.0, 0.0) for soil in (PEARS, SPHERES))
    assert softer / soft == pytest.approx(smallest**-2)


def test_a_heap_has_as_many_clumps_as_it_was_filled_with(heap):
    assert heap.status == "static"
    assert len(heap.filled) == 2 * HEAP.n_particles
    assert 0 < heap.n_lost == HEAP.n_particles - len(DIMERS.wholes(heap.grains))  # some fell off the plate
    radii = DIMERS.wholes(heap.grains).radii_m
    shape = measure_heap(heap.grains.positions_m, heap.grains.radii_m, radii)
    assert not shape.is_flat
    assert 10.0 < shape.angle_profile_deg < 40.0


def test_too_few_clumps_for_a_heap_are_counted_as_clumps(heap):
    grains = DIMERS.wholes(heap.grains)
    assert not angle_of_repose.is_flat(grains, 10 * len(grains))
    assert angle_of_repose.is_flat(grains, 10 * len(grains) + 1)


def test_an_interrupted_heap_of_clumps_ends_with_the_same_bytes(heap):
    class Stopped(Exception):
        pass

    states = []

    def keep(state):
        if state.stage == "lift" and not states:
            states.append(copy.deepcopy(state))
            raise Stopped

    with pytest.raises(Stopped):
        angle_of_repose.run(DIMERS, HEAP, ENGINE, 1, keep=keep)
    again = angle_of_repose.run(DIMERS, HEAP, ENGINE, 1, state=states[0])
    assert np.array_equal(again.grains.positions_m, heap.grains.positions_m)


def test_a_bed_of_clumps_has_the_volume_of_the_clumps():
    sheared = plane_shear.run(DIMERS, BED, ENGINE, 1)
    n = specimen.n_grains(DIMERS, BED)
    assert sheared.n_particles == n
    assert len(sheared.after) == 2 * n
    height = sheared.history["lid_height_m"]
    volume = n * 4.0 / 3.0 * math.pi * RADIUS_M**3  # not of the spheres, which overlap
    assert sheared.history["solid_fraction"] * BED.area_m2 * height == pytest.approx(volume)
    assert 0.5 < sheared.solid_fraction < 0.72
    assert 0.2 < (sheared.history["shear_stress_pa"] / sheared.history["plane_normal_stress_pa"])[10:].mean() < 1.0
    assert sheared.velocity_profile[0] > 0.8  # the floor drags the clumps that are glued to it


def test_a_shear_box_counts_clumps():
    sheared = direct_shear.run(DIMERS, BOX, ENGINE, 1)
    n = specimen.n_grains(DIMERS, BOX)
    assert sheared.n_particles == n
    assert 0.5 < sheared.solid_fraction < 0.72
    assert abs(sheared.lid_slip_ratio) < 0.3


def test_clumps_are_weighed_whole_and_glued_by_any_sphere(no_kernels):
    simulation = specimen.filled(DIMERS, BED, ENGINE, 1, [])
    spheres = simulation.grains
    radii = spheres.radii_m
    assert specimen.glue_reach_m(DIMERS, spheres) == pytest.approx(radii + 0.5 * RADIUS_M)
    weight = specimen.weight_above_n(simulation, DIMERS, -1.0)
    assert weight == pytest.approx(specimen.n_grains(DIMERS, BED) * 2500.0 * 4.0 / 3.0 * math.pi * RADIUS_M**3 * 9.81)


def test_a_slope_of_clumps_is_cut_by_their_centres():
    slope = cut_slope.run(DIMERS, SLOPE, ENGINE, 1)
    assert slope.n_particles == cut_slope.n_grains(DIMERS, SLOPE)
    assert 0.5 < slope.solid_fraction < 0.75
    centres = DIMERS.wholes(slope.before).positions_m
    angle = slope.falls_deg if slope.falls_deg == slope.falls_deg else slope.stands_deg
    level = 2.0 * RADIUS_M + slope.height_m
    surface = level - np.clip(centres[:, 0] - SLOPE.crest_m, 0.0, None) * math.tan(math.radians(angle))
    assert (centres[:, 2] <= np.maximum(surface, 2.0 * RADIUS_M) + 1e-9).all()
    spheres = slope.before.positions_m[:, 2].reshape(-1, 2).max(axis=1)
    assert (spheres > surface + 0.2 * RADIUS_M).any()  # spheres of clumps whose centre is below
