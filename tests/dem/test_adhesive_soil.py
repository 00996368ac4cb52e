"""Soils that stick: what their adhesive stress means, and when and to what grains stick in the virtual tests."""

from dataclasses import replace

import numpy as np
import pytest

from dem.contact.model import COMMON_COLUMNS
from dem.experiments import angle_of_repose, plane_shear, specimen
from dem.experiments.soil import Engine, Soil

SOIL = Soil(
    radius_m=50e-6,
    density_kg_m3=3000.0,
    poisson_ratio=0.2,
    shear_modulus_pa=5e6,
    static_friction=0.3,
    rolling_friction=0.1,
    restitution=0.5,
    adhesive_stress_pa=200.0,
)
BED = plane_shear.Setup(
    length_ratio=12.0, height_ratio=12.0, width_ratio=8.0, normal_stress_pa=500.0, preparation_friction_ratio=0.3,
    scale_radius_m=50e-6, shear_strain=1.0, max_shear_strain=1.0, inertial_number=0.01,
)  # fmt: skip
HEAP = angle_of_repose.Setup(
    n_particles=60, tube_diameter_ratio=6.0, plate_half_width_ratio=20.0, lift_speed_m_s=0.01, max_time_s=1.0, scale_radius_m=50e-6
)
#: Column of the work of adhesion in the pair table, after that of E*.
WORK = COMMON_COLUMNS + 1


@pytest.fixture(autouse=True)
def no_kernels(monkeypatch):
    """Nothing here moves."""
    monkeypatch.setattr("dem.compiled.ensure", lambda *_, **__: None)


def works(simulation):
    """Name of a material -> work of adhesion (J/m2) of soil with it."""
    index = simulation._state.material_index
    row = simulation._state.pair_table[index["soil"] * len(index) :]
    return {name: float(row[k, WORK]) for name, k in index.items()}


@pytest.mark.parametrize(("law", "factor"), [("constant", 2.0), ("jkr", 1.5)])
def test_the_adhesive_stress_is_the_pull_off_force_of_two_grains_over_their_diameter_squared(law, factor):
    work, R_star = SOIL.work_of_adhesion_j_m2(law), 0.5 * SOIL.radius_m
    assert factor * np.pi * work * R_star == pytest.approx(200.0 * (2.0 * SOIL.radius_m) ** 2)
    assert SOIL.work_of_adhesion_j_m2("none") == 0.0


@pytest.mark.parametrize("early", [False, True])
def test_a_bed_sticks_once_it_is_consolidated_to_itself_and_to_floor_and_lid(early):
    setup = replace(BED, prepared_with_adhesion=early)
    state = specimen.consolidation(specimen.filled(SOIL, setup, Engine(), 1, []), SOIL, setup)
    sticky = SOIL.work_of_adhesion_j_m2("constant")
    first = sticky if early else 0.0
    assert works(state.simulation) == {"soil": first, "plate": first, "frame": 0.0}
    specimen.roughen(state.simulation, SOIL)
    assert works(state.simulation) == {"soil": sticky, "plate": sticky, "frame": 0.0}


@pytest.mark.parametrize("early", [False, True])
def test_a_heap_sticks_when_the_tube_rises_and_never_to_the_tube(early):
    setup = replace(HEAP, prepared_with_adhesion=early)
    state = angle_of_repose.start(SOIL, setup, Engine(), 1)
    sticky = SOIL.work_of_adhesion_j_m2("constant")
    first = sticky if early else 0.0
    assert works(state.simulation) == {"soil": first, "plate": first, "tube": 0.0}
    angle_of_repose.lift(state, SOIL, setup)
    assert works(state.simulation) == {"soil": sticky, "plate": sticky, "tube": 0.0}


def test_without_an_adhesive_stress_the_law_is_none():
    dry = replace(SOIL, adhesive_stress_pa=0.0)
    assert angle_of_repose.start(dry, HEAP, Engine(adhesion="jkr"), 1).simulation.adhesion == "none"
    assert angle_of_repose.start(SOIL, HEAP, Engine(adhesion="jkr"), 1).simulation.adhesion == "jkr"


def test_adhesion_counts_as_a_stress_where_beds_are_softened():
    dry = replace(SOIL, adhesive_stress_pa=0.0)
    soft, softer = (specimen.stiffness_reduction(soil, BED, 5000.0, 0.0) for soil in (SOIL, dry))
    assert softer / soft == pytest.approx(1.0 + 4.0 / np.pi * 200.0 / 500.0)
