"""A bed of soil under a tool: dropped on a rough floor, periodic along x and y, settled once and copied for every test.

Wheels, plates and cones start from the same bed, which a file can hold (`save_bed`). The friction of the preparation steers its
density: grains that settle with a part of their friction pack as after tamping. Heights count from the bed's level, the mean height
of the highest grain in cells of two grain diameters.
"""

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from dem import Grains, Rich, Simulation, load_with_notes, packed, save, unpacked
from dem.experiments.bed import dropped
from dem.experiments.checks import require
from dem.experiments.soil import Engine, Soil
from dem.experiments.specimen import FILL_FRACTION, floor, glue_reach_m
from dem.experiments.state import State, looks, steps_in
from dem.experiments.surface import height_map, layer_solid_fraction

LOG = logging.getLogger(__name__)

#: The dropped grains lie at this kinetic energy (see `dem.Simulation.is_static`), at the latest after a number of free-fall times
#: of the loose column. Below it the bed mostly rings as an elastic layer, by micrometres.
SETTLED_ENERGY_RATIO, SETTLE_FALL_TIMES = 1e-4, 12.0
#: With the grains' own friction the bed is at rest at this kinetic energy.
REST_ENERGY_RATIO = 1e-5
#: Free-fall times of the bed's depth that it is given after its grains have their own friction, at least and at most.
REST_FALL_TIMES, LONGEST_REST = 1.0, 10.0
#: Random velocity of the dropped grains over sqrt(g d). Without it the layers in which they are made arrive one by one and
#: come to rest as layers: in three beds of 7441 grains of 5 mm, the solid fraction of slices of 6 mm had a standard deviation of
#: 0.017, that of the beds one of 0.006. With 0.45 these were 0.005 and 0.001, with 1.35 0.006 and 0.003.
STIRRED_RATIO = 0.5
#: Side of a cell of the height map in mean grain diameters.
CELL_DIAMETERS = 2.0
#: Shares of the level between which the solid fraction is measured, away from floor and surface.
CORE = (0.2, 0.8)
#: Material of tools: `dropped` makes it, and a bed without end walls has no other use for it.
TOOL_MATERIAL = "frame"
#: Least depth, and least sides, in mean grain diameters.
LEAST_DEPTH, LEAST_SIDE = 5.0, 8.0


@dataclass(frozen=True, kw_only=True)
class Setup(Rich):
    """Geometry and preparation.

    length_m, width_m: periods along x (the travel) and y. depth_m: nominal, at a solid fraction of 0.57.
    preparation_friction_ratio multiplies the grains' frictions while they settle: below 1 the bed is denser, above looser. Grains
    stick from the end of the preparation on, unless prepared_with_adhesion.
    """

    length_m: float
    width_m: float
    depth_m: float
    preparation_friction_ratio: float = 1.0
    prepared_with_adhesion: bool = False

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name.endswith("_m"):
                require(0.0 < value < math.inf, f"{field.name} of the bed", value, "a positive number")
        ratio = self.preparation_friction_ratio
        require(0.0 <= ratio < math.inf, "preparation_friction_ratio of the bed", ratio, "a number, zero or positive")

    @property
    def thickness_m(self) -> float:
        """Period along y."""
        return self.width_m

    @property
    def area_m2(self) -> float:
        """Area of the bed."""
        return self.length_m * self.width_m


@dataclass(frozen=True)
class SoilBed(Rich):
    """A settled bed.

    status: "done", or "not_settled" if grains still moved at the time limit. level_m: mean of heights_m, the map of the surface
    (see `dem.experiments.surface.height_map`). solid_fraction, bulk_density_kg_m3: between 0.2 and 0.8 of the level. glued (k,):
    numbers of the grains (of clumps, whole ones) that belong to the floor. simulation: the bed itself, which tests copy.
    """

    setup: Setup
    simulation: Simulation
    status: str
    level_m: float
    heights_m: np.ndarray
    solid_fraction: float
    bulk_density_kg_m3: float
    glued: np.ndarray
    n_particles: int
    max_overlap_ratio: float

    def copy(self, threads: int = 1) -> Simulation:
        """A copy of the simulation, for a test."""
        return unpacked(packed(self.simulation), threads)


def n_grains(soil: Soil, setup: Setup) -> int:
    """Number of grains that are dropped."""
    return round(FILL_FRACTION * setup.area_m2 * setup.depth_m / soil.grain_volume_m3)


def check(soil: Soil, setup: Setup, engine: Engine) -> None:
    """Raise ValueError, naming the size, if the bed is too small for its grains, or keeps an energy ledger, which no tool does."""
    d = 2.0 * soil.radius_m
    for name, least in (("length_m", LEAST_SIDE), ("width_m", LEAST_SIDE), ("depth_m", LEAST_DEPTH)):
        size = getattr(setup, name)
        found = f"{size:.4g} m, {size / d:.3g} grain diameters"
        require(size >= least * d * (1.0 - 1e-9), f"{name} of the bed", found, f"at least {least:g} grain diameters")
    require(not engine.energy_ledger, "energy_ledger", True, "False with beds for tools, whose turning it does not book")


def build(soil: Soil, setup: Setup, engine: Engine, seed: int) -> Simulation:
    """Floor and dropped grains, at time 0."""
    check(soil, setup, engine)
    stirred = STIRRED_RATIO * math.sqrt(2.0 * soil.radius_m * engine.gravity_m_s2)
    return dropped(soil, setup, engine, seed, [floor()], n_grains(soil, setup), endless=True, velocity_sd_m_s=stirred)


def start(soil: Soil, setup: Setup, engine: Engine, seed: int) -> State:
    """The preparation at its beginning: grains about to drop."""
    simulation = build(soil, setup, engine, seed)
    settle_time = SETTLE_FALL_TIMES * math.sqrt(2.0 * simulation.top_m / engine.gravity_m_s2)
    return State(simulation, "settle", steps_in(settle_time, simulation), {"max_overlap_ratio": 0.0})


def release(state: State, soil: Soil, setup: Setup, engine: Engine) -> None:
    """Glue the lowest layer to the floor and give the grains their own friction and adhesion; then the bed rests."""
    simulation, spheres = state.simulation, state.simulation.grains
    reached = spheres.positions_m[:, 2] < glue_reach_m(soil, spheres)
    simulation.glue(np.flatnonzero(reached), "floor")
    for other in ("soil", "plate"):
        simulation.set_interaction("soil", other, soil.interaction(adhesion=simulation.adhesion))
    fall_s = math.sqrt(2.0 * setup.depth_m / engine.gravity_m_s2)
    state.notes |= {"released_s": simulation.time_s, "rest_s": REST_FALL_TIMES * fall_s}
    state.notes["glued"] = np.unique(soil.owners(spheres)[reached])
    state.begin("rest", steps_in(LONGEST_REST * fall_s, simulation))


def surface(grains: Grains, soil: Soil, setup: Setup) -> np.ndarray:
    """Map of the surface's height in m; grains : as `dem.Simulation.grains` gives them."""
    cell = CELL_DIAMETERS * 2.0 * soil.radius_m
    return height_map(grains.positions_m, grains.radii_m, setup.length_m, setup.width_m, cell)


def measured(state: State, soil: Soil, setup: Setup, settled: bool) -> SoilBed:
    """The bed at the end of its preparation."""
    grains = state.simulation.grains
    wholes, heights = soil.wholes(grains), surface(grains, soil, setup)
    level = float(np.nanmean(heights))
    low, high = (share * level for share in CORE)
    fraction = layer_solid_fraction(wholes.positions_m, wholes.radii_m, setup.area_m2, low, high)
    return SoilBed(
        setup=setup,
        simulation=state.simulation,
        status="done" if settled else "not_settled",
        level_m=level,
        heights_m=heights,
        solid_fraction=fraction,
        bulk_density_kg_m3=fraction * soil.density_kg_m3,
        glued=np.asarray(state.notes["glued"]),
        n_particles=len(wholes),
        max_overlap_ratio=state.notes["max_overlap_ratio"],
    )


def prepare(
    soil: Soil,
    setup: Setup,
    engine: Engine,
    seed: int,
    each: Callable[[Simulation, str], None] | None = None,
    *,
    state: State | None = None,
    keep: Callable[[State], None] | None = None,
) -> SoilBed:
    """Drop and settle a bed; or finish a preparation that was interrupted in a state, with the same bytes.

    `each(simulation, stage)` is called every 500 steps, then `keep(state)`, which may save the state (or raise, to stop).

    Raises
    ------
    ValueError : the bed is too small for its grains (`check`).
    dem.SimulationError : the run blew up, or grains fell through the floor.
    """
    state = start(soil, setup, engine, seed) if state is None else state

    def ended(current: State) -> bool:
        simulation, notes = current.simulation, current.notes
        if current.stage == "settle":
            return simulation.is_static(SETTLED_ENERGY_RATIO)
        return simulation.time_s - notes["released_s"] >= notes["rest_s"] and simulation.is_static(REST_ENERGY_RATIO)

    look = looks(each, "fell through the floor of the bed")(ended)
    if state.stage == "settle":
        state.go_on(look, keep)
        release(state, soil, setup, engine)
    settled = state.go_on(look, keep)
    return measured(state, soil, setup, settled)


def save_bed(bed: SoilBed, path: str | Path) -> None:
    """Write a bed to a file (`dem.save`), for `load_bed`."""
    values = {field.name: getattr(bed, field.name) for field in fields(bed) if field.name != "simulation"}
    setup = {field.name: getattr(bed.setup, field.name) for field in fields(bed.setup)}
    save(bed.simulation, path, values | {"setup": setup})


def load_bed(path: str | Path) -> SoilBed:
    """The bed of a file of `save_bed`.

    Raises
    ------
    dem.CheckpointError : the file is damaged, or was written by other source code.
    ValueError : it is the checkpoint of another simulation.
    """
    simulation, notes = load_with_notes(path)
    names = {field.name for field in fields(SoilBed)} - {"simulation"}
    require(names <= set(notes), f"content of {path}", sorted(notes), "a bed of `save_bed`")
    values = {name: notes[name] for name in names} | {"setup": Setup(**notes["setup"])}
    return SoilBed(simulation=simulation, **values)


def warn(warnings: list[str]) -> list[str]:
    """Log warnings about a test that is allowed but coarse; returns them."""
    for warning in warnings:
        LOG.warning(warning)
    return warnings
