"""Draw-down test: soil flows out of a flat-bottomed box through a slot in the middle of its floor, and leaves two slopes.

The box is a periodic slice along the slot, between smooth end walls. It is filled on a closed gate; when the soil is at rest, the
grains on the floor are glued to it (a rough floor: what stays does not slide on it), the gate is removed, and the grains flow out
until none has left for a while and the rest is at rest. Grains are gone below the floor.

One test tells three things that a heap or a shear box confuse: the rate of discharge, in which grains move fast and dilute, the
angle at rest that stays behind, and the bulk density of the filled box; `dem.measure.draw_down` reads them.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from dem import Box, Grains, Rich, Simulation, SimulationError
from dem.experiments.bed import dropped
from dem.experiments.checks import require
from dem.experiments.soil import Engine, Soil, energy_balance
from dem.experiments.specimen import glue_reach_m, rectangle
from dem.experiments.state import LOOK_STEPS, State, looks, steps_in

#: The filling is at rest at this kinetic energy (see `dem.Simulation.is_static`), at the latest after a number of free-fall times
#: of the loose column.
SETTLED_ENERGY_RATIO, SETTLE_FALL_TIMES = 1e-6, 12.0
#: The end: this kinetic energy, and no grain has left for a number of free-fall times of the filling's height.
STATIC_ENERGY_RATIO, QUIET_FALL_TIMES = 1e-8, 2.0
#: Time limit of the flow: times that the whole filling would take at Beverloo's rate, and then free-fall times of its height, of
#: which slopes take some 20 to come to rest.
LIMIT_FLOWS, LIMIT_FALL_TIMES = 8.0, 40.0
#: Solid fraction of poured grains, to choose their number and the time limit; the measured one is another.
FILL_FRACTION = 0.57
#: Law of Beverloo, Leniger & van de Velde (1961), Chem. Eng. Sci. 15, 260, for a round hole: 0.58 rho_b sqrt(g) (D - 1.4 d)^(5/2).
#: With area and hydraulic diameter (2 W of a long slot) in place of D: 0.58 (4 / pi) sqrt(2) rho_b sqrt(g) (W - 1.4 d)^(3/2) per
#: length of a slot.
BEVERLOO, EMPTY_DIAMETERS = 0.58 * 4.0 / math.pi * math.sqrt(2.0), 1.4
#: Least sizes in mean grain diameters: slot (narrower ones arch), floor beside it, height of the filling, thickness of the slice.
LEAST_SLOT, LEAST_FLOOR, LEAST_HEIGHT, LEAST_THICKNESS = 6.0, 10.0, 10.0, 2.5
#: Fewest grains from which slopes and a rate can be told.
LEAST_GRAINS = 1000
#: Looks in the time sqrt(W / g), in which grains fall through the slot.
LOOKS = 16
#: Nothing but the soil above the slot has come down, and walls stand beside it, if less than this times its mass has flowed out.
COLUMN_SHARE = 1.5
#: Grains at rest nearer to the middle of the slot than this share of its width are an arch: nothing is under them.
ARCH_SHARE = 0.25


@dataclass(frozen=True, kw_only=True)
class Setup(Rich):
    """Geometry and protocol; ratios are over scale_radius_m.

    length_ratio: distance of the end walls (x). slot_ratio: width of the slot in the middle between them. height_ratio: of the
    filling, nominal. thickness_ratio: of the slice along the slot, its period (y). preparation_friction_ratio multiplies the
    grains' frictions while the box is filled: below 1 it is tamped. Grains stick to each other and to the floor, not to the end
    walls, and only from the opening of the gate on, unless prepared_with_adhesion.
    """

    length_ratio: float
    slot_ratio: float
    height_ratio: float
    thickness_ratio: float
    scale_radius_m: float
    preparation_friction_ratio: float = 1.0
    prepared_with_adhesion: bool = False

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name.endswith("_ratio") or field.name.endswith("_m"):
                least = "zero or positive" if field.name == "preparation_friction_ratio" else "positive"
                sound = math.isfinite(value) and (value > 0.0 or (value == 0.0 and least != "positive"))
                require(sound, field.name, value, f"a {least} number")

    @property
    def length_m(self) -> float:
        """Distance of the end walls."""
        return self.length_ratio * self.scale_radius_m

    @property
    def slot_m(self) -> float:
        """Width of the slot."""
        return self.slot_ratio * self.scale_radius_m

    @property
    def height_m(self) -> float:
        """Nominal height of the filling."""
        return self.height_ratio * self.scale_radius_m

    @property
    def thickness_m(self) -> float:
        """Length of the slot that is simulated, the period along y."""
        return self.thickness_ratio * self.scale_radius_m

    @property
    def edges_m(self) -> tuple[float, float]:
        """Both edges of the slot along x."""
        return 0.5 * (self.length_m - self.slot_m), 0.5 * (self.length_m + self.slot_m)


@dataclass(frozen=True)
class DrawDown(Rich):
    """Results of the test.

    status: "done"; "arched" if grains hang over the slot at rest; "column" if the soil beside the slot stands as two walls;
    "not_finished" if grains still moved or left at the time limit.
    before, after: grains of the filled box, and those that stay. time_s, mass_out_kg_m: since the gate was opened, and the mass
    that is through the slot then, per metre of the slot. n_out: grains that left. The energies are those of
    `dem.experiments.soil.energy_balance`. Of clumps, before and after list the spheres, as `dem.Simulation.grains` does,
    n_particles and n_out count clumps, and filled_radii_m and left_radii_m are the radii of equal volume (None: of spheres).
    """

    status: str
    setup: Setup
    before: Grains
    after: Grains
    time_s: np.ndarray
    mass_out_kg_m: np.ndarray
    n_particles: int
    n_out: int
    n_steps: int
    simulated_time_s: float
    max_overlap_ratio: float
    energy_dissipated_j: float = math.nan
    energy_residual_ratio: float = math.nan
    filled_radii_m: np.ndarray | None = None
    left_radii_m: np.ndarray | None = None

    @property
    def history(self) -> dict[str, np.ndarray]:
        """Mass that has flowed out, as columns."""
        return {"time_s": self.time_s, "mass_out_kg_m": self.mass_out_kg_m}


def n_grains(soil: Soil, setup: Setup) -> int:
    """Number of grains that fill the box to its nominal height."""
    return round(FILL_FRACTION * setup.length_m * setup.thickness_m * setup.height_m / soil.grain_volume_m3)


def check(soil: Soil, setup: Setup) -> None:
    """Raise ValueError, naming the size, if the grains are too large for the box: they would arch, or leave no slope."""
    d, floor_m = 2.0 * soil.radius_m, setup.edges_m[0]
    for name, size_m, least, why in (
        ("slot width", setup.slot_m, LEAST_SLOT, "narrower ones arch"),
        ("floor beside the slot", floor_m, LEAST_FLOOR, "a longer box, for a slope to stay"),
        ("height of the filling", setup.height_m, LEAST_HEIGHT, "a higher filling, for a slope to stay"),
        ("thickness of the slice", setup.thickness_m, LEAST_THICKNESS, "a thicker slice"),
    ):
        require(
            size_m >= least * d * (1.0 - 1e-9),
            name,
            f"{1e3 * size_m:.3g} mm, {size_m / d:.3g} grain diameters",
            f"at least {least:g}: {why}",
        )
    n = n_grains(soil, setup)
    require(
        n >= LEAST_GRAINS, "number of grains in the box", n, f"at least {LEAST_GRAINS}: a larger box or slice, or smaller grains"
    )


def fall_time_s(setup: Setup, engine: Engine) -> float:
    """Time of a free fall over the height of the filling."""
    return math.sqrt(2.0 * setup.height_m / engine.gravity_m_s2)


def beverloo_kg_s_m(soil: Soil, setup: Setup, engine: Engine) -> float:
    """Rate of discharge in kg/s per metre of the slot by Beverloo's law, of loose frictional grains: a scale of time."""
    open_m = setup.slot_m - EMPTY_DIAMETERS * 2.0 * soil.radius_m
    return BEVERLOO * FILL_FRACTION * soil.density_kg_m3 * math.sqrt(engine.gravity_m_s2) * open_m**1.5


def flow_time_s(soil: Soil, setup: Setup, engine: Engine) -> float:
    """Time that the whole filling would take to flow out at that rate."""
    mass_kg_m = FILL_FRACTION * soil.density_kg_m3 * setup.length_m * setup.height_m
    return mass_kg_m / beverloo_kg_s_m(soil, setup, engine)


def walls(setup: Setup) -> list[Box]:
    """Both parts of the floor, the gate between them, and the end walls, higher than the dropped grains."""
    left, right = setup.edges_m
    ends = [
        rectangle(name, (x, 0.0), (x, 1e3 * setup.height_m)) for name, x in (("left wall", 0.0), ("right wall", setup.length_m))
    ]
    parts = (("left floor", 0.0, left), ("gate", left, right), ("right floor", right, setup.length_m))
    return [*(rectangle(name, (low, 0.0), (high, 0.0), "plate") for name, low, high in parts), *ends]


def build(soil: Soil, setup: Setup, engine: Engine, seed: int) -> Simulation:
    """Closed box and dropped grains, at time 0."""
    check(soil, setup)
    return dropped(soil, setup, engine, seed, walls(setup), n_grains(soil, setup))


def start(soil: Soil, setup: Setup, engine: Engine, seed: int) -> State:
    """The test at its beginning: grains about to drop."""
    simulation = build(soil, setup, engine, seed)
    settle_time = SETTLE_FALL_TIMES * math.sqrt(2.0 * simulation.top_m / engine.gravity_m_s2)
    return State(simulation, "fill", steps_in(settle_time, simulation), {"max_overlap_ratio": 0.0})


def open_gate(state: State, soil: Soil, setup: Setup, engine: Engine) -> None:
    """Glue the grains on the floor to it, give all their own friction, and remove the gate; the filled box is remembered."""
    simulation, grains = state.simulation, state.simulation.grains
    if simulation.n_left:
        raise SimulationError(f"{simulation.n_wholes_left} grains leaked out of the draw-down box before its gate was opened")
    state.note_grains("before", grains)
    left, right = setup.edges_m
    wholes, on_floor = soil.wholes(grains), grains.positions_m[:, 2] < glue_reach_m(soil, grains)
    # whole grains only: one that juts out would narrow the slot
    owners = soil.owners(grains)
    x, r = wholes.positions_m[owners, 0], soil.bounding_ratio * wholes.radii_m[owners]
    simulation.glue(np.flatnonzero(on_floor & (x + r <= left)), "left floor")
    simulation.glue(np.flatnonzero(on_floor & (x - r >= right)), "right floor")
    for other in ("soil", "plate"):
        simulation.set_interaction("soil", other, soil.interaction(adhesion=simulation.adhesion))
    simulation.remove_wall("gate")
    state.notes |= {"opened_s": simulation.time_s, "time_s": [0.0], "mass_out_kg": [0.0], "last_out_s": 0.0}
    state.notes["filled_cubes_m3"] = float((wholes.radii_m**3).sum())
    limit_s = LIMIT_FLOWS * flow_time_s(soil, setup, engine) + LIMIT_FALL_TIMES * fall_time_s(setup, engine)
    state.begin("flow", steps_in(limit_s, simulation))


def note_flow(state: State, soil: Soil) -> None:
    """Note the time since the gate was opened, and the mass that is through the slot."""
    notes, grains = state.notes, soil.wholes(state.simulation.grains)
    inside = grains.positions_m[:, 2] >= 0.0
    cubes = notes["filled_cubes_m3"] - float((grains.radii_m[inside] ** 3).sum())
    now, out = state.simulation.time_s - notes["opened_s"], soil.density_kg_m3 * 4.0 / 3.0 * math.pi * cubes
    if out > notes["mass_out_kg"][-1]:
        notes["last_out_s"] = now
    notes["time_s"] += [now]
    notes["mass_out_kg"] += [out]


def is_over(state: State, setup: Setup, engine: Engine) -> bool:
    """True if no grain has left for a while and the others are at rest."""
    quiet_s = state.notes["time_s"][-1] - state.notes["last_out_s"]
    return quiet_s >= QUIET_FALL_TIMES * fall_time_s(setup, engine) and state.simulation.is_static(STATIC_ENERGY_RATIO)


def is_arched(grains: Grains, setup: Setup) -> bool:
    """True if grains hang over the slot."""
    return bool((np.abs(grains.positions_m[:, 0] - 0.5 * setup.length_m) < ARCH_SHARE * setup.slot_m).any())


def status_of(ended: bool, after: Grains, out_share: float, setup: Setup) -> str:
    """Status of a test; ended: before its time limit. out_share: of the filled mass, what has flowed out."""
    if not ended:
        return "not_finished"
    if is_arched(after, setup):
        return "arched"
    return "column" if out_share < COLUMN_SHARE * setup.slot_m / setup.length_m else "done"


def run(
    soil: Soil,
    setup: Setup,
    engine: Engine,
    seed: int,
    each: Callable[[Simulation, str], None] | None = None,
    *,
    state: State | None = None,
    keep: Callable[[State], None] | None = None,
) -> DrawDown:
    """Fill one box and let it run out; or finish a test that was interrupted in a state.

    `each(simulation, stage)` is called at every look, then `keep(state)`, which may save the state (or raise, to stop). A run that
    goes on from a state ends as it would have without the interruption, bit for bit.

    Raises
    ------
    ValueError : the grains are too large for the box (`check`).
    dem.SimulationError : the run blew up, or grains left the closed box.
    """
    state = start(soil, setup, engine, seed) if state is None else state
    simulation, notes = state.simulation, state.notes

    look = looks(each)

    def flowed(current):
        note_flow(current, soil)
        return is_over(current, setup, engine)

    if state.stage == "fill":
        state.go_on(look(lambda current: simulation.is_static(SETTLED_ENERGY_RATIO)), keep)
        open_gate(state, soil, setup, engine)
    every = steps_in(math.sqrt(setup.slot_m / engine.gravity_m_s2) / LOOKS, simulation)
    ended = state.go_on(look(flowed), keep, min(LOOK_STEPS, every))
    after, before = simulation.grains, state.noted_grains("before")
    left, filled = soil.wholes(after).radii_m, soil.wholes(before).radii_m
    out_share = 1.0 - float((left**3).sum() / (filled**3).sum())
    return DrawDown(
        status=status_of(ended, after, out_share, setup),
        setup=setup,
        before=before,
        after=after,
        time_s=np.array(notes["time_s"]),
        mass_out_kg_m=np.array(notes["mass_out_kg"]) / setup.thickness_m,
        n_particles=len(filled),
        n_out=simulation.n_wholes_left,
        n_steps=simulation.n_steps,
        simulated_time_s=simulation.time_s,
        max_overlap_ratio=notes["max_overlap_ratio"],
        filled_radii_m=None if soil.shape is None else filled,
        left_radii_m=None if soil.shape is None else left,
        **energy_balance(simulation, engine),
    )
