"""Cut slope: a settled bed is cut at an angle; the steepest cut that stands is found by bisection.

The bed lies between two smooth end walls on a rough floor, periodic in y, prepared without adhesion. It is noted once at rest,
and every cut starts from it: grains get their friction and adhesion, those above a plane that falls from the crest to the floor are
removed, and so is the wall in front of the toe. The slope has fallen when a share of a wedge as deep as it is high has moved,
whatever the length of the bed; it stands when it is at rest again or its time is up. A laboratory does the same with a spatula, and
a trench wall is such a cut.

A heap made by lifting a tube stops being a slope as soon as its grains cohere: it stands as a column, or falls as a whole. A cut is
monotone in the cohesion up to a vertical wall. Its angle belongs to a height: cohesion over rho_b g H decides.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dem import Box, Grains, Rich, Simulation, packed, unpacked
from dem.experiments.bed import dropped
from dem.experiments.soil import Engine, Soil, energy_balance
from dem.experiments.specimen import floor, glue_reach_m, rectangle
from dem.experiments.state import State, looks, steps_in

#: The bed is at rest at this kinetic energy (see `dem.Simulation.is_static`); at the latest after a number of the loose column's
#: free-fall times.
SETTLED_ENERGY_RATIO, SETTLE_FALL_TIMES = 1e-6, 12.0
#: A slope is at rest at this one, at the earliest after one free-fall time of its height; it stands if it has not fallen after
#: STAND_FALL_TIMES.
STATIC_ENERGY_RATIO, STAND_FALL_TIMES = 1e-8, 5.0
#: A slope has fallen when grains with more than this share of the solid volume of the wedge below 45 degrees (half the square of
#: the height) have moved by this number of mean radii.
FALLEN_SHARE, FALLEN_RADII = 0.1, 2.0
#: Depth of the soil behind the crest over the height: the wedge behind a vertical wall of weak grains is as deep.
CREST_RATIO = 0.7
#: Solid fraction that fills the box to more than the height; what is above is cut off. (Random packings of spheres reach 0.64.)
FILL_FRACTION = 0.66
#: The bed's level is no higher than this fraction of its grains: sizes that pack densely may not reach the nominal height.
FULL = 0.98
#: Height of the rough floor in mean radii: the toe is on top of the grains that are glued to it.
FLOOR_LAYER = 2.0
#: Distance from the end walls, and share of the height at the bottom and at the top, left out where the solid fraction is measured.
CORE_MARGIN_RADII, CORE_MARGIN = 4.0, 0.2
VERTICAL_DEG = 90.0


@dataclass(frozen=True, kw_only=True)
class Setup(Rich):
    """Geometry and protocol; ratios are over scale_radius_m.

    length_ratio, thickness_ratio: of the bed along x, and along y, its period. height_ratio: of the slope, toe to crest.
    tolerance_deg: bracket of the slope angle at which the bisection ends. preparation_friction_ratio multiplies the grains'
    frictions while the bed settles: below 1 it is denser, as after tamping. Grains stick to each other and to the floor, not to the
    end walls, and only from the cut on, unless prepared_with_adhesion.
    """

    length_ratio: float
    height_ratio: float
    thickness_ratio: float
    tolerance_deg: float
    preparation_friction_ratio: float
    scale_radius_m: float
    prepared_with_adhesion: bool = False

    @property
    def length_m(self) -> float:
        """Distance of the end walls."""
        return self.length_ratio * self.scale_radius_m

    @property
    def height_m(self) -> float:
        """Nominal height of the slope."""
        return self.height_ratio * self.scale_radius_m

    @property
    def thickness_m(self) -> float:
        """Period along y."""
        return self.thickness_ratio * self.scale_radius_m

    @property
    def crest_m(self) -> float:
        """Distance of the crest from the end wall behind it."""
        return CREST_RATIO * self.height_m

    @property
    def least_deg(self) -> float:
        """Flattest cut, whose toe is at the other end."""
        return math.degrees(math.atan2(self.height_m, self.length_m - self.crest_m))


@dataclass(frozen=True)
class CutSlope(Rich):
    """Results of the test.

    status: "done"; "column" if even a vertical cut stands; "flat" if the flattest cut falls. stands_deg, falls_deg: steepest cut
    that stood and flattest that fell, nan if none did. height_m: of the slope. moved_ratio: share of the grains that had moved, of
    these two cuts. before, after: grains of the flattest cut that fell (else of the steepest that stood), as cut and at its end.
    n_particles: grains of the settled bed. cuts (n, 2): angle and share that had moved, of every cut in order. The energies are
    those of the preparation.
    """

    status: str
    stands_deg: float
    falls_deg: float
    stood_moved_ratio: float
    fell_moved_ratio: float
    height_m: float
    solid_fraction: float
    before: Grains
    after: Grains
    cuts: np.ndarray
    n_particles: int
    n_steps: int
    simulated_time_s: float
    max_overlap_ratio: float
    energy_dissipated_j: float = math.nan
    energy_residual_ratio: float = math.nan

    @property
    def history(self) -> dict[str, np.ndarray]:
        """The cuts as columns."""
        return {"cut_angle_deg": self.cuts[:, 0], "moved_ratio": self.cuts[:, 1]}

    @property
    def slope_angle_deg(self) -> float:
        """Middle between the two cuts; nan unless the status is "done"."""
        return 0.5 * (self.stands_deg + self.falls_deg)

    @property
    def half_width_deg(self) -> float:
        """Half of their difference."""
        return 0.5 * (self.falls_deg - self.stands_deg)


def n_grains(soil: Soil, setup: Setup) -> int:
    """Number of grains that are dropped."""
    depth = setup.height_m + FLOOR_LAYER * soil.radius_m
    return round(FILL_FRACTION * setup.length_m * setup.thickness_m * depth / soil.grain_volume_m3)


def fall_time_s(setup: Setup, engine: Engine) -> float:
    """Time of a free fall over the height of the slope."""
    return math.sqrt(2.0 * setup.height_m / engine.gravity_m_s2)


def wall(name: str, x_m: float, setup: Setup) -> Box:
    """A smooth end wall, higher than the dropped grains."""
    return rectangle(name, (x_m, 0.0), (x_m, 1e3 * setup.height_m))


def build(soil: Soil, setup: Setup, engine: Engine, seed: int) -> Simulation:
    """Floor, end walls and dropped grains, at time 0."""
    walls = [floor(), wall("back", 0.0, setup), wall("front", setup.length_m, setup)]
    return dropped(soil, setup, engine, seed, walls, n_grains(soil, setup))


def start(soil: Soil, setup: Setup, engine: Engine, seed: int) -> State:
    """The test at its beginning: grains about to drop."""
    simulation = build(soil, setup, engine, seed)
    settle_time = SETTLE_FALL_TIMES * math.sqrt(2.0 * simulation.top_m / engine.gravity_m_s2)
    return State(simulation, "settle", steps_in(settle_time, simulation), {"max_overlap_ratio": 0.0})


def note_bed(state: State, soil: Soil, setup: Setup, engine: Engine) -> None:
    """Glue the lowest layer to the floor, and remember the settled bed with its contacts: every cut starts from it."""
    simulation, spheres = state.simulation, state.simulation.grains
    grains = soil.wholes(spheres)
    bottom = FLOOR_LAYER * soil.radius_m
    level = min(bottom + setup.height_m, float(np.quantile(grains.positions_m[:, 2], FULL)))
    simulation.glue(np.flatnonzero(spheres.positions_m[:, 2] < glue_reach_m(soil, spheres)), "floor")
    state.notes |= {
        "bed": packed(simulation),
        "bottom_m": bottom,
        "level_m": level,
        "solid_fraction": core_solid_fraction(grains, setup, level),
        "n_particles": len(grains),
        "n_steps": simulation.n_steps,
        "time_s": simulation.time_s,
        "stood": [],
        "fell": [],
        "cuts": [],
        **energy_balance(simulation, engine),
    }


def core_solid_fraction(grains: Grains, setup: Setup, level_m: float) -> float:
    """Solid fraction of the settled bed (`Soil.wholes`), away from floor, surface and end walls."""
    margin = CORE_MARGIN_RADII * float(grains.radii_m.mean())
    low, high = np.array([margin, CORE_MARGIN * level_m]), np.array([setup.length_m - margin, (1.0 - CORE_MARGIN) * level_m])
    places = grains.positions_m[:, [0, 2]]
    inside = ((places >= low) & (places < high)).all(axis=1)
    return 4.0 / 3.0 * math.pi * float((grains.radii_m[inside] ** 3).sum()) / (float(np.prod(high - low)) * setup.thickness_m)


def cut(state: State, soil: Soil, setup: Setup, engine: Engine, angle_deg: float) -> None:
    """Restore the settled bed and cut it at an angle; the slope is left to itself from now on."""
    notes = state.notes
    simulation = state.simulation = unpacked(np.asarray(notes["bed"]))
    for other in ("soil", "plate"):
        simulation.set_interaction("soil", other, soil.interaction(adhesion=simulation.adhesion))
    grains = simulation.grains
    x, _, z = soil.wholes(grains).positions_m.T
    run_m = (notes["level_m"] - notes["bottom_m"]) / math.tan(math.radians(angle_deg))
    down = np.clip((x - setup.crest_m) / run_m, 0.0, 1.0) if run_m > 1e-9 * setup.crest_m else (x > setup.crest_m).astype(float)
    surface = notes["level_m"] - down * (notes["level_m"] - notes["bottom_m"])
    simulation.remove_grains(np.flatnonzero((z > surface)[soil.owners(grains)]))
    simulation.remove_wall("front")
    notes["angle_deg"] = angle_deg
    state.note_grains("cut", simulation.grains)
    state.begin("cut", steps_in(STAND_FALL_TIMES * fall_time_s(setup, engine), simulation))


def moved_ratio(state: State, soil: Soil, setup: Setup) -> float:
    """Volume of the grains that have moved since the cut, over the solid volume of the wedge below 45 degrees."""
    before, now = (soil.wholes(grains) for grains in (state.noted_grains("cut"), state.simulation.grains))
    notes = state.notes
    step = now.positions_m - before.positions_m
    step[:, 1] -= setup.thickness_m * np.round(step[:, 1] / setup.thickness_m)
    far = np.linalg.norm(step, axis=1) > FALLEN_RADII * before.radii_m.mean()
    wedge_m3 = 0.5 * (notes["level_m"] - notes["bottom_m"]) ** 2 * setup.thickness_m * notes["solid_fraction"]
    return 4.0 / 3.0 * math.pi * float((before.radii_m[far] ** 3).sum()) / wedge_m3


def book(state: State, soil: Soil, setup: Setup) -> None:
    """Note how the cut ended."""
    notes, simulation, moved = state.notes, state.simulation, moved_ratio(state, soil, setup)
    angle, fallen = notes["angle_deg"], moved > FALLEN_SHARE
    if fallen or not notes["fell"]:
        state.note_grains("before", state.noted_grains("cut"))
        state.note_grains("after", simulation.grains)
    notes["fell" if fallen else "stood"] += [angle]
    notes["cuts"] += [[angle, moved]]
    for key, total in (("n_steps", simulation.n_steps), ("time_s", simulation.time_s)):
        notes[f"cut_{key}"] = notes.get(f"cut_{key}", 0) + total - notes[key]


def next_angle_deg(stood: list[float], fell: list[float], least_deg: float, tolerance_deg: float) -> float | None:
    """Angle of the next cut; None when the bracket is narrow enough and its ends were tried, too."""
    low, high = max(stood, default=least_deg), min(fell, default=VERTICAL_DEG)
    if high - low > tolerance_deg:
        return 0.5 * (low + high)
    if not stood and least_deg not in fell:
        return least_deg
    return VERTICAL_DEG if not fell and VERTICAL_DEG not in stood else None


def status_of(stood: list[float], fell: list[float]) -> str:
    """Status of a finished bisection."""
    if not stood:
        return "flat"
    return "done" if fell else "column"


def run(
    soil: Soil,
    setup: Setup,
    engine: Engine,
    seed: int,
    each: Callable[[Simulation, str], None] | None = None,
    *,
    state: State | None = None,
    keep: Callable[[State], None] | None = None,
) -> CutSlope:
    """Settle one bed and find the steepest cut that stands; or finish a test that was interrupted in a state.

    `each(simulation, stage)` is called every 500 steps, then `keep(state)`, which may save the state (or raise, to stop). Every cut
    has a simulation of its own. A run that goes on from a state ends as it would have without the interruption, bit for bit.

    Raises
    ------
    dem.SimulationError : the run blew up, or grains left the box.
    """
    state = start(soil, setup, engine, seed) if state is None else state

    look = looks(each, "leaked out of the slope's box")

    def over(current):
        waited = current.simulation.time_s - current.notes["time_s"] >= fall_time_s(setup, engine)
        at_rest = waited and current.simulation.is_static(STATIC_ENERGY_RATIO)
        return at_rest or moved_ratio(current, soil, setup) > FALLEN_SHARE

    notes = state.notes
    if state.stage == "settle":
        state.go_on(look(lambda current: current.simulation.is_static(SETTLED_ENERGY_RATIO)), keep)
        note_bed(state, soil, setup, engine)
        first = next_angle_deg([], [], setup.least_deg, setup.tolerance_deg)
        cut(state, soil, setup, engine, setup.least_deg if first is None else first)
    angle: float | None = notes["angle_deg"]
    while angle is not None:
        state.go_on(look(over), keep)
        book(state, soil, setup)
        angle = next_angle_deg(notes["stood"], notes["fell"], setup.least_deg, setup.tolerance_deg)
        if angle is not None:
            cut(state, soil, setup, engine, angle)
    return result(state)


def result(state: State) -> CutSlope:
    """The outcome of the cuts so far."""
    notes = state.notes
    moved, stands, falls = dict(notes["cuts"]), max(notes["stood"], default=math.nan), min(notes["fell"], default=math.nan)
    return CutSlope(
        status=status_of(notes["stood"], notes["fell"]),
        stands_deg=stands,
        falls_deg=falls,
        stood_moved_ratio=moved.get(stands, math.nan),
        fell_moved_ratio=moved.get(falls, math.nan),
        height_m=notes["level_m"] - notes["bottom_m"],
        before=state.noted_grains("before"),
        after=state.noted_grains("after"),
        cuts=np.array(notes["cuts"]),
        n_steps=notes["n_steps"] + notes["cut_n_steps"],
        simulated_time_s=notes["time_s"] + notes["cut_time_s"],
        **{name: notes[name] for name in ("solid_fraction", "n_particles", "max_overlap_ratio")},
        **{name: notes[name] for name in ("energy_dissipated_j", "energy_residual_ratio")},
    )
