"""Steps, minutes and memory that a simulation will take, as requested from a scheduler before it runs.

Every experiment estimates its own grains and steps in closed form (its `cost`). The speed is that of the default study on one
machine; docs/guides/cluster.md gives the errors, there and elsewhere. A job that was given too little is given more at its next
attempt, and goes on from its checkpoint.
"""

import math

from virtual_soil.campaign.experiments.registry import BY_NAME

#: Grain-steps per second of one core, its neighbours busy: 52e6 in shear boxes, 57e6 in heaps at the paper's fidelity.
SPEED_PER_S = 50e6
#: Minutes before the first step: starting Python on a slow file system, and compiling where no node of this type did before.
START_MIN = 3.0
#: The first attempt is given so many times what is expected; heaps that roll without resistance take three times as long as others.
HEADROOM = 3.0
#: Memory in MB of Python with all packages (measured: 270, and 430 while kernels are compiled), and of a grain with its contacts.
BASE_MB, GRAIN_MB = 1000, 2e-3


def expected_s(row: dict, settings: dict) -> float:
    """Seconds that a simulation is expected to take, its start excepted."""
    grains, steps = BY_NAME[row["experiment"]].cost(row, settings)
    return grains * steps / SPEED_PER_S


def runtime_min(members: list[tuple[dict, dict]], attempt: int) -> int:
    """Minutes to ask for at an attempt (1, 2, ...) for a batch, pairs of row and settings; whole and at least 1."""
    return math.ceil(attempt * (START_MIN + HEADROOM * sum(expected_s(*member) for member in members) / 60.0))


def memory_mb(members: list[tuple[dict, dict]], attempt: int) -> int:
    """Memory in MB to ask for at an attempt: as much as the largest simulation of the batch needs."""
    return math.ceil(attempt * (BASE_MB + max(BY_NAME[member[0]["experiment"]].cost(*member)[0] for member in members) * GRAIN_MB))
