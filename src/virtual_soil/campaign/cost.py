"""Expected steps, run time and memory of a simulation, requested from a scheduler before it runs.

Every experiment estimates its number of spheres and steps in closed form (`cost`), `virtual_soil.wheel.cost` those of wheel, plates
and cone. The speed was measured with the default study on one machine; docs/guides/cluster.md lists the errors there and on other
machines. A job that exceeds its limits is resubmitted with higher limits and resumes from its checkpoint.
"""

import math

from virtual_soil.campaign.experiments.registry import BY_NAME

#: Grain-steps per second of one core while the other cores are busy; 52e6 in shear boxes, 57e6 in heaps at the paper's fidelity.
SPEED_PER_S = 50e6
#: Duration of a step of clumps over that of as many free spheres.
CLUMP_FACTOR = 1.3
#: Minutes before the first step: start of Python on a slow file system, and compilation if this node type has no compiled kernels.
START_MIN = 3.0
#: Ratio of requested to expected time at the first attempt; heaps without rolling resistance take three times as long as others.
HEADROOM = 3.0
#: Memory in MB: of Python with all packages (measured: 270, during compilation 430), and per grain with its contacts.
BASE_MB, GRAIN_MB = 1000, 2e-3


def simulated_s(spheres: int, steps: float, clumps: bool) -> float:
    """Expected wall time in s of a simulation of this size, without its start-up; clumps : whether the spheres belong to clumps."""
    return spheres * steps / SPEED_PER_S * (CLUMP_FACTOR if clumps else 1.0)


def requested_min(seconds: float, attempt: int) -> int:
    """Requested run time in whole minutes, at an attempt (1, 2, ...), of a job that is expected to simulate for `seconds`."""
    return math.ceil(attempt * (START_MIN + HEADROOM * seconds / 60.0))


def requested_mb(spheres: int, attempt: int, grain_mb: float = GRAIN_MB) -> int:
    """Requested memory in MB at an attempt of a job whose largest simulation has this number of spheres."""
    return math.ceil(attempt * (BASE_MB + spheres * grain_mb))


def expected_s(row: dict, settings: dict) -> float:
    """Expected wall time of a simulation in s, without its start-up."""
    spheres, steps = BY_NAME[row["experiment"]].cost(row, settings)
    return simulated_s(spheres, steps, "shape" in settings)


def runtime_min(members: list[tuple[dict, dict]], attempt: int) -> int:
    """Requested run time in whole minutes of a batch (pairs of row and settings) at an attempt (1, 2, ...); at least 1."""
    return requested_min(sum(expected_s(*member) for member in members), attempt)


def memory_mb(members: list[tuple[dict, dict]], attempt: int) -> int:
    """Requested memory in MB at an attempt: that of the largest simulation of the batch."""
    return requested_mb(max(BY_NAME[member[0]["experiment"]].cost(*member)[0] for member in members), attempt)
