"""What a notebook shows: every field with its value, escaped, and no array in full."""

import numpy as np

import dem
from dem.html import table


def test_a_material_is_shown_field_by_field():
    shown = dem.Material(density_kg_m3=2650.0, poisson_ratio=0.2, shear_modulus_pa=1e7)._repr_html_()
    assert "<caption>Material</caption>" in shown
    assert "<th>density_kg_m3</th><td>2650</td>" in shown
    assert "<th>shear_modulus_pa</th><td>1e+07</td>" in shown


def test_what_a_person_named_is_escaped():
    assert "<th>a&lt;b&gt;</th><td>&amp;</td>" in table("t", {"a<b>": "&"})


def test_grains_are_summed_up():
    grains = dem.Grains(np.zeros((500, 3)), np.zeros((500, 3)), np.zeros((500, 3)), np.linspace(1e-3, 2e-3, 500))
    assert repr(grains) == "Grains(500 grains)"
    assert "<th>radii_m</th><td>(500,), 0.001 to 0.002</td>" in grains._repr_html_()
    none = dem.Grains(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    assert "<th>radii_m</th><td>(0,)</td>" in none._repr_html_()


def test_a_simulation_shows_its_clock_its_walls_and_its_materials():
    glass = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=5e6)
    touch = dem.Interaction(restitution=0.5, static_friction=0.3, rolling_friction=0.1)
    floor = dem.Box(name="floor", material="glass", low_m=(-1, -1, 0), high_m=(1, 1, 0))
    simulation = dem.Simulation(
        materials={"glass": glass}, interactions={("glass", "glass"): touch}, walls=[floor], smallest_radius_m=1e-3
    )
    simulation.add_grains([(0, 0, 5e-3)], 1e-3, "glass")
    simulation.advance(10)
    shown = simulation._repr_html_()
    assert "<th>n_steps</th><td>10</td>" in shown
    assert f"<th>time_s</th><td>{10 * simulation.time_step_s:.6g}</td>" in shown
    assert "floor" in shown
    assert "density_kg_m3=2500.0" in shown
