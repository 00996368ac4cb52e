"""Expected grains and steps of the jobs of wheel, plates and cone, in closed form; time and memory follow as in `campaign.cost`.

A job is what the rules' scripts get: `soil` of `soil.soil_of_case`, `grains`, `engine`, `bed` (see `setups`).
"""

import math
from typing import NamedTuple

from dem.experiments import density, penetration, soil_bed, wheel
from dem.experiments.penetration import Tool
from dem.experiments.soil_bed import Setup
from dem.experiments.wheel_setup import WheelShape
from virtual_soil.campaign import cost
from virtual_soil.campaign.experiments.common import loose_column_m, time_step_s
from virtual_soil.wheel.setups import press_test, refused, shape_of, soil_and_engine, test_of

#: Duration of a step over that of as many grains in heap or shear box: under a tool, and while a bed falls and settles. Beds are
#: larger than the caches. From 93 jobs of `wheel_spread`, two side by side (docs/guides/cluster.md).
TOOL_FACTOR, BED_FACTOR = 1.35, 1.3
#: Time until dropped grains lie, in free-fall times of the loose column (1.4 to 2.0 of 15 889 grains, the loosest beds last);
#: then with their own friction, in those of the depth (1.0; 2.2 to 2.6 of beds that settled with 1.4 to 4 times their friction).
SETTLE_FALL_TIMES, REST_FALL_TIMES = 1.6, 1.6
#: Way in radii that the wheel is lowered at its largest speed until the soil carries it (0.24 to 0.33 on three beds).
LOWERED_RADII = 0.3
#: Beginning of a tool's way above the bed's level, in mean grain diameters: on its highest grain.
ABOVE_DIAMETERS = 1.0
#: Halvings until a density is found, after the loosest and the densest column: from a range of 0.12 to 0.003 on either side.
HALVINGS = 4
#: Memory in MB per grain of a film: 40 frames of ten numbers, beside the simulation.
FILMED_GRAIN_MB = cost.GRAIN_MB + 40 * 10 * 8e-6


#: Jobs as the summary names them, one and several.
NOUNS = {
    "steer_density": ("search for the density", "searches for the density"),
    "lower_wheel": ("lowering of the wheel", "lowerings of the wheel"),
    "drive_wheel": ("run of the wheel", "runs of the wheel"),
    "press_plate": ("plate", "plates"),
    "push_cone": ("cone", "cones"),
}


class Work(NamedTuple):
    """Number of spheres of a job and steps of all of them.

    clumps : whether the spheres belong to clumps. factor : duration of a step over that in a heap.
    """

    spheres: int
    steps: float
    clumps: bool
    factor: float = TOOL_FACTOR

    @property
    def expected_s(self) -> float:
        """Expected wall time in s, without the job's start-up."""
        return self.factor * cost.simulated_s(self.spheres, self.steps, self.clumps)


def of_bed(job: dict) -> Work:
    """Work of a bed's preparation: fall of the loose grains, then rest with their own friction."""
    (soil, engine), setup = soil_and_engine(job), Setup(**job["bed"])
    n = soil_bed.n_grains(soil, setup)
    fall_s = math.sqrt(2.0 * loose_column_m(soil, n, setup.area_m2) / engine.gravity_m_s2)
    rest_s = math.sqrt(2.0 * setup.depth_m / engine.gravity_m_s2)
    return on_bed(job, SETTLE_FALL_TIMES * fall_s + REST_FALL_TIMES * rest_s)._replace(factor=BED_FACTOR)


def of_preparation(job: dict) -> Work:
    """Work of all columns on which the preparation of a bulk density is sought."""
    soil, _ = soil_and_engine(job)
    side = density.COLUMN_DIAMETERS * 2.0 * soil.radius_m
    column = of_bed(job | {"bed": job["bed"] | {"length_m": side, "width_m": side}})
    return column._replace(steps=(2 + HALVINGS) * column.steps)


def of_lowering(job: dict, settings: dict) -> Work:
    """Work of lowering the wheel; settings : section `wheel`. Raises CalibrationError if there is no such wheel."""
    _, engine = soil_and_engine(job)
    shape = shape_of(settings)
    lowering_m_s = wheel.LOWERING_RATIO * math.sqrt(engine.gravity_m_s2 * shape.radius_m)
    return under_wheel(job, shape, LOWERED_RADII * shape.radius_m / lowering_m_s)


def of_wheel(job: dict, settings: dict, name: str) -> Work:
    """Work of the wheel's travel in a run, see `setups.run_names`; settings : section `wheel`.

    Raises CalibrationError if there is no such wheel or run.
    """
    shape, test = shape_of(settings), test_of(settings, name)
    return under_wheel(job, shape, test.duration_s(shape.radius_m))


def under_wheel(job: dict, shape: WheelShape, simulated_s: float) -> Work:
    """Work of a bed under a wheel for a simulated time, with the grains on its rim."""
    soil, _ = soil_and_engine(job)
    work = on_bed(job, simulated_s)
    return work._replace(spheres=work.spheres + (len(shape.lining(soil.radius_m)) if shape.rim == "sandpaper" else 0))


def of_plate(job: dict, section: dict, diameter_m: float) -> Work:
    """Work of a plate; section : `plate`. Raises CalibrationError if there is no such plate."""
    soil, _ = soil_and_engine(job)
    with refused("plate"):
        return pressed(job, penetration.disc(diameter_m, press_test(section), soil), section)


def of_cone(job: dict, section: dict) -> Work:
    """Work of the cone; section : `cone`. Raises CalibrationError if there is no such cone."""
    soil, _ = soil_and_engine(job)
    with refused("cone"):
        return pressed(job, penetration.cone(section["base_area_m2"], section["angle_deg"], press_test(section), soil), section)


def pressed(job: dict, tool: Tool, section: dict) -> Work:
    """Work of a tool that is pressed into a bed."""
    soil, _ = soil_and_engine(job)
    way_m = ABOVE_DIAMETERS * 2.0 * soil.radius_m + tool.reference_m + section["depth_m"]
    return on_bed(job, way_m / section["speed_m_s"])


def on_bed(job: dict, simulated_s: float) -> Work:
    """Work of a bed for a simulated time."""
    soil, engine = soil_and_engine(job)
    spheres = round(soil_bed.n_grains(soil, Setup(**job["bed"])) * soil.n_spheres)
    return Work(spheres, simulated_s / time_step_s(soil, engine), soil.shape is not None)


def of_rule(rule: str, job: dict, sections: dict, wildcards: dict) -> Work:
    """Work of a job of a rule.

    sections : `wheel`, `plate` and `cone` of the configuration. wildcards : of the job, `slip` of a run, `diameter` of a plate.
    Raises CalibrationError if there is no such wheel, plate or cone.
    """
    with refused("wheel"):
        if rule == "steer_density":
            return of_preparation(job)
        if rule == "prepare_bed":
            return of_bed(job)
        if rule == "press_plate":
            return of_plate(job, sections["plate"], float(wildcards["diameter"]))
        if rule == "push_cone":
            return of_cone(job, sections["cone"])
        if rule == "lower_wheel":
            return of_lowering(job, sections["wheel"])
        return of_wheel(job, sections["wheel"], wildcards["slip"])


def requested_mb(rule: str, work: Work, attempt: int) -> int:
    """Requested memory in MB of a job of a rule at an attempt (1, 2, ...)."""
    return cost.requested_mb(work.spheres, attempt, FILMED_GRAIN_MB if rule == "film_wheel" else cost.GRAIN_MB)


def summary(target: str, planned: list[tuple[str, Work, int]], tests_s: tuple[float, ...] = ()) -> str:
    """What all jobs of a target are expected to take, those that are done among them, in one line.

    planned : rule, work and number of jobs; a rule may come several times. tests_s : expected s of each of the calibration's own
    tests with the wheel's grains.
    """
    counts: dict[str, int] = {}
    for rule, _, number in planned:
        counts[rule] = counts.get(rule, 0) + number
    n_beds, beds = counts.pop("prepare_bed"), [work for rule, work, _ in planned if rule == "prepare_bed"]
    sizes = [f"{float(f'{spheres:.3g}'):,.0f}".replace(",", " ") for spheres in sorted({bed.spheres for bed in beds})]
    size = sizes[0] if len(sizes) == 1 else f"{sizes[0]} to {sizes[-1]}"
    parts = [f"{n_beds} {'bed' if n_beds == 1 else 'beds'} of {size} {'spheres' if beds[0].clumps else 'grains'}"]
    parts += [f"{number} {NOUNS[rule][number > 1]}" for rule, number in counts.items() if number]
    if tests_s:
        parts.append(f"{len(tests_s)} {'test' if len(tests_s) == 1 else 'tests'} of the calibration")
    seconds = sum(number * work.expected_s for _, work, number in planned) + sum(tests_s)
    return f"{target} (not part of `all`): {', '.join(parts)}: about {math.ceil(seconds / 60.0)} core-min in all."
