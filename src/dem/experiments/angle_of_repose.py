"""Angle-of-repose test: a tube full of grains on a plate is lifted until the heap is at rest (Briend et al. 2011, Figure 2).

Stages: fill (grains drop from a loose lattice and settle in the standing tube), lift (the tube rises at constant speed until it
is clear of the heap), rest (until the kinetic energy is negligible, or the time is up).
The plate has an edge: grains that roll over it leave, so soils that never come to rest end too.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np

from dem import Box, Grains, Rich, Simulation, SimulationError, Tube, TubeRegion
from dem.experiments.soil import Engine, Soil, energy_balance
from dem.experiments.state import State, looks, steps_in

#: Settling takes a few free-fall times of the column; after this many it goes on regardless (frictionless soils slosh for long).
SETTLE_FALL_TIMES = 12.0
#: The heap counts as settled in the tube at this kinetic energy, looser than at the end.
SETTLED_ENERGY_RATIO = 1e-6
STATIC_ENERGY_RATIO = 1e-8
#: When fewer than this fraction of the grains is left on the plate, nothing stands.
LEAST_REMAINING_RATIO = 0.1
#: Nor when no grain is higher than this, in mean grain diameters: no estimator would find a slope (`dem.measure.heap`), and grains
#: that spread do not pile up again.
FLAT_HEIGHT_RATIO = 3.0

#: Grains that stick stand as a column if more than this share of them stays within the tube's radius, and more than that of a cone
#: of this slope: in a tube filled to its diameter both are one, in a lower fill flatter cones have the share, too. Such a heap has
#: no slope: it stood where it was filled, or fell as a whole. Friction alone leaves no columns.
COLUMN_SHARE, COLUMN_DEG = 0.6, 50.0
#: Solid fraction of a heap, for the volume of that cone.
SOLID_FRACTION = 0.57


@dataclass(frozen=True, kw_only=True)
class Setup(Rich):
    """Geometry and protocol. Ratios are over scale_radius_m, which is the grain radius unless the geometry is fixed.

    max_time_s counts from the start of the lift. Frictions of None are those between grains; wall_ means plate and tube, unless
    the tube has its own. preparation_friction_ratio multiplies the grains' frictions while the tube is filled: below 1 the
    packing is denser, as after tamping. Grains stick to each other and to the plate, not to the tube, and only once the tube is
    filled, unless prepared_with_adhesion: grains that stick as they fall pack loosely, and hardly cohere then.
    """

    n_particles: int
    tube_diameter_ratio: float
    plate_half_width_ratio: float
    lift_speed_m_s: float
    max_time_s: float
    scale_radius_m: float
    wall_static_friction: float | None = None
    wall_rolling_friction: float | None = None
    tube_static_friction: float | None = None
    preparation_friction_ratio: float = 1.0
    prepared_with_adhesion: bool = False


@dataclass(frozen=True)
class Heap(Rich):
    """Results of the test: status ("static", "time_limit", "flat" or "column"), grains before the lift and at the end, counts.

    Of clumps the grains are their spheres, as in `dem.Simulation.grains`; n_lost counts clumps, and filled_radii_m has the radii of
    equal volume of those before the lift (None: of the spheres).
    The energies are those of `dem.experiments.soil.energy_balance`.
    """

    status: str
    filled: Grains
    grains: Grains
    n_lost: int
    n_steps: int
    simulated_time_s: float
    max_overlap_ratio: float
    energy_dissipated_j: float = math.nan
    energy_residual_ratio: float = math.nan
    filled_radii_m: np.ndarray | None = None


def build(soil: Soil, setup: Setup, engine: Engine, seed: int) -> Simulation:
    """Plate, standing tube and dropped grains, at time 0."""
    scale = setup.scale_radius_m
    half = setup.plate_half_width_ratio * scale
    tube_radius = setup.tube_diameter_ratio * scale
    steel = soil.softened(engine.stiffness_reduction)
    tube_friction = setup.wall_static_friction if setup.tube_static_friction is None else setup.tube_static_friction
    options = engine.options(soil)
    early = options["adhesion"] if setup.prepared_with_adhesion else "none"
    simulation = Simulation(
        materials={"soil": steel, "plate": steel, "tube": steel},
        interactions={
            ("soil", "soil"): soil.prepared(setup.preparation_friction_ratio, early),
            ("soil", "plate"): soil.interaction(setup.wall_static_friction, setup.wall_rolling_friction, early),
            ("soil", "tube"): soil.interaction(tube_friction, setup.wall_rolling_friction),
        },
        walls=[
            Box(name="plate", material="plate", low_m=(-half, -half, 0.0), high_m=(half, half, 0.0)),
            Tube(name="tube", material="tube", radius_m=tube_radius, bottom_m=0.0, top_m=1e3 * scale),
        ],
        smallest_radius_m=soil.smallest_sphere_m,
        floor_m=-2.0 * soil.sizes.largest_m,
        **options,
    )
    region = TubeRegion(radius_m=tube_radius, bottom_m=0.0)
    simulation.add_factory(soil.factory(setup.n_particles, region, seed))
    return simulation


def height_m(grains: Grains) -> float:
    """Height of the highest grain's top; 0 without grains."""
    return float((grains.positions_m[:, 2] + grains.radii_m).max(initial=0.0))


def tube_is_clear(simulation: Simulation) -> bool:
    """True if the tube's rim is above every grain."""
    return cast(Tube, simulation.wall("tube")).bottom_m > simulation.top_m


def is_flat(grains: Grains, n_particles: int) -> bool:
    """True if the remaining grains of n_particles are too few or too low to have a slope; grains : see `Soil.wholes`."""
    few = len(grains) < LEAST_REMAINING_RATIO * n_particles
    return few or height_m(grains) < FLAT_HEIGHT_RATIO * 2.0 * float(grains.radii_m.mean())


def is_column(grains: Grains, tube_radius_m: float) -> bool:
    """True if so many grains are still within the tube's radius that they are no heap; of grains that stick (`Soil.wholes`)."""
    within = float((np.hypot(*grains.positions_m[:, :2].T) < tube_radius_m).mean())
    volume = 4.0 / 3.0 * math.pi * float((grains.radii_m**3).sum()) / SOLID_FRACTION
    foot = (3.0 * volume / (math.pi * math.tan(math.radians(COLUMN_DEG)))) ** (1.0 / 3.0)
    ratio = min(tube_radius_m / foot, 1.0)
    return within > max(COLUMN_SHARE, 3.0 * ratio**2 - 2.0 * ratio**3)


def is_at_rest(simulation: Simulation, soil: Soil, gravity_m_s2: float) -> bool:
    """True if the heap's kinetic energy is negligible (see `dem.Simulation.is_static`).

    Of clumps only those count that stand on others: without rolling friction, which their shape stands in for, single ones roll on
    over the plate and nothing stops them.
    """
    if soil.shape is None:
        return simulation.is_static(STATIC_ENERGY_RATIO)
    grains = soil.wholes(simulation.grains)
    standing = grains.positions_m[:, 2] > 2.0 * grains.radii_m
    mass, radius = grains.radii_m[standing] ** 3, grains.radii_m[standing]
    energy = 0.5 * (mass * (grains.velocities_m_s[standing] ** 2).sum(axis=1)).sum()
    return bool(energy <= STATIC_ENERGY_RATIO * gravity_m_s2 * (mass * radius).sum())


def start(soil: Soil, setup: Setup, engine: Engine, seed: int) -> State:
    """The test at its beginning: grains about to drop."""
    simulation = build(soil, setup, engine, seed)
    column_m = float(simulation.grains.positions_m[:, 2].max())
    settle_time = SETTLE_FALL_TIMES * (2.0 * column_m / engine.gravity_m_s2) ** 0.5
    return State(simulation, "fill", steps_in(settle_time, simulation), {"max_overlap_ratio": 0.0})


def lift(state: State, soil: Soil, setup: Setup) -> None:
    """Have the tube rise from now on; the filled grains are remembered."""
    simulation = state.simulation
    if simulation.n_left:
        raise SimulationError(f"{simulation.n_wholes_left} grains left the tube while it was filled")
    state.note_grains("filled", simulation.grains)
    state.notes["lift_time_s"] = simulation.time_s
    simulation.set_interaction("soil", "soil", soil.interaction(adhesion=simulation.adhesion))
    plate = soil.interaction(setup.wall_static_friction, setup.wall_rolling_friction, simulation.adhesion)
    simulation.set_interaction("soil", "plate", plate)
    simulation.move_wall("tube", (0.0, 0.0, setup.lift_speed_m_s))
    state.begin("lift", steps_in(setup.max_time_s, simulation))


def run(
    soil: Soil,
    setup: Setup,
    engine: Engine,
    seed: int,
    each: Callable[[Simulation, str], None] | None = None,
    *,
    state: State | None = None,
    keep: Callable[[State], None] | None = None,
) -> Heap:
    """Make one heap, or finish one that was interrupted in a state.

    `each(simulation, stage)` is called every 500 steps, then `keep(state)`, which may save the state (or raise, to stop).
    A run that goes on from a state ends as it would have without the interruption, bit for bit.

    Raises
    ------
    dem.SimulationError : the run blew up, grains left the tube while it was filled, or the time limit ended the lift before the
        tube was clear of the grains.
    """
    n = setup.n_particles
    state = start(soil, setup, engine, seed) if state is None else state
    simulation, look = state.simulation, looks(each)

    def at_rest(current: State) -> bool:
        s = current.simulation
        return tube_is_clear(s) and (is_flat(soil.wholes(s.grains), n) or is_at_rest(s, soil, engine.gravity_m_s2))

    if state.stage == "fill":
        state.go_on(look(lambda current: current.simulation.is_static(SETTLED_ENERGY_RATIO)), keep)
        lift(state, soil, setup)
    ended = state.go_on(look(at_rest), keep)
    if not ended and not tube_is_clear(simulation):
        rim_mm, top_mm = 1e3 * cast(Tube, simulation.wall("tube")).bottom_m, 1e3 * simulation.top_m
        raise SimulationError(
            f"the tube is not clear of the grains at the time limit of {setup.max_time_s:.3g} s: its rim is {rim_mm:.3g} mm high, "
            f"the grains {top_mm:.3g} mm"
        )
    return result(state, soil, setup, engine, ended)


def result(state: State, soil: Soil, setup: Setup, engine: Engine, ended: bool) -> Heap:
    """The outcome of a lift; ended : before its time limit."""
    simulation = state.simulation
    grains = soil.wholes(simulation.grains)
    if is_flat(grains, setup.n_particles):
        status = "flat"
    elif soil.adhesive_stress_pa > 0.0 and is_column(grains, setup.tube_diameter_ratio * setup.scale_radius_m):
        status = "column"
    else:
        status = "static" if ended else "time_limit"
    filled = state.noted_grains("filled")
    return Heap(
        status=status,
        filled=filled,
        filled_radii_m=None if soil.shape is None else soil.wholes(filled).radii_m,
        grains=simulation.grains,
        n_lost=simulation.n_wholes_left,
        n_steps=simulation.n_steps,
        simulated_time_s=simulation.time_s - state.notes["lift_time_s"],
        max_overlap_ratio=state.notes["max_overlap_ratio"],
        **energy_balance(simulation, engine),
    )
