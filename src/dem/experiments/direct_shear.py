"""Direct shear test in a periodic slice (Briend et al. 2011, Figure 3).

The slice is periodic in y. A lower frame (floor, two side walls, the flange that closes the gap behind it) moves along +x at
constant speed under an upper frame at rest (two side walls and a flange); the lid rests on the soil under a constant force.
Grains that touch the floor or the lid after consolidation are glued to them: like the toothed plates of a real shear box, they
hand the full shear force over without slip. The side walls have their own friction, smooth by default: rough ones carry the
lid's load as silo walls do.

Signs: `shear_force_n` is what the soil does to the lower frame along -x, positive when it resists.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np

from dem import ENDLESS_M, Box, BoxRegion, Drive, Factory, Grains, Rich, Simulation, SimulationError
from dem.experiments.soil import Engine, Soil, energy_balance
from dem.experiments.state import State, steps_in

LOWER = ("floor", "lower_left", "lower_right", "lower_flange")
UPPER = ("upper_left", "upper_right", "upper_flange")

#: Number of samples over the shear displacement.
N_SAMPLES = 120
#: Consolidation ends when the lid moves less than this fraction of a radius between two checks; maximum in inertial times.
STILL_RATIO = 1e-3
CONSOLIDATION_TIMES = 400.0
#: The shear band spans about ten grain diameters; the shear rate is the speed over it.
BAND_DIAMETERS = 10.0
#: Solid fraction assumed to choose the number of grains.
FILL_FRACTION = 0.57
#: Grains whose surface is nearer than this fraction of a radius to floor or lid are glued to it.
GLUE_REACH_RATIO = 0.5


@dataclass(frozen=True, kw_only=True)
class Setup(Rich):
    """Geometry and protocol; ratios are over scale_radius_m. The inertial number I sets the speed: U = I h / (d sqrt(rho/p)).

    preparation_friction_ratio multiplies the grains' friction during filling and consolidation: below 1 it gives a denser
    specimen, as tamping does (rough grains that roll badly otherwise stand as a house of cards).
    """

    length_ratio: float
    height_ratio: float
    width_ratio: float
    displacement_ratio: float
    normal_stress_pa: float
    inertial_number: float
    frame_static_friction: float
    preparation_friction_ratio: float
    scale_radius_m: float

    @property
    def length_m(self) -> float:
        """Length of the box along x."""
        return self.length_ratio * self.scale_radius_m

    @property
    def width_m(self) -> float:
        """Thickness of the periodic slice along y."""
        return self.width_ratio * self.scale_radius_m

    @property
    def area_m2(self) -> float:
        """Cross-section of the box at the shear plane."""
        return self.length_m * self.width_m


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


def plane_stress_pa(soil: Soil, setup: Setup, gravity_m_s2: float) -> float:
    """Normal stress that the shear plane will carry: the lid's, and the weight of the upper half."""
    half_height = 0.5 * setup.height_ratio * setup.scale_radius_m
    return setup.normal_stress_pa + FILL_FRACTION * soil.density_kg_m3 * gravity_m_s2 * half_height


def stiffness_reduction(soil: Soil, setup: Setup, stiffness_number: float | None, gravity_m_s2: float) -> float:
    """By how much to soften the grains so that E* over the plane's normal stress is a number; never stiffer than they are.

    The same number at every stress gives the same relative overlaps, so softening does not bend the strength line; the soil's own
    weight counts, because a box that grows with its grains presses more than a small lid load. None leaves the grains as they are.
    """
    if stiffness_number is None:
        return 1.0
    E_star = soil.shear_modulus_pa / (1.0 - soil.poisson_ratio)
    return max(1.0, E_star / (stiffness_number * plane_stress_pa(soil, setup, gravity_m_s2)))


def build(soil: Soil, setup: Setup, engine: Engine, seed: int) -> Simulation:
    """Unsplit box with dropped grains and the lid above them, at time 0."""
    grain = soil.softened(engine.stiffness_reduction)
    length, width = setup.length_m, setup.width_m
    height = setup.height_ratio * setup.scale_radius_m
    volume = 4.0 / 3.0 * math.pi * soil.radius_m**3 * (1.0 + 3.0 * soil.radius_sd_ratio**2)
    n_grains = round(FILL_FRACTION * length * width * height / volume)
    region = BoxRegion(low_m=(0.0, 0.0), high_m=(length, width), bottom_m=0.0, periodic_y=True)
    factory = Factory(n_grains=n_grains, region=region, sizes=soil.sizes, material="soil", seed=seed)
    simulation = Simulation(
        materials={"soil": grain, "frame": grain, "plate": grain},
        interactions={
            ("soil", "soil"): soil.interaction(),
            ("soil", "plate"): soil.interaction(),
            ("soil", "frame"): soil.interaction(setup.frame_static_friction, 0.0),
        },
        walls=[
            rectangle("floor", (-ENDLESS_M, 0.0), (ENDLESS_M, 0.0), "plate"),
            rectangle("left", (0.0, -ENDLESS_M), (0.0, ENDLESS_M)),
            rectangle("right", (length, -ENDLESS_M), (length, ENDLESS_M)),
        ],
        period_m=(0.0, width, 0.0),
        smallest_radius_m=soil.sizes.smallest_m,
        floor_m=-2.0 * soil.sizes.largest_m,
        **engine.options,
    )
    simulation.add_factory(factory)
    simulation.add_wall(lid(soil, setup, n_grains, simulation.top_m))
    return simulation


def rectangle(name, low_xz, high_xz, material="frame") -> Box:
    """A rectangle that spans the slice in y."""
    return Box(name=name, material=material, low_m=(low_xz[0], -ENDLESS_M, low_xz[1]), high_m=(high_xz[0], ENDLESS_M, high_xz[1]))


def lid(soil: Soil, setup: Setup, n_grains: int, height_m: float) -> Box:
    """Lid under a constant force; its mass is a tenth of the soil's, its damping critical for the soil's inertial time."""
    load = setup.normal_stress_pa * setup.area_m2
    mass = 0.1 * n_grains * soil.density_kg_m3 * 4.0 / 3.0 * math.pi * soil.radius_m**3
    drive = Drive(axis=2, applied_force_n=-load, mass_kg=mass, damping_kg_s=2.0 * mass / inertial_time(soil, setup))
    plate = rectangle("lid", (-ENDLESS_M, height_m), (ENDLESS_M, height_m), "plate")
    return Box(name=plate.name, material=plate.material, low_m=plate.low_m, high_m=plate.high_m, drive=drive)


def inertial_time(soil: Soil, setup: Setup) -> float:
    """Time in s in which the pressure moves a grain by its diameter: d sqrt(rho / p)."""
    return 2.0 * soil.radius_m * math.sqrt(soil.density_kg_m3 / setup.normal_stress_pa)


def start(soil: Soil, setup: Setup, engine: Engine, seed: int) -> State:
    """The test at its beginning: the lid about to press the grains together, with the specimen's preparation friction."""
    simulation = build(soil, setup, engine, seed)
    for other in ("soil", "plate"):
        simulation.set_interaction("soil", other, soil.prepared(setup.preparation_friction_ratio))
    steps = steps_in(CONSOLIDATION_TIMES * inertial_time(soil, setup), simulation)
    return State(simulation, "consolidate", steps, {"n_particles": simulation.n_grains, "lid_height_m": math.inf})


def lid_height_m(simulation: Simulation) -> float:
    """Height of the lid's lower face."""
    return cast(Box, simulation.wall("lid")).low_m[2]


def lid_is_still(state: State, radius_m: float) -> bool:
    """True if the lid has stopped moving since the last check."""
    height, last = lid_height_m(state.simulation), state.notes["lid_height_m"]
    state.notes["lid_height_m"] = height
    return abs(height - last) < STILL_RATIO * radius_m and state.simulation.n_steps > 5000


def split(simulation: Simulation, setup: Setup) -> float:
    """Glue the outermost layers, replace the whole walls by two frames that meet at mid-height; returns that height in m."""
    grains = simulation.grains
    top, height = lid_height_m(simulation), grains.positions_m[:, 2]
    reach = (1.0 + GLUE_REACH_RATIO) * grains.radii_m
    simulation.glue(np.flatnonzero(height < reach), "floor")
    simulation.glue(np.flatnonzero(height > top - reach), "lid")
    mid, length = 0.5 * top, setup.length_m
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
    return mid


def record(simulation: Simulation, setup: Setup, mid: float, displacement: float) -> dict[str, float]:
    """One sample. The stress on the shear plane is what the upper half rests on: lid load, its own weight, less wall friction."""
    force = simulation.mean_wall_forces_n
    grains = simulation.grains
    upper = grains.positions_m[:, 2] > mid
    weight = 4.0 / 3.0 * math.pi * simulation.materials["soil"].density_kg_m3 * float((grains.radii_m[upper] ** 3).sum())
    weight *= -simulation.gravity_m_s2[2]
    shear_force = -sum(force[name][0] for name in LOWER)
    carried = force["lid"][2] + sum(force[name][2] for name in UPPER)
    return {
        "time_s": simulation.time_s,
        "displacement_m": displacement,
        "shear_force_n": shear_force,
        "shear_stress_pa": shear_force / setup.area_m2,
        "applied_normal_stress_pa": setup.normal_stress_pa,
        "plane_normal_stress_pa": (carried + weight) / setup.area_m2,
        "lid_height_m": lid_height_m(simulation),
    }


def sample_steps(soil: Soil, setup: Setup, simulation: Simulation) -> int:
    """Steps between two samples."""
    distance = setup.displacement_ratio * setup.scale_radius_m
    return max(1, math.ceil(distance / N_SAMPLES / shear_speed(soil, setup) / simulation.time_step_s))


def shear(state: State, soil: Soil, setup: Setup) -> None:
    """Split the box of the consolidated grains, which are remembered, and have the lower frame move from now on."""
    simulation = state.simulation
    for other in ("soil", "plate"):
        simulation.set_interaction("soil", other, soil.interaction())
    state.notes |= {
        "mid_m": split(simulation, setup),
        "top_m": lid_height_m(simulation),
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

    def consolidating(current):
        if each is not None:
            each(simulation, "consolidate")
        return lid_is_still(current, soil.radius_m)

    def sampling(current):
        notes = current.notes
        notes["samples"].append(record(simulation, setup, notes["mid_m"], speed * (simulation.time_s - notes["start_time_s"])))
        notes["max_overlap_ratio"] = max(notes["max_overlap_ratio"], simulation.largest_overlap_ratio())
        if each is not None:
            each(simulation, "shear")
        if simulation.n_left:
            raise SimulationError(f"{simulation.n_left} grains leaked out of the shear box")
        return False

    if state.stage == "consolidate":
        state.go_on(consolidating, keep)
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
        solid_fraction=4.0 / 3.0 * math.pi * float((before.radii_m**3).sum()) / (setup.area_m2 * top),
        lid_slip_ratio=lid_slip(before, after, top, speed * (simulation.time_s - notes["start_time_s"]), soil.radius_m),
        max_overlap_ratio=notes["max_overlap_ratio"],
        **energy_balance(simulation, engine),
    )


def lid_slip(before: Grains, after: Grains, top: float, distance: float, radius_m: float) -> float:
    """Slip of the layer under the lid's glued grains along it, over the frame's displacement (0: no slip)."""
    z = before.positions_m[:, 2]
    layer = (z < top - 2.0 * radius_m) & (z > top - 4.5 * radius_m)
    return float((after.positions_m[layer, 0] - before.positions_m[layer, 0]).mean() / distance)
