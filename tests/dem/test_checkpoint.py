"""A simulation that is saved, loaded and run on does what it would have done without."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import dem
from dem.checkpoint import arrays_of, packed, unpacked

SAND = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e7)
STEEL = dem.Material(density_kg_m3=7800.0, poisson_ratio=0.3, shear_modulus_pa=5e7)
TOUCH = dem.Interaction(restitution=0.5, static_friction=0.4, rolling_friction=0.1)
STICKY = replace(TOUCH, work_of_adhesion_j_m2=0.05)


def everything(**settings):
    """Two materials, three sizes, a lid under force, a moving floor with glued grains, a periodic direction, a late factory."""
    among = STICKY if "adhesion" in settings else TOUCH
    simulation = dem.Simulation(
        materials={"sand": SAND, "steel": STEEL},
        interactions={("sand", "sand"): among, ("sand", "steel"): TOUCH, ("steel", "steel"): TOUCH},
        walls=[
            dem.Box(name="floor", material="steel", low_m=(-1, -1, 0), high_m=(1, 1, 0)),
            dem.Tube(name="tube", material="steel", radius_m=8e-3, bottom_m=0.0, top_m=1.0),
            dem.Box(
                name="lid", material="steel", low_m=(-1, -1, 0.04), high_m=(1, 1, 0.04),
                drive=dem.Drive(axis=2, applied_force_n=-0.02, mass_kg=1e-3, damping_kg_s=0.1),
            ),
        ],
        smallest_radius_m=0.6e-3,
        floor_m=-1e-3,
        **{"period_m": (0.0, 0.05, 0.0)} | settings,
    )  # fmt: skip
    region = dem.TubeRegion(radius_m=8e-3, bottom_m=1e-4)
    sizes = dem.Sizes(mean_m=1e-3, sd_ratio=0.2)
    simulation.add_factory(dem.Factory(n_grains=120, region=region, sizes=sizes, material="sand", seed=1))
    simulation.glue([0, 5, 9], "floor")
    simulation.move_wall("floor", (0.01, 0.0, 0.0))
    above = dem.TubeRegion(radius_m=4e-3, bottom_m=0.045)
    late = dem.Factory(n_grains=20, region=above, sizes=dem.Sizes(mean_m=1e-3), material="steel", seed=2, time_s=0.02)
    simulation.add_factory(late)
    return simulation


def state(simulation):
    """Bytes of everything that the future depends on."""
    arrays = {name: array.tobytes() for name, array in arrays_of(simulation._state).items()}
    return arrays | {"clock": (simulation.time_s, simulation.n_steps, simulation.n_left)}


@pytest.mark.parametrize(
    "settings",
    [
        {},
        # the kernels of the verification's energy balance
        {"rolling_model": "type_c", "precision": "float64", "energy_ledger": True, "period_m": (0.0, 0.0, 0.0)},
        # the kernels of a test in test_slow_twin.py
        {"vector_code": False, "damping_model": "no_pull", "adhesion": "jkr", "rolling_model": "type_c", "precision": "float64"},
    ],
)
def test_a_loaded_simulation_goes_on_bit_for_bit(tmp_path, settings):
    chunks = [2000, 900, 1500]
    straight = everything(**settings)
    for n in chunks:
        straight.advance(n)
    stopped = everything(**settings)
    for n in chunks:
        stopped.advance(n)
        dem.save(stopped, tmp_path / "state.npz")
        stopped = dem.load(tmp_path / "state.npz")
    assert stopped.n_grains == 140
    assert state(stopped) == state(straight)
    assert repr(stopped) == repr(straight)
    assert not list(tmp_path.glob("*.part"))


def test_another_process_goes_on_bit_for_bit(tmp_path):
    simulation = everything()
    simulation.advance(3000)
    dem.save(simulation, tmp_path / "state.npz")
    program = "import sys, dem; s = dem.load(sys.argv[1]); s.advance(800); dem.save(s, sys.argv[2])"
    subprocess.run([sys.executable, "-c", program, tmp_path / "state.npz", tmp_path / "later.npz"], check=True)
    simulation.advance(800)
    assert state(dem.load(tmp_path / "later.npz")) == state(simulation)


def test_large_systems_that_are_sorted_and_cut_into_slabs_go_on_bit_for_bit(tmp_path):
    def large():
        floor = dem.Box(name="floor", material="sand", low_m=(-1, -1, 0), high_m=(1, 1, 0))
        simulation = dem.Simulation(
            materials={"sand": SAND}, interactions={("sand", "sand"): TOUCH}, walls=[floor], smallest_radius_m=1e-3
        )
        region = dem.BoxRegion(low_m=(-0.1, -0.04), high_m=(0.1, 0.04), bottom_m=0.0)
        simulation.add_factory(dem.Factory(n_grains=12_000, region=region, sizes=dem.Sizes(mean_m=1e-3), material="sand", seed=1))
        simulation.advance(300)
        return simulation

    straight, stopped = large(), large()
    dem.save(stopped, tmp_path / "state.npz")
    stopped = dem.load(tmp_path / "state.npz")
    for simulation in (straight, stopped):
        simulation.advance(300)
    assert np.count_nonzero(np.diff(straight._state.lists.pairs.outer.slab)) > 1
    assert state(stopped) == state(straight)


@pytest.mark.parametrize("damage", ["empty", "truncated", "flipped", "foreign", "other engine"])
def test_a_damaged_or_foreign_file_is_refused(tmp_path, monkeypatch, damage):
    file = tmp_path / "state.npz"
    dem.save(everything(), file)
    content = file.read_bytes()
    if damage == "empty":
        file.write_bytes(b"")
    elif damage == "truncated":
        file.write_bytes(content[: len(content) // 2])
    elif damage == "flipped":
        with np.load(file) as archive:  # what lies between the arrays may change: nobody reads it
            largest = max(archive.values(), key=lambda array: array.nbytes)
        middle = content.index(largest.tobytes()) + largest.nbytes // 2
        file.write_bytes(content[:middle] + bytes([content[middle] ^ 0xFF]) + content[middle + 1 :])
    elif damage == "foreign":
        np.savez(file, a=np.zeros(3))
    else:
        monkeypatch.setattr("dem.checkpoint.source_hash", lambda: "0")
    with pytest.raises(dem.CheckpointError, match=r"state\.npz .*delete it to begin anew"):
        dem.load(file)
    with pytest.raises(FileNotFoundError):
        dem.load(tmp_path / "nothing.npz")


def test_a_packed_simulation_goes_on_as_the_one_it_was_packed_from(monkeypatch):
    """Also if the engine's files have changed since the process read them."""
    simulation = everything()
    simulation.run(0.01)
    archive = packed(simulation)
    simulation.run(0.005)
    monkeypatch.setattr("dem.checkpoint.source_hash", lambda: "another")
    again = unpacked(archive)
    again.run(0.005)
    assert state(again) == state(simulation)
