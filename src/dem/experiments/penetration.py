"""A rigid tool pressed into a bed of soil at constant speed: the plate and the cone of terramechanics.

The bed is periodic, so a tool has images of itself one period away. Depths count downwards from the bed's level (see
`dem.experiments.soil_bed`); forces are those of the soil on the tool, upwards positive.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from dem import Body, Box, Grains, Mesh, Motion, Rich, Simulation, SimulationError, Wall, solids
from dem.experiments.checks import require
from dem.experiments.soil import Soil
from dem.experiments.soil_bed import TOOL_MATERIAL, SoilBed, warn
from dem.experiments.state import State, steps_in

#: Samples over the way, at most.
N_SAMPLES = 400
#: Diameter of a tool in mean grain diameters: refused below the first, warned of below the second.
DIAMETERS = (3.0, 10.0)
#: Least period over the diameter of a tool, and the one below which images are warned of.
PERIODS = (1.25, 2.5)
#: Grains between a tool and the floor, in mean diameters.
FLOOR_DIAMETERS = 4.0
#: Diameter of a cone's shaft over that of its base: 15.88 over 20.27 mm of the standard soil cone penetrometer (ASAE S313.3).
SHAFT_RATIO = 15.88 / 20.27
#: Height of a tool above what is pressed in, in mean grain diameters: no grain comes onto it.
FREEBOARD_DIAMETERS = 6.0


@dataclass(frozen=True, kw_only=True)
class PressTest(Rich):
    """depth_m: below the bed's level, at which the test ends; of a cone's base. static_friction: of grains on the tool.

    Grains roll on the tool as on each other, and do not stick to it.
    """

    depth_m: float
    speed_m_s: float
    static_friction: float = 0.5

    def __post_init__(self):
        for field in fields(self):
            value, least = getattr(self, field.name), "zero or positive" if field.name == "static_friction" else "positive"
            sound = 0.0 <= value < math.inf and (value > 0.0 or least != "positive")
            require(sound, f"{field.name} of the tool", value, f"a {least} number")


@dataclass(frozen=True, kw_only=True)
class Tool(Rich):
    """A shape whose lowest point is at z = 0 of space, its middle at x = y = 0; area_m2: to which the pressure refers.

    reference_m: height above the lowest point at which the depth is measured (the base of a cone).
    """

    name: str
    shape: Wall
    diameter_m: float
    area_m2: float
    reference_m: float = 0.0


@dataclass(frozen=True)
class Pressed(Rich):
    """Results of a test: history with the columns of `record`, grains at the end, counts. status: "done"."""

    status: str
    tool: str
    test: PressTest
    history: dict[str, np.ndarray]
    after: Grains
    diameter_m: float
    area_m2: float
    warnings: list[str]
    max_overlap_ratio: float
    n_particles: int
    n_steps: int
    simulated_time_s: float


def disc(diameter_m: float, test: PressTest, soil: Soil) -> Tool:
    """A round plate, thick enough that no grain comes onto it."""
    require(0.0 < diameter_m < math.inf, "diameter_m of the plate", diameter_m, "a positive number")
    height = test.depth_m + FREEBOARD_DIAMETERS * 2.0 * soil.radius_m
    sides = solids.sides_for(0.5 * diameter_m, soil.smallest_sphere_m)
    shape = solids.cylinder(0.5 * diameter_m, height, sides, source="plate")
    return Tool(name="plate", shape=raised(shape, 0.5 * height), diameter_m=diameter_m, area_m2=0.25 * math.pi * diameter_m**2)


def cone(base_area_m2: float, angle_deg: float, test: PressTest, soil: Soil) -> Tool:
    """A cone, tip down, under a thinner shaft; angle_deg: at the tip, between opposite flanks. Depths are those of its base."""
    require(0.0 < base_area_m2 < math.inf, "base_area_m2 of the cone", base_area_m2, "a positive number")
    require(10.0 <= angle_deg <= 150.0, "angle_deg of the cone", angle_deg, "from 10 to 150")
    radius = math.sqrt(base_area_m2 / math.pi)
    height, shaft = radius / math.tan(math.radians(0.5 * angle_deg)), SHAFT_RATIO * radius
    top = height + test.depth_m + FREEBOARD_DIAMETERS * 2.0 * soil.radius_m
    profile = [(0.0, 0.0), (radius, height), (shaft, height), (shaft, top), (0.0, top)]
    shape = solids.revolved(profile, solids.sides_for(radius, soil.smallest_sphere_m), source="cone")
    return Tool(name="cone", shape=shape, diameter_m=2.0 * radius, area_m2=base_area_m2, reference_m=height)


def raised(shape: Wall, height_m: float, x_m: float = 0.0, y_m: float = 0.0) -> Wall:
    """A box or a mesh, displaced."""
    step = np.array([x_m, y_m, height_m])
    if isinstance(shape, Mesh):
        return replace(shape, position_m=tuple((np.array(shape.position_m) + step).tolist()))
    if not isinstance(shape, Box):
        raise ValueError(f"shape of a tool is a {type(shape).__name__}; allowed: a mesh or a box.")
    low, high = (tuple((np.array(getattr(shape, name)) + step).tolist()) for name in ("low_m", "high_m"))
    return replace(shape, low_m=low, high_m=high)


def check(bed: SoilBed, soil: Soil, tool: Tool, test: PressTest) -> list[str]:
    """Warnings of a test that is coarse or near to its images.

    Raises ValueError, naming the size, if the grains are too large for the tool, or the tool or its depth for the bed.
    """
    d, (least, enough), of_tool, warnings = 2.0 * soil.radius_m, DIAMETERS, f"of the {tool.name}", []
    found = f"{tool.diameter_m:.4g} m, {tool.diameter_m / d:.3g} grain diameters"
    require(tool.diameter_m >= least * d * (1.0 - 1e-9), f"diameter {of_tool}", found, f"at least {least:g}: smaller grains")
    if tool.diameter_m < enough * d * (1.0 - 1e-9):
        warnings += [f"diameter {of_tool} is {found}; results depend on the grain size below {enough:g}"]
    period, (narrow, wide) = min(bed.setup.length_m, bed.setup.width_m), PERIODS
    allowed = f"at most {period / narrow:.4g} in this bed, whose images it would touch"
    require(tool.diameter_m <= period / narrow * (1.0 + 1e-9), f"diameter {of_tool}", tool.diameter_m, allowed)
    if tool.diameter_m > period / wide * (1.0 + 1e-9):
        warnings += [f"diameter {of_tool} is {tool.diameter_m:.4g} m; its images are felt above {period / wide:.4g}"]
    deepest = bed.level_m - tool.reference_m - FLOOR_DIAMETERS * d
    require(test.depth_m <= deepest * (1.0 + 1e-9), f"depth_m {of_tool}", test.depth_m, f"at most {deepest:.4g} in this bed")
    return warn(warnings)


def touching_height_m(grains: Grains, bed: SoilBed, tool: Tool, x_m: float, y_m: float) -> float:
    """Height of the highest grain under a tool of round or square outline."""
    period = np.array([bed.setup.length_m, bed.setup.width_m])
    apart = grains.positions_m[:, :2] - (x_m, y_m)
    apart -= period * np.round(apart / period)
    under = np.hypot(*apart.T) < 0.5 * math.sqrt(2.0) * tool.diameter_m + grains.radii_m
    return float((grains.positions_m[:, 2] + grains.radii_m)[under].max(initial=0.0))


def start(bed: SoilBed, soil: Soil, tool: Tool, test: PressTest, threads: int = 1) -> State:
    """The test at its beginning: a copy of the bed, and the tool just above its highest grain."""
    warnings, simulation = check(bed, soil, tool, test), bed.copy(threads)
    simulation.set_interaction("soil", TOOL_MATERIAL, soil.interaction(test.static_friction))
    x, y = 0.5 * bed.setup.length_m, 0.5 * bed.setup.width_m
    z = touching_height_m(simulation.grains, bed, tool, x, y) + 0.01 * soil.radius_m
    motion = Motion(velocity_m_s=(0.0, 0.0, -test.speed_m_s))
    simulation.add_wall(Body(name="tool", material=TOOL_MATERIAL, shape=raised(tool.shape, z, x, y), motion=motion))
    way = z + tool.reference_m - (bed.level_m - test.depth_m)
    steps = steps_in(way / test.speed_m_s, simulation)
    notes = {"warnings": warnings, "samples": [], "max_overlap_ratio": 0.0, "lowest_m": z, "every": math.ceil(steps / N_SAMPLES)}
    notes |= {"begun_s": simulation.time_s, "begun_step": simulation.n_steps}
    return State(simulation, "press", simulation.n_steps + steps, notes)


def record(state: State, bed: SoilBed, tool: Tool, test: PressTest) -> dict[str, float]:
    """One sample: the depth now, and the mean force since the last look."""
    simulation, notes = state.simulation, state.notes
    time = simulation.time_s - notes["begun_s"]
    force, overlap = simulation.mean_wall_forces_n["tool"], float(simulation.largest_overlap_ratio())
    notes["max_overlap_ratio"] = max(notes["max_overlap_ratio"], overlap)
    return {
        "time_s": time,
        "depth_m": bed.level_m - tool.reference_m - notes["lowest_m"] + test.speed_m_s * time,
        "force_n": float(force[2]),
        "pressure_pa": float(force[2]) / tool.area_m2,
        "kinetic_energy_j": simulation.kinetic_energy_j,
        "overlap_ratio": overlap,
    }


def press(
    bed: SoilBed,
    soil: Soil,
    tool: Tool,
    test: PressTest,
    each: Callable[[Simulation, str], None] | None = None,
    *,
    state: State | None = None,
    keep: Callable[[State], None] | None = None,
    threads: int = 1,
) -> Pressed:
    """Press a tool into a copy of a bed; or finish a test that was interrupted in a state, with the same bytes.

    `each(simulation, stage)` is called at every sample, then `keep(state)`, which may save the state (or raise, to stop).

    Raises
    ------
    ValueError : grains too large for the tool, or the tool or its depth for the bed (`check`).
    dem.SimulationError : the run blew up, or grains fell through the floor.
    """
    state = start(bed, soil, tool, test, threads) if state is None else state
    simulation, notes = state.simulation, state.notes

    def look(current: State) -> bool:
        notes["samples"] += [record(current, bed, tool, test)]
        if each is not None:
            each(simulation, current.stage)
        if simulation.n_left:
            raise SimulationError(f"{simulation.n_wholes_left} grains fell through the floor of the bed")
        return False

    state.go_on(look, keep, notes["every"])
    return Pressed(
        status="done",
        tool=tool.name,
        test=test,
        history={name: np.array([sample[name] for sample in notes["samples"]]) for name in notes["samples"][0]},
        after=simulation.grains,
        diameter_m=tool.diameter_m,
        area_m2=tool.area_m2,
        warnings=list(notes["warnings"]),
        max_overlap_ratio=notes["max_overlap_ratio"],
        n_particles=bed.n_particles,
        n_steps=simulation.n_steps - notes["begun_step"],
        simulated_time_s=simulation.time_s - notes["begun_s"],
    )


def press_plate(bed: SoilBed, soil: Soil, diameter_m: float, test: PressTest, *args, **options) -> Pressed:
    """Press a round plate; further arguments as in `press`."""
    return press(bed, soil, disc(diameter_m, test, soil), test, *args, **options)


def push_cone(bed: SoilBed, soil: Soil, base_area_m2: float, angle_deg: float, test: PressTest, *args, **options) -> Pressed:
    """Push a cone; further arguments as in `press`."""
    return press(bed, soil, cone(base_area_m2, angle_deg, test, soil), test, *args, **options)
