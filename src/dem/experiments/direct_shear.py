"""Direct shear test in a periodic slice (Briend et al. 2011, Figure 3).

The slice is periodic in y. A lower frame (floor, two side walls, the flange that closes the gap behind it) moves along +x at
constant speed under an upper frame at rest (two side walls and a flange); the lid rests on the soil under a constant force.
Grains that touch the floor or the lid after consolidation are glued to them (see `dem.experiments.specimen`). The side walls have
their own friction, smooth by default: rough ones carry the lid's load as silo walls do.

Signs: `shear_force_n` is what the soil does to the lower frame along -x, positive when it resists.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dem import ENDLESS_M, Grains, Rich, Simulation, SimulationError
from dem.experiments.soil import Engine, Soil, energy_balance
from dem.experiments.specimen import (
    Specimen,
    consolidate,
    consolidation,
    filled,
    lid_height_m,
    rectangle,
    roughen,
    solid_fraction,
    weight_above_n,
)
from dem.experiments.state import State

LOWER = ("floor", "lower_left", "lower_right", "lower_flange")
UPPER = ("upper_left", "upper_right", "upper_flange")

#: Number of samples over the shear displacement.
N_SAMPLES = 120
#: The shear band spans about ten grain diameters; the shear rate is the speed over it.
BAND_DIAMETERS = 10.0


@dataclass(frozen=True, kw_only=True)
class Setup(Specimen):
    """Geometry and protocol; ratios are over scale_radius_m. The inertial number I sets the speed: U = I h / (d sqrt(rho/p))."""

    displacement_ratio: float
    inertial_number: float
    frame_static_friction: float


@dataclass(frozen=True)
class Shear(Rich):
    """Results of the test: time series, grains before and after, counts. See `record` for the series' names."""

    history: dict[str, np.ndarray]
    before: Grains
    after: Grains
    n_particles: int
    n_steps: int
    simulated_time_s: float
    solid_fraction: float
    lid_slip_ratio: float
    max_overlap_ratio: float
    energy_dissipated_j: float = math.nan
    energy_residual_ratio: float = math.nan


def shear_speed(soil: Soil, setup: Setup) -> float:
    """Speed in m/s of the lower frame at which the shear band's inertial number is the wanted one."""
    return setup.inertial_number * BAND_DIAMETERS * math.sqrt(setup.normal_stress_pa / soil.density_kg_m3)


def build(soil: Soil, setup: Setup, engine: Engine, seed: int) -> Simulation:
    """Unsplit box with dropped grains and the lid above them, at time 0."""
    left = rectangle("left", (0.0, -ENDLESS_M), (0.0, ENDLESS_M))
    right = rectangle("right", (setup.length_m, -ENDLESS_M), (setup.length_m, ENDLESS_M))
    return filled(soil, setup, engine, seed, [left, right], setup.frame_static_friction)


def start(soil: Soil, setup: Setup, engine: Engine, seed: int) -> State:
    """The test at its beginning: the lid about to press the grains together."""
    return consolidation(build(soil, setup, engine, seed), soil, setup)


def split(simulation: Simulation, setup: Setup, mid: float) -> None:
    """Replace the whole walls by two frames that meet at the height mid."""
    length = setup.length_m
    for name in ("left", "right"):
        simulation.remove_wall(name)
    for wall in (
        rectangle("lower_left", (0.0, -ENDLESS_M), (0.0, mid)),
        rectangle("lower_right", (length, -ENDLESS_M), (length, mid)),
        rectangle("lower_flange", (-ENDLESS_M, mid), (0.0, mid)),
        rectangle("upper_left", (0.0, mid), (0.0, ENDLESS_M)),
        rectangle("upper_right", (length, mid), (length, ENDLESS_M)),
        rectangle("upper_flange", (length, mid), (ENDLESS_M, mid)),
    ):
        simulation.add_wall(wall)


def record(simulation: Simulation, soil: Soil, setup: Setup, mid: float, displacement: float) -> dict[str, float]:
    """One sample. The stress on the shear plane is what the upper half rests on: lid load, its own weight, less wall friction."""
    force = simulation.mean_wall_forces_n
    shear_force = -sum(force[name][0] for name in LOWER)
    carried = force["lid"][2] + sum(force[name][2] for name in UPPER)
    return {
        "time_s": simulation.time_s,
        "displacement_m": displacement,
        "shear_force_n": shear_force,
        "shear_stress_pa": shear_force / setup.area_m2,
        "applied_normal_stress_pa": setup.normal_stress_pa,
        "plane_normal_stress_pa": (carried + weight_above_n(simulation, soil, mid)) / setup.area_m2,
        "lid_height_m": lid_height_m(simulation),
    }


def sample_steps(soil: Soil, setup: Setup, simulation: Simulation) -> int:
    """Steps between two samples."""
    distance = setup.displacement_ratio * setup.scale_radius_m
    return max(1, math.ceil(distance / N_SAMPLES / shear_speed(soil, setup) / simulation.time_step_s))


def shear(state: State, soil: Soil, setup: Setup) -> None:
    """Split the box of the consolidated grains, which are remembered, and have the lower frame move from now on."""
    simulation = state.simulation
    top = roughen(simulation, soil)
    split(simulation, setup, 0.5 * top)
    state.notes |= {
        "mid_m": 0.5 * top,
        "top_m": top,
        "start_time_s": simulation.time_s,
        "samples": [],
        "max_overlap_ratio": 0.0,
    }
    state.note_grains("before", simulation.grains)
    for name in LOWER:
        simulation.move_wall(name, (shear_speed(soil, setup), 0.0, 0.0))
    state.begin("shear", N_SAMPLES * sample_steps(soil, setup, simulation))


def run(
    soil: Soil,
    setup: Setup,
    engine: Engine,
    seed: int,
    each: Callable[[Simulation, str], None] | None = None,
    *,
    state: State | None = None,
    keep: Callable[[State], None] | None = None,
) -> Shear:
    """Consolidate, shear, and return the record; or finish a test that was interrupted in a state.

    `each(simulation, stage)` is called every 500 steps while the lid settles and at every sample of the shearing, then
    `keep(state)`, which may save the state (or raise, to stop). A run that goes on from a state ends as it would have without
    the interruption, bit for bit.

    Raises
    ------
    dem.SimulationError : the run blew up, or grains leaked out of the box.
    """
    state = start(soil, setup, engine, seed) if state is None else state
    simulation, speed = state.simulation, shear_speed(soil, setup)

    def sampling(current):
        notes = current.notes
        displacement = speed * (simulation.time_s - notes["start_time_s"])
        notes["samples"].append(record(simulation, soil, setup, notes["mid_m"], displacement))
        notes["max_overlap_ratio"] = max(notes["max_overlap_ratio"], simulation.largest_overlap_ratio())
        if each is not None:
            each(simulation, "shear")
        if simulation.n_left:
            raise SimulationError(f"{simulation.n_wholes_left} grains leaked out of the shear box")
        return False

    if state.stage == "consolidate":
        consolidate(state, soil, each, keep)
        shear(state, soil, setup)
    state.go_on(sampling, keep, sample_steps(soil, setup, simulation))
    notes, before, after = state.notes, state.noted_grains("before"), simulation.grains
    samples, top = notes["samples"], notes["top_m"]
    return Shear(
        history={name: np.array([sample[name] for sample in samples]) for name in samples[0]},
        before=before,
        after=after,
        n_particles=notes["n_particles"],
        n_steps=simulation.n_steps,
        simulated_time_s=simulation.time_s,
        solid_fraction=solid_fraction(soil.wholes(before), setup, top),
        lid_slip_ratio=lid_slip(
            soil.wholes(before),
            soil.wholes(after),
            top,
            speed * (simulation.time_s - notes["start_time_s"]),
            soil.bounding_ratio * soil.radius_m,
        ),
        max_overlap_ratio=notes["max_overlap_ratio"],
        **energy_balance(simulation, engine),
    )


def lid_slip(before: Grains, after: Grains, top: float, distance: float, radius_m: float) -> float:
    """Slip of the layer under the lid's glued grains along it, over the frame's displacement (0: no slip).

    radius_m : of the spheres around the grains, so that no glued grain is in the layer.
    """
    z = before.positions_m[:, 2]
    layer = (z < top - 2.0 * radius_m) & (z > top - 4.5 * radius_m)
    return float((after.positions_m[layer, 0] - before.positions_m[layer, 0]).mean() / distance)
