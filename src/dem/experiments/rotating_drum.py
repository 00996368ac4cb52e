"""Rotating drum: soil in a cylinder with a horizontal axis that turns, at one rate after another; its surface stands at an angle.

The drum is a periodic slice along its axis (y), without end plates: their friction carries the soil next to them and steepens its
surface. Its shell is lined with grains glued to it, as a laboratory lines a drum with sandpaper: in a smooth one the filling slips
as a whole, and its angle tells of the shell. Grains are poured in, in several goes; at rest the drum begins to turn so that its
lowest point moves to +x and the surface rises to +x.

The height of the surface along x is noted at every look, as a camera would see it through a glass front; `dem.measure.drum` reads
angles from it. Its state is told by the Froude number Fr = omega^2 R / g: single avalanches at the lowest, then a steady flow along
a plane surface (about 1e-4 to 1e-2), which bends at higher ones (Mellmann 2001, Powder Technol. 118, 251).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from dem import Body, Grains, Rich, Simulation, SimulationError, solids
from dem.experiments.soil import Engine, Soil
from dem.experiments.state import State, looks, steps_in

#: The filling is at rest at this kinetic energy (see `dem.Simulation.is_static`), at the latest after a number of fall times.
SETTLED_ENERGY_RATIO, SETTLE_FALL_TIMES = 1e-5, 40.0
#: Solid fraction of poured grains, to choose their number.
FILL_FRACTION = 0.57
#: Spacing of the grains that are poured in, in diameters of the largest; random displacement and clearance in its radii.
SPACING, JITTER, CLEARANCE = 1.05, 0.02, 1.05
#: Gap between the lining and the shell that carries it, in mean radii.
SHELL_GAP = 0.05
#: Looks in the time sqrt(R / g), in which grains fall over half a radius of the drum.
LOOKS = 4
#: Width of the cells, across and along the drum, whose highest grain is the surface, in mean radii.
CELL_RADII = 2.0
#: Least sizes in mean grain diameters: the drum's diameter, and thickness of the slice.
LEAST_ACROSS, LEAST_THICKNESS = 20.0, 2.5
#: Allowed share of the drum's volume that is filled: its surface must be wider than deep, and below the axis for the pouring.
FILLS = (0.15, 0.5)
#: Above this Froude number grains are thrown (cataracting), and there is no surface.
LARGEST_FROUDE = 0.2
#: Fewest grains of which a surface can be told.
LEAST_GRAINS = 400


@dataclass(frozen=True, kw_only=True)
class Setup(Rich):
    """Geometry and protocol; ratios are over scale_radius_m.

    diameter_ratio: of the drum, to the centres of the grains that line it. thickness_ratio: of the slice along the axis, its period
    (y). fill_ratio: share of the drum's volume that the soil takes. froude_number: omega^2 R / g; further_froude_numbers are
    tried, too, all from the lowest to the highest. turns: number of turns at each.
    """

    diameter_ratio: float
    thickness_ratio: float
    fill_ratio: float
    froude_number: float
    turns: float
    scale_radius_m: float
    further_froude_numbers: tuple[float, ...] = ()

    def __post_init__(self):
        object.__setattr__(self, "further_froude_numbers", tuple(self.further_froude_numbers))
        for name in ("diameter_ratio", "thickness_ratio", "turns", "scale_radius_m"):
            value = getattr(self, name)
            require(0.0 < value < math.inf, name, value, "a positive number")
        low, high = FILLS
        require(low <= self.fill_ratio <= high, "fill_ratio", self.fill_ratio, f"from {low:g} to {high:g}")
        for value in self.froude_numbers:
            require(0.0 < value <= LARGEST_FROUDE, "froude_number", value, f"above 0, at most {LARGEST_FROUDE:g}")

    @property
    def radius_m(self) -> float:
        """Radius of the drum."""
        return 0.5 * self.diameter_ratio * self.scale_radius_m

    @property
    def thickness_m(self) -> float:
        """Length of the drum that is simulated, the period along y."""
        return self.thickness_ratio * self.scale_radius_m

    @property
    def froude_numbers(self) -> list[float]:
        """All Froude numbers, ascending."""
        return sorted({self.froude_number, *self.further_froude_numbers})

    @property
    def depth_m(self) -> float:
        """Depth of the filling at rest below the middle of its surface: that of a segment of a circle."""
        half = scipy.optimize.brentq(lambda a: a - math.sin(a) * math.cos(a) - math.pi * self.fill_ratio, 0.0, math.pi)
        return self.radius_m * (1.0 - math.cos(half))


@dataclass(frozen=True)
class RotatingDrum(Rich):
    """Results of the test.

    before, after: grains at rest before the drum turns, and at the end of the turns at setup.froude_number, without the lining.
    time_s, froude_numbers, turns (n,): of every look, since the drum began to turn, the rate, and the turns at this rate.
    x_ratio (m,): distances from the axis, heights_ratio (n, m): heights of the surface above it, both over the drum's radius; nan
    where there is no soil. Of clumps, before and after list the spheres, and n_particles counts clumps.
    """

    status: str
    setup: Setup
    before: Grains
    after: Grains
    time_s: np.ndarray
    froude_numbers: np.ndarray
    turns: np.ndarray
    x_ratio: np.ndarray
    heights_ratio: np.ndarray
    n_particles: int
    n_lining: int
    n_steps: int
    simulated_time_s: float
    max_overlap_ratio: float

    @property
    def history(self) -> dict[str, np.ndarray]:
        """The surface at every look as columns, a row for each of its places."""
        n, m = self.heights_ratio.shape
        looks = {"time_s": self.time_s, "froude_number": self.froude_numbers, "turns": self.turns}
        columns = {name: np.repeat(values, m) for name, values in looks.items()}
        return columns | {"x_ratio": np.tile(self.x_ratio, n), "height_ratio": self.heights_ratio.ravel()}


def require(condition: bool, name: str, value, allowed: str) -> None:
    """Raise ValueError naming a size, its value and what is allowed, unless the condition holds."""
    if not condition:
        raise ValueError(f"{name} is {value}; allowed: {allowed}.")


def n_grains(soil: Soil, setup: Setup) -> int:
    """Number of grains that fill the drum to its ratio."""
    return round(FILL_FRACTION * setup.fill_ratio * math.pi * setup.radius_m**2 * setup.thickness_m / soil.grain_volume_m3)


def check(soil: Soil, setup: Setup) -> None:
    """Raise ValueError, naming the size, if the grains are too large for the drum."""
    d = 2.0 * soil.radius_m
    for name, size_m, least, why in (
        ("diameter of the drum", 2.0 * setup.radius_m, LEAST_ACROSS, "a larger drum, or smaller grains"),
        ("thickness of the slice", setup.thickness_m, LEAST_THICKNESS, "a thicker slice"),
    ):
        sizes = f"{1e3 * size_m:.3g} mm, {size_m / d:.3g} grain diameters"
        require(size_m >= least * d * (1.0 - 1e-9), name, sizes, f"at least {least:g}: {why}")
    n = n_grains(soil, setup)
    require(n >= LEAST_GRAINS, "number of grains in the drum", n, f"at least {LEAST_GRAINS}: a larger drum, or a thicker slice")


def fall_time_s(setup: Setup, engine: Engine) -> float:
    """Time of a free fall across the drum."""
    return math.sqrt(4.0 * setup.radius_m / engine.gravity_m_s2)


def rate_rad_s(froude_number: float, setup: Setup, engine: Engine) -> float:
    """Rate of turn of a Froude number."""
    return math.sqrt(froude_number * engine.gravity_m_s2 / setup.radius_m)


def lining(soil: Soil, setup: Setup) -> np.ndarray:
    """Centres (n, 3) of the grains of mean radius that line the shell, rows along the axis, every second displaced by half."""
    around = int(math.pi / math.asin(soil.radius_m / setup.radius_m) - 1e-9)
    along = int(setup.thickness_m / (2.0 * soil.radius_m) + 1e-9)
    angle, row = np.meshgrid(np.arange(around), np.arange(along), indexing="ij")
    y = (row + 0.25 + 0.5 * (angle % 2)) % along * setup.thickness_m / along
    turned = 2.0 * np.pi / around * angle
    return np.stack([setup.radius_m * np.cos(turned), y, setup.radius_m * np.sin(turned)], axis=-1).reshape(-1, 3)


def shell(soil: Soil, setup: Setup) -> Body:
    """The shell behind the lining, longer than the period on both sides."""
    radius_m = setup.radius_m + (1.0 + SHELL_GAP) * soil.radius_m
    sides = solids.sides_for(radius_m, soil.radius_m)
    tube = solids.tube(
        radius_m / math.cos(math.pi / sides), 3.0 * setup.thickness_m, sides,
        position_m=(0.0, 0.5 * setup.thickness_m, 0.0), orientation=(math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0),
    )  # fmt: skip
    return Body(name="drum", material="soil", shape=tube)


def build(soil: Soil, setup: Setup, engine: Engine) -> Simulation:
    """Empty drum with its lining, at time 0."""
    check(soil, setup)
    options = engine.options(soil)
    simulation = Simulation(
        materials={"soil": soil.softened(engine.stiffness_reduction)},
        interactions={("soil", "soil"): soil.interaction(adhesion=options["adhesion"])},
        walls=[shell(soil, setup)],
        period_m=(0.0, setup.thickness_m, 0.0),
        smallest_radius_m=soil.smallest_sphere_m,
        floor_m=-2.0 * setup.radius_m,
        **options,
    )
    places = lining(soil, setup)
    simulation.add_grains(places, soil.radius_m, "soil")
    simulation.glue(np.arange(len(places)), "drum")
    return simulation


def start(soil: Soil, setup: Setup, engine: Engine, seed: int) -> State:
    """The test at its beginning: the first grains about to drop."""
    simulation = build(soil, setup, engine)
    notes = {"max_overlap_ratio": 0.0, "n_lining": simulation.n_grains, "n_poured": 0, "next_s": 0.0}
    state = State(simulation, "fill", steps_in(SETTLE_FALL_TIMES * fall_time_s(setup, engine), simulation), notes)
    pour(state, soil, setup, engine, seed)
    return state


def soil_of(state: State) -> Grains:
    """The grains without the lining."""
    grains, n = state.simulation.grains, state.notes["n_lining"]
    return Grains(**{key: values[n:] for key, values in vars(grains).items()})


def free_places(soil: Soil, setup: Setup, above_m: float, rng: np.random.Generator) -> np.ndarray:
    """Places (n, 3) in the drum above a height for grains that do not touch, from the lowest to the highest."""
    reach_m = soil.sizes.largest_m * soil.bounding_ratio
    spacing = 2.0 * SPACING * reach_m
    inner = setup.radius_m - soil.radius_m - CLEARANCE * reach_m
    half, along = int(inner / spacing), int(setup.thickness_m / spacing)
    levels, across, rows = np.meshgrid(np.arange(2 * half + 1), np.arange(-half, half + 1), np.arange(along), indexing="ij")
    places = np.stack(
        [spacing * across, (rows + 0.5) * setup.thickness_m / max(along, 1), spacing * levels - inner], axis=-1
    ).reshape(-1, 3)
    free = (np.hypot(places[:, 0], places[:, 2]) <= inner) & (places[:, 2] - CLEARANCE * reach_m > above_m)
    places = places[free]
    return places + rng.uniform(-JITTER * reach_m, JITTER * reach_m, places.shape)


def pour(state: State, soil: Soil, setup: Setup, engine: Engine, seed: int) -> None:
    """Let as many grains as have room above the others drop into the drum."""
    simulation, notes, poured = state.simulation, state.notes, soil_of(state)
    n, done = n_grains(soil, setup), notes["n_poured"]
    top_m = float((poured.positions_m[:, 2] + poured.radii_m).max(initial=-math.inf))
    rng = np.random.default_rng((seed, done))
    places = free_places(soil, setup, top_m, rng)[: n - done]
    radii = soil.sizes.draw(n, np.random.default_rng(seed))[done : done + len(places)]
    if len(places):
        if soil.shape is None:
            simulation.add_grains(places, radii, "soil")
        else:
            kinds = soil.kinds(n, seed)[done : done + len(places)]
            turns = rng.standard_normal((len(places), 4))
            simulation.add_clumps(soil.shape, places, radii, "soil", kinds=kinds, orientations=turns)
    notes |= {"n_poured": done + len(places), "next_s": simulation.time_s + fall_time_s(setup, engine)}


def is_filled(state: State, soil: Soil, setup: Setup, engine: Engine, seed: int) -> bool:
    """True if all grains are in the drum and at rest; pours more in when the last ones have dropped."""
    notes, simulation = state.notes, state.simulation
    if simulation.time_s < notes["next_s"]:
        return False
    if notes["n_poured"] == n_grains(soil, setup):
        return simulation.is_static(SETTLED_ENERGY_RATIO)
    pour(state, soil, setup, engine, seed)
    return False


def turn(state: State, setup: Setup, engine: Engine, number: int) -> None:
    """Turn the drum from now on at one of the rates."""
    rate = rate_rad_s(setup.froude_numbers[number], setup, engine)
    state.simulation.turn_wall("drum", (0.0, -rate, 0.0))
    state.notes |= {"number": number, "begun_s": state.simulation.time_s, "rate_rad_s": rate}
    state.begin("turn", steps_in(setup.turns * 2.0 * math.pi / rate, state.simulation))


def surface(grains: Grains, soil: Soil, setup: Setup) -> np.ndarray:
    """Height (m,) of the surface above the axis over the drum's radius: median along y of the highest grains of the cells.

    The median leaves out single grains that fly above it. Nan where half of the cells or more are empty.
    """
    cell_m = CELL_RADII * soil.radius_m
    across, along = len(places_across(soil, setup)), max(1, int(setup.thickness_m / cell_m))
    x, y, z = grains.positions_m.T
    column = np.clip((0.5 * (x / setup.radius_m + 1.0) * across).astype(int), 0, across - 1)
    row = np.clip((y / setup.thickness_m % 1.0 * along).astype(int), 0, along - 1)
    tops = np.full((across, along), -np.inf)
    np.maximum.at(tops, (column, row), z + grains.radii_m)
    heights = np.median(tops, axis=1) / setup.radius_m
    return np.where(np.isfinite(heights), heights, np.nan)


def places_across(soil: Soil, setup: Setup) -> np.ndarray:
    """Middles (m,) of the surface's cells across the drum, over its radius."""
    m = int(2.0 * setup.radius_m / (CELL_RADII * soil.radius_m))
    return (np.arange(m) + 0.5) * 2.0 / m - 1.0


def note_surface(state: State, soil: Soil, setup: Setup) -> None:
    """Note time, rate, turns at this rate, and the surface."""
    notes, now = state.notes, state.simulation.time_s
    turns = (now - notes["begun_s"]) * notes["rate_rad_s"] / (2.0 * math.pi)
    look = [now - notes["first_s"], setup.froude_numbers[notes["number"]], turns]
    notes["looks"] = np.vstack([np.asarray(notes["looks"]), look])
    notes["heights"] = np.vstack([np.asarray(notes["heights"]), surface(soil_of(state), soil, setup)])


def run(
    soil: Soil,
    setup: Setup,
    engine: Engine,
    seed: int,
    each: Callable[[Simulation, str], None] | None = None,
    *,
    state: State | None = None,
    keep: Callable[[State], None] | None = None,
) -> RotatingDrum:
    """Fill one drum and turn it at all rates; or finish a test that was interrupted in a state.

    `each(simulation, stage)` is called at every look, then `keep(state)`, which may save the state (or raise, to stop). A run that
    goes on from a state ends as it would have without the interruption, bit for bit.

    Raises
    ------
    ValueError : the grains are too large for the drum (`check`); engine.energy_ledger, which does not book bodies that turn.
    dem.SimulationError : the run blew up, grains left the drum, or it could not be filled.
    """
    state = start(soil, setup, engine, seed) if state is None else state
    simulation, notes = state.simulation, state.notes

    look = looks(each, "leaked out of the drum")

    def noted(current):
        note_surface(current, soil, setup)
        return False

    if state.stage == "fill":
        state.go_on(look(lambda current: is_filled(current, soil, setup, engine, seed)), keep)
        n, poured = n_grains(soil, setup), notes["n_poured"]
        if poured < n:
            raise SimulationError(f"{n - poured} of {n} grains found no room in the drum in {simulation.time_s:.3g} s")
        state.note_grains("before", soil_of(state))
        across = len(places_across(soil, setup))
        notes |= {"first_s": simulation.time_s, "looks": np.zeros((0, 3)), "heights": np.zeros((0, across))}
        turn(state, setup, engine, 0)
    every = max(1, steps_in(math.sqrt(setup.radius_m / engine.gravity_m_s2) / LOOKS, simulation))
    for number in range(notes["number"], len(setup.froude_numbers)):
        if number > notes["number"]:
            turn(state, setup, engine, number)
        state.go_on(look(noted), keep, every)
        if setup.froude_numbers[number] == setup.froude_number:
            state.note_grains("after", soil_of(state))
    return result(state, soil, setup)


def result(state: State, soil: Soil, setup: Setup) -> RotatingDrum:
    """The outcome at the end of the last rate."""
    notes, series = state.notes, np.asarray(state.notes["looks"])
    return RotatingDrum(
        status="done",
        setup=setup,
        before=state.noted_grains("before"),
        after=state.noted_grains("after"),
        time_s=series[:, 0],
        froude_numbers=series[:, 1],
        turns=series[:, 2],
        x_ratio=places_across(soil, setup),
        heights_ratio=np.asarray(notes["heights"]),
        n_particles=n_grains(soil, setup),
        n_lining=notes["n_lining"],
        n_steps=state.simulation.n_steps,
        simulated_time_s=state.simulation.time_s,
        max_overlap_ratio=notes["max_overlap_ratio"],
    )
