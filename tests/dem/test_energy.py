"""The energy ledger closes, and closes better with a smaller step."""

import numpy as np
import pytest

import dem

MATERIAL = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e7)


def lifted(rolling_friction=0.1, restitution=0.5, static_friction=0.4, duration_s=0.12, **settings):
    """Ledger of grains that fall into a tube, which then rises."""
    touch = dem.Interaction(restitution=restitution, static_friction=static_friction, rolling_friction=rolling_friction)
    walls = [
        dem.Box(name="floor", material="soil", low_m=(-1.0, -1.0, 0.0), high_m=(1.0, 1.0, 0.0)),
        dem.Tube(name="tube", material="soil", radius_m=5e-3, bottom_m=0.0, top_m=1.0),
    ]
    simulation = dem.Simulation(
        materials={"soil": MATERIAL}, interactions={("soil", "soil"): touch}, walls=walls, smallest_radius_m=1e-3,
        energy_ledger=True, **settings,
    )  # fmt: skip
    region = dem.TubeRegion(radius_m=5e-3, bottom_m=0.0)
    simulation.add_factory(dem.Factory(n_grains=120, region=region, sizes=dem.Sizes(mean_m=1e-3), material="soil", seed=1))
    simulation.run(duration_s)
    simulation.move_wall("tube", (0.0, 0.0, 0.05))
    simulation.run(0.05)
    return simulation.energies_j


@pytest.mark.parametrize("rolling_model", ["type_a", "type_c"])
@pytest.mark.parametrize("damping_model", ["edem", "no_pull"])
def test_the_ledger_closes_to_a_few_thousandths_and_with_the_square_of_the_step(rolling_model, damping_model):
    models = {"rolling_model": rolling_model, "damping_model": damping_model, "precision": "float64"}
    coarse, fine = (lifted(time_step_rayleigh_ratio=ratio, **models) for ratio in (0.2, 0.05))
    assert abs(coarse["residual"]) < 3e-3 * coarse["dissipated"]
    assert abs(fine["residual"]) < abs(coarse["residual"]) / 8
    for energies in (coarse, fine):
        assert min(energies[name] for name in ("kinetic", "normal_springs", "normal_dashpots", "sliding", "rolling")) > 0
        assert energies["work_of_walls"] > 0


def test_it_closes_with_the_limit_of_liggghts():
    energies = lifted(tangential_model="liggghts", precision="float64")
    assert abs(energies["residual"]) < 3e-3 * energies["dissipated"]


def test_single_precision_closes_as_well():
    energies = lifted()
    assert abs(energies["residual"]) < 3e-3 * energies["dissipated"]


def test_elastic_grains_without_friction_lose_nothing():
    energies = lifted(restitution=1.0, static_friction=0.0, rolling_friction=0.0, time_step_rayleigh_ratio=0.05)
    assert energies["dissipated"] == 0.0
    assert energies["springs_remade"] == 0.0
    held = energies["kinetic"] + energies["potential"] + energies["normal_springs"]
    assert held == pytest.approx(energies["exchanged"] + energies["work_of_walls"], rel=1e-3)


def test_grains_that_leave_take_their_energy_along():
    floor = dem.Box(name="floor", material="soil", low_m=(-1.0, -1.0, 0.0), high_m=(0.0, 1.0, 0.0))
    touch = dem.Interaction(restitution=0.5, static_friction=0.4, rolling_friction=0.1)
    simulation = dem.Simulation(
        materials={"soil": MATERIAL}, interactions={("soil", "soil"): touch}, walls=[floor], smallest_radius_m=1e-3, floor_m=-0.05,
        energy_ledger=True,
    )  # fmt: skip
    simulation.add_grains([(-0.02, 0, 2e-3), (0.02, 0, 2e-3)], 1e-3, "soil")
    simulation.run(0.3)
    energies = simulation.energies_j
    assert simulation.n_left == 1
    mass = MATERIAL.density_kg_m3 * 4 / 3 * np.pi * 1e-9
    assert energies["potential"] == pytest.approx(mass * 9.81 * 1e-3, rel=1e-3)
    assert abs(energies["residual"]) < 1e-3 * mass * 9.81 * 0.05


def test_the_ledger_changes_nothing_and_must_be_asked_for():
    def falling(**settings):
        touch = dem.Interaction(restitution=0.5, static_friction=0.4, rolling_friction=0.1)
        floor = dem.Box(name="floor", material="soil", low_m=(-1.0, -1.0, 0.0), high_m=(1.0, 1.0, 0.0))
        simulation = dem.Simulation(
            materials={"soil": MATERIAL}, interactions={("soil", "soil"): touch}, walls=[floor], smallest_radius_m=1e-3, **settings
        )
        region = dem.TubeRegion(radius_m=5e-3, bottom_m=0.0)
        simulation.add_factory(dem.Factory(n_grains=60, region=region, sizes=dem.Sizes(mean_m=1e-3), material="soil", seed=1))
        simulation.advance(2000)
        return simulation

    plain, booked = falling(precision="float64"), falling(precision="float64", energy_ledger=True)
    assert booked.grains.positions_m == pytest.approx(plain.grains.positions_m, rel=1e-9)
    with pytest.raises(ValueError, match="energy_ledger is False; allowed: True"):
        plain.energies_j  # noqa: B018
