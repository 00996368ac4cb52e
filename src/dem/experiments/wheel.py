"""Single wheel on a bed of soil: lowered under its load, then driven at a slip, a rim speed, or against a drawbar load.

The wheel comes down with a damper that lets it fall no faster than a fraction of sqrt(g R), so that it does not dig itself in; the
damper is taken away when the soil carries the load, and the wheel travels with its vertical axis free. The bed is periodic.

Signs: x forwards, z up. Forces are those of the soil on the wheel: the drawbar pull is positive where the wheel could pull. The
torque is the motor's about the axle, positive where it drives the wheel forwards. Slip s = 1 - v / (w R) of a driven wheel
(w R >= v), w R / v - 1 of a skidding one: -1 locked, 0 rolling, 1 spinning on the spot. R is the rim's radius, without grousers.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dem import Body, Drive, Grains, Motion, Rich, Simulation, SimulationError
from dem.experiments.balance import Content, content, momentum_residual
from dem.experiments.soil import Soil
from dem.experiments.soil_bed import TOOL_MATERIAL, SoilBed, warn
from dem.experiments.state import State, steps_in
from dem.experiments.wheel_setup import WheelShape, WheelTest, check, warnings_of

#: Speed limit of the lowered wheel over sqrt(g R): 60 mm/s for a wheel of 58 mm on Earth.
LOWERING_RATIO = 0.08
#: The damper is taken away at this fraction of that speed, when the soil carries the rest of the load; at the latest after the time
#: in which the wheel falls by LOWERING_RADII.
CARRIED_RATIO, LOWERING_RADII = 0.1, 4.0
#: Samples of the travel, at most.
N_SAMPLES = 400
#: Moments of the travel at which the grains are noted, as shares of it; between the last two the flow of the grains is measured.
MOMENTS = {"middle": 0.5, "flow_begins": 0.79, "flow_ends": 0.81}
#: Share of the travel from which on the contacts along the rim are noted.
RIM_FROM = 0.5
#: The test ends if the wheel comes nearer to the floor than this, in mean grain diameters.
FLOOR_DIAMETERS = 4.0


@dataclass(frozen=True)
class WheelRun(Rich):
    """Results of a test.

    status: "done"; "not_lowered" if the soil did not carry the wheel in time; "bottomed" if it came too near to the floor.
    history: columns of `record`; the time is 0 at the beginning of the travel, negative while the wheel is lowered. moments: grains
    at the beginning and at the end of the travel ("lowered", "end"), and at MOMENTS; axles (3,) and times_s: the axle and the time
    then. rim: contacts with the wheel at every sample of the second half of the travel, one after the other: `sample` (k,), number
    of the row in the history; `arms_m` (k, 3), from the axle; `forces_n`, `torques_n_m` (k, 3), on the wheel, about the axle.
    momentum_residual_ratio: residual of the momentum balance over load times duration. work_j: done by the motor, by what holds the
    axle along x ("axle"), by the load, and to give the wheel its speed ("start"). dissipated_j: their sum less the change of
    kinetic and potential energy; what the contacts' springs hold counts as dissipated.
    """

    status: str
    shape: WheelShape
    test: WheelTest
    history: dict[str, np.ndarray]
    moments: dict[str, Grains]
    axles: dict[str, np.ndarray]
    times_s: dict[str, float]
    rim: dict[str, np.ndarray]
    warnings: list[str]
    momentum_residual_ratio: float
    work_j: dict[str, float]
    dissipated_j: float
    max_overlap_ratio: float
    n_particles: int
    n_steps: int
    simulated_time_s: float


def wheel_mass_kg(test: WheelTest, simulation: Simulation) -> float:
    """Inertia of the wheel."""
    return test.load_n / -simulation.gravity_m_s2[2] if test.mass_kg is None else test.mass_kg


def lowering_speed_m_s(shape: WheelShape, simulation: Simulation) -> float:
    """Largest speed of the wheel while it is lowered."""
    return LOWERING_RATIO * math.sqrt(-simulation.gravity_m_s2[2] * shape.radius_m)


def touching_height_m(grains: Grains, bed: SoilBed, shape: WheelShape, x_m: float, y_m: float) -> float:
    """Height of the axle at which the wheel's outer cylinder first touches a grain."""
    period = np.array([bed.setup.length_m, bed.setup.width_m])
    apart = grains.positions_m[:, :2] - (x_m, y_m)
    apart -= period * np.round(apart / period)
    reach = shape.outer_radius_m + grains.radii_m
    under = (np.abs(apart[:, 0]) < reach) & (np.abs(apart[:, 1]) < 0.5 * shape.width_m + grains.radii_m)
    heights = grains.positions_m[:, 2] + np.sqrt(np.maximum(reach**2 - apart[:, 0] ** 2, 0.0))
    return float(heights[under].max(initial=shape.outer_radius_m))


def start(bed: SoilBed, soil: Soil, shape: WheelShape, test: WheelTest, threads: int = 1) -> State:
    """The test at its beginning: a copy of the bed, and the wheel above it, about to be lowered."""
    check(bed, soil, shape, test)
    simulation = bed.copy(threads)
    contact = soil.interaction(test.wheel_static_friction, test.wheel_rolling_friction)
    simulation.set_interaction("soil", TOOL_MATERIAL, contact)
    x, y = 0.5 * (bed.setup.length_m - test.travel_ratio * shape.radius_m), 0.5 * bed.setup.width_m
    z = touching_height_m(simulation.grains, bed, shape, x, y) + 0.01 * soil.radius_m
    slowest = lowering_speed_m_s(shape, simulation)
    drive = load_drive(test, simulation, damping_kg_s=test.load_n / slowest)
    n_soil = simulation.n_grains
    add_wheel(simulation, soil, shape, drive, (x, y, z))
    limit = steps_in(LOWERING_RADII * shape.radius_m / slowest, simulation)
    state = State(simulation, "lower", simulation.n_steps + limit)
    state.notes |= {
        "samples": [],
        "max_overlap_ratio": 0.0,
        "begun_s": simulation.time_s,
        "begun_step": simulation.n_steps,
        "booked_step": simulation.n_steps,
        "axle": [x, y, z],
        "n_soil": n_soil,
        "wheel_impulse": [0.0, 0.0, 0.0],
        "floor_impulse": [0.0, 0.0, 0.0],
        "damper_impulse": 0.0,
        "work_j": {"motor": 0.0, "axle": 0.0, "load": 0.0},
        "before": contents_of(content(simulation, soil, carried(bed, simulation, n_soil))),
    }
    return state


def add_wheel(simulation: Simulation, soil: Soil, shape: WheelShape, drive: Drive, axle_m: tuple[float, float, float]) -> None:
    """Add the wheel, with grains glued to its rim if it is sandpaper."""
    lining = 2.0 * soil.radius_m if shape.rim == "sandpaper" else 0.0
    surface, n_soil = shape.surface(soil.smallest_sphere_m, axle_m, lining), simulation.n_grains
    simulation.add_wall(Body(name="wheel", material=TOOL_MATERIAL, shape=surface, motion=Motion(drives=(drive,))))
    if lining:
        simulation.add_grains(shape.lining(soil.radius_m) + axle_m, soil.radius_m, "soil")
        simulation.glue(np.arange(n_soil, simulation.n_grains), "wheel")


def carried(bed: SoilBed, simulation: Simulation, n_soil: int) -> np.ndarray:
    """Numbers of the grains (of clumps, whole ones) that belong to floor or wheel; n_soil : number of spheres of the soil."""
    return np.concatenate([bed.glued, np.arange(n_soil, simulation.n_grains)])


def contents_of(values: Content) -> dict:
    """A content as plain values."""
    return values._asdict() | {"momentum": values.momentum.tolist()}


def load_drive(test: WheelTest, simulation: Simulation, damping_kg_s: float = 0.0) -> Drive:
    """The load on the axle."""
    mass = wheel_mass_kg(test, simulation)
    return Drive(axis=2, applied_force_n=-test.load_n, mass_kg=mass, damping_kg_s=damping_kg_s)


def record(state: State, bed: SoilBed, shape: WheelShape, test: WheelTest) -> dict[str, float]:
    """Book what acted since the last look, and return a sample: forces are means over that time."""
    simulation, notes = state.simulation, state.notes
    duration = (simulation.n_steps - notes["booked_step"]) * simulation.time_step_s
    now, last = simulation.wall("wheel"), np.asarray(notes["axle"])
    axle, rate = np.asarray(now.pivot), now.angular_velocity_rad_s[1]
    force, floor = simulation.mean_wall_forces_n["wheel"], simulation.mean_wall_forces_n["floor"]
    torque = -float(simulation.mean_wall_torques_n_m["wheel"][1])
    step = axle - last
    notes["wheel_impulse"] = (np.asarray(notes["wheel_impulse"]) + force * duration).tolist()
    notes["floor_impulse"] = (np.asarray(notes["floor_impulse"]) + floor * duration).tolist()
    if state.stage == "lower":
        notes["damper_impulse"] -= float(test.load_n / lowering_speed_m_s(shape, simulation) * step[2])
    along = -test.drawbar_load_n if test.held == "free" and state.stage == "travel" else -float(force[0])
    for name, work in (("motor", torque * rate * duration), ("axle", along * step[0]), ("load", -test.load_n * step[2])):
        notes["work_j"][name] += float(work)
    notes["axle"], notes["booked_step"] = axle.tolist(), simulation.n_steps
    overlap = float(simulation.largest_overlap_ratio())
    notes["max_overlap_ratio"] = max(notes["max_overlap_ratio"], overlap)
    return {
        "time_s": simulation.time_s - notes["begun_s"],
        "x_m": float(axle[0]),
        "sinkage_m": float(bed.level_m - axle[2] + shape.radius_m),
        "drawbar_pull_n": float(force[0]),
        "side_force_n": float(force[1]),
        "vertical_force_n": float(force[2]),
        "torque_n_m": torque,
        "rim_rate_rad_s": float(rate),
        "speed_m_s": float(step[0] / duration),
        "vertical_speed_m_s": float(step[2] / duration),
        "load_n": test.load_n,
        "kinetic_energy_j": simulation.kinetic_energy_j,
        "overlap_ratio": overlap,
    }


def travel(state: State, shape: WheelShape, test: WheelTest) -> None:
    """Take the damper away and let the wheel travel from now on."""
    simulation, (axle, rim) = state.simulation, test.speeds()
    note_moment(state, "lowered")
    drives = [load_drive(test, simulation)]
    if test.held == "free":
        drives += [Drive(axis=0, applied_force_n=-test.drawbar_load_n, mass_kg=wheel_mass_kg(test, simulation))]
    simulation.move_wall("wheel", (axle, 0.0, simulation.wall("wheel").velocity_m_s[2]))
    simulation.drive_wall("wheel", *drives)
    simulation.turn_wall("wheel", (0.0, rim / shape.radius_m, 0.0))
    every, steps = sample_steps(shape, test, simulation), steps_in(test.duration_s(shape.radius_m), simulation)
    state.notes |= {"travel_s": simulation.time_s, "marks": marks(simulation.n_steps, steps, every)}
    state.begin("travel", steps)


def marks(first_step: int, steps: int, every: int) -> dict[str, int]:
    """Moment -> step of the look at which it is noted."""
    looks = {name: math.ceil(share * steps / every) for name, share in MOMENTS.items()}
    looks["flow_ends"] = max(looks["flow_ends"], looks["flow_begins"] + 1)
    return {name: first_step + k * every for name, k in looks.items()}


def sample_steps(shape: WheelShape, test: WheelTest, simulation: Simulation) -> int:
    """Steps between two samples of the travel, of which there are N_SAMPLES or fewer."""
    return max(1, steps_in(test.duration_s(shape.radius_m) / N_SAMPLES, simulation))


def note_travel(state: State, bed: SoilBed, test: WheelTest, shape: WheelShape) -> None:
    """Note what is due at this look of the travel."""
    simulation, notes = state.simulation, state.notes
    for name, step in notes["marks"].items():
        if simulation.n_steps == step:
            note_moment(state, name)
    if simulation.time_s - notes["travel_s"] > RIM_FROM * test.duration_s(shape.radius_m):
        note_rim(state, bed)


def note_rim(state: State, bed: SoilBed) -> None:
    """Add the contacts of the wheel now to those of the samples before."""
    notes, found = state.notes, state.simulation.wall_contacts("wheel")
    arms, period = found.points_m - notes["axle"], np.array([bed.setup.length_m, bed.setup.width_m])
    arms[:, :2] -= period * np.round(arms[:, :2] / period)
    columns = {"arms_m": arms, "forces_n": found.forces_n, "torques_n_m": found.torques_n_m}
    for name, values in ({"sample": np.full(len(found), len(notes["samples"]) - 1)} | columns).items():
        notes[f"rim.{name}"] = np.concatenate([notes[f"rim.{name}"], values]) if f"rim.{name}" in notes else values


def note_moment(state: State, name: str) -> None:
    """Remember the soil's grains, and where the axle is."""
    grains, n = state.simulation.grains, state.notes["n_soil"]
    state.note_grains(name, Grains(**{key: values[:n] for key, values in vars(grains).items()}))
    state.notes[f"{name}.axle"] = np.asarray(state.simulation.wall("wheel").pivot)
    state.notes[f"{name}.time_s"] = state.simulation.time_s


def seen(bed: SoilBed, shape: WheelShape, test: WheelTest, each: Callable[[Simulation, str], None] | None):
    """Function that makes a look for `State.go_on` of `ended(state, sample)`, which says if the stage is over.

    The look first adds a sample to the history and calls `each(simulation, stage)`; it raises dem.SimulationError if grains are
    below the floor.
    """

    def look(ended: Callable[[State, dict[str, float]], bool]) -> Callable[[State], bool]:
        def call(state: State) -> bool:
            simulation, sample = state.simulation, record(state, bed, shape, test)
            state.notes["samples"] += [sample]
            if each is not None:
                each(simulation, state.stage)
            if simulation.n_left:
                raise SimulationError(f"{simulation.n_wholes_left} grains fell through the floor of the bed")
            return ended(state, sample)

        return call

    return look


def lower(
    bed: SoilBed,
    soil: Soil,
    shape: WheelShape,
    test: WheelTest,
    each: Callable[[Simulation, str], None] | None = None,
    *,
    state: State | None = None,
    keep: Callable[[State], None] | None = None,
    threads: int = 1,
) -> State:
    """Lower a wheel on a copy of a bed; each, state, keep, threads, errors : as in `drive`, which goes on from the result.

    What is held, slip and speeds play no part, so that all runs on a bed may start from the same lowered wheel. The stage of the
    result is "lowered", or "not_lowered" if the soil did not carry the wheel in time.
    """
    state = start(bed, soil, shape, test, threads) if state is None else state

    def carried(current: State, sample: dict[str, float]) -> bool:
        slow = CARRIED_RATIO * lowering_speed_m_s(shape, current.simulation)
        return sample["vertical_force_n"] > 0.5 * test.load_n and abs(sample["vertical_speed_m_s"]) < slow

    is_carried = state.go_on(seen(bed, shape, test, each)(carried), keep)
    state.begin("lowered" if is_carried else "not_lowered", 0)
    return state


def drive(
    bed: SoilBed,
    soil: Soil,
    shape: WheelShape,
    test: WheelTest,
    each: Callable[[Simulation, str], None] | None = None,
    *,
    state: State | None = None,
    keep: Callable[[State], None] | None = None,
    threads: int = 1,
) -> WheelRun:
    """Lower a wheel on a copy of a bed and drive it; or go on from a state, with the same bytes.

    state : of `lower`, or of a test that was interrupted; it is changed. `each(simulation, stage)` is called at every look, then
    `keep(state)`, which may save the state (or raise, to stop). Results do not depend on the number of threads.

    Raises
    ------
    ValueError : grains too large for the wheel, or the wheel for the bed (`check`).
    dem.SimulationError : the run blew up, or grains fell through the floor.
    """
    if state is None or state.stage == "lower":
        state = lower(bed, soil, shape, test, each, state=state, keep=keep, threads=threads)
    if state.stage in ("lowered", "not_lowered"):
        warn(warnings_of(bed, soil, shape, test))
    if state.stage == "lowered":
        travel(state, shape, test)

    def near_floor(current: State, _: dict[str, float]) -> bool:
        note_travel(current, bed, test, shape)
        return current.notes["axle"][2] - shape.outer_radius_m < FLOOR_DIAMETERS * 2.0 * soil.radius_m

    status = state.stage
    if status == "travel":
        stopped = state.go_on(seen(bed, shape, test, each)(near_floor), keep, sample_steps(shape, test, state.simulation))
        status = "bottomed" if stopped else "done"
    note_moment(state, "end")
    return result(state, bed, soil, shape, test, status)


def rim_of(notes: dict) -> dict[str, np.ndarray]:
    """The contacts that were noted, see `WheelRun`."""
    none = {"sample": np.zeros(0, int)} | dict.fromkeys(("arms_m", "forces_n", "torques_n_m"), np.zeros((0, 3)))
    return {name: np.asarray(notes.get(f"rim.{name}", empty)) for name, empty in none.items()}


def unbalanced(state: State, before: Content, after: Content, test: WheelTest) -> float:
    """Residual of the momentum of grains and wheel, over load times duration: of the grains (3), and of the wheel along z."""
    simulation, notes = state.simulation, state.notes
    duration = simulation.time_s - notes["begun_s"]
    impulses = [notes["wheel_impulse"], notes["floor_impulse"]]
    of_grains = momentum_residual(before, after, simulation.gravity_m_s2, duration, impulses)
    pushed = notes["wheel_impulse"][2] + notes["damper_impulse"] - test.load_n * duration
    of_wheel = wheel_mass_kg(test, simulation) * simulation.wall("wheel").velocity_m_s[2] - pushed
    return math.hypot(*of_grains, of_wheel) / (test.load_n * duration)


def result(state: State, bed: SoilBed, soil: Soil, shape: WheelShape, test: WheelTest, status: str) -> WheelRun:
    """The results of a test that has ended."""
    simulation, notes = state.simulation, state.notes
    before = Content(**notes["before"] | {"momentum": np.asarray(notes["before"]["momentum"])})
    after = content(simulation, soil, carried(bed, simulation, notes["n_soil"]))
    history = {name: np.array([sample[name] for sample in notes["samples"]]) for name in notes["samples"][0]}
    began = notes.get("travel_s", simulation.time_s)
    history["time_s"] = history["time_s"] - (began - notes["begun_s"])
    names = [name for name in ("lowered", *MOMENTS, "end") if f"{name}.axle" in notes]
    mass, velocity = wheel_mass_kg(test, simulation), np.asarray(simulation.wall("wheel").velocity_m_s)
    kinetic = after.kinetic_j - before.kinetic_j + 0.5 * mass * float((velocity**2).sum())
    work = notes["work_j"] | {"start": 0.5 * mass * test.speeds()[0] ** 2 if "travel_s" in notes else 0.0}
    return WheelRun(
        status=status,
        shape=shape,
        test=test,
        history=history,
        moments={name: state.noted_grains(name) for name in names},
        axles={name: np.asarray(notes[f"{name}.axle"]) for name in names},
        times_s={name: notes[f"{name}.time_s"] - began for name in names},
        rim=rim_of(notes),
        warnings=warnings_of(bed, soil, shape, test),
        momentum_residual_ratio=unbalanced(state, before, after, test),
        work_j=work,
        dissipated_j=sum(work.values()) - kinetic - (after.potential_j - before.potential_j),
        max_overlap_ratio=notes["max_overlap_ratio"],
        n_particles=bed.n_particles,
        n_steps=simulation.n_steps - notes["begun_step"],
        simulated_time_s=simulation.time_s - notes["begun_s"],
    )
