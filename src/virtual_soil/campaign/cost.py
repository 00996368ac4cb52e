"""What a simulation will take: steps, minutes, memory; asked of a scheduler before the simulation runs.

Estimates, in closed form, so that planning a campaign need not load the engine (whose settings of numba would also pass into the
environment of every job). The numbers are those of the default study on one machine; docs/guides/cluster.md says how far they are
off, there and elsewhere. A job that was given too little is given more at its next attempt, and goes on from its checkpoint.
"""

import math

#: Grain-steps per second of one core, its neighbours busy: 52e6 in shear boxes, 57e6 in heaps at the paper's fidelity.
SPEED_PER_S = 50e6
#: Minutes before the first step: starting Python on a slow file system, and compiling where no node of this type did before.
START_MIN = 3.0
#: The first attempt is given so many times what is expected; heaps that roll without resistance take three times as long as others.
HEADROOM = 3.0
#: Memory in MB of Python with all packages (measured: 270, and 430 while kernels are compiled), and of a grain with its contacts.
BASE_MB, GRAIN_MB = 1000, 2e-3

#: Free-fall times of the loose column until the filled grains are at rest.
FILL_FALL_TIMES = 2.0
#: Solid fraction of grains in tube and box; the loose lattice they are dropped from has this spacing in largest diameters.
SOLID_FRACTION, SPACING_RATIO = 0.57, 1.125
#: Inertial times, and least number of steps, until the lid stands still.
CONSOLIDATION_TIMES, CONSOLIDATION_STEPS = 40.0, 5500
#: The shear band in grain diameters, over which the speed is the shear rate.
BAND_DIAMETERS = 10.0


def time_step_s(row: dict, ratio: float, stiffness_reduction: float) -> float:
    """Time step in s: a fraction of the smallest grain's Rayleigh time (`dem.timestep`)."""
    smallest_m = row["radius_m"] * (1.0 - 2.0 * row["radius_sd_ratio"])
    wave = math.sqrt(row["density_kg_m3"] * stiffness_reduction / row["shear_modulus_pa"])
    return ratio * math.pi * smallest_m * wave / (0.1631 * row["poisson_ratio"] + 0.8766)


def heap(row: dict, settings: dict) -> tuple[int, float]:
    """Grains and steps of an angle-of-repose test: the column falls, then the tube rises past the filled height."""
    setup, engine = settings["setup"], settings["engine"]
    step = time_step_s(row, engine["time_step_rayleigh_ratio"], settings["softening"]["repose_stiffness_reduction"])
    n, tube_m = setup["n_particles"], setup["tube_diameter_ratio"] * setup["scale_radius_m"]
    spacing_m = 2.0 * SPACING_RATIO * row["radius_m"] * (1.0 + 2.0 * row["radius_sd_ratio"])
    column_m = n * spacing_m**3 / (math.pi * tube_m**2)
    filled_m = n * grain_volume_m3(row) / (SOLID_FRACTION * math.pi * tube_m**2)
    fall_s = math.sqrt(2.0 * column_m / engine["gravity_m_s2"])
    lift_s = min(filled_m / setup["lift_speed_m_s"], setup["max_time_s"])
    return n, (FILL_FALL_TIMES * fall_s + lift_s) / step


def box(row: dict, settings: dict) -> tuple[int, float]:
    """Grains and steps of a shear test: the lid comes to rest, then the lower frame moves its way."""
    setup, engine = settings["setup"], settings["engine"]
    scale, pressure, density = setup["scale_radius_m"], row["normal_stress_pa"], row["density_kg_m3"]
    length, width, height = (setup[f"{side}_ratio"] * scale for side in ("length", "width", "height"))
    n = round(SOLID_FRACTION * length * width * height / grain_volume_m3(row))
    plane_pa = pressure + SOLID_FRACTION * density * engine["gravity_m_s2"] * 0.5 * height
    number, modulus_pa = settings["softening"]["shear_stiffness_number"], row["shear_modulus_pa"] / (1.0 - row["poisson_ratio"])
    reduction = 1.0 if number is None else max(1.0, modulus_pa / (number * plane_pa))
    step = time_step_s(row, engine["time_step_rayleigh_ratio"], reduction)
    inertial_s = 2.0 * row["radius_m"] * math.sqrt(density / pressure)
    speed_m_s = setup["inertial_number"] * BAND_DIAMETERS * math.sqrt(pressure / density)
    consolidation = max(CONSOLIDATION_STEPS, CONSOLIDATION_TIMES * inertial_s / step)
    return n, consolidation + setup["displacement_ratio"] * scale / speed_m_s / step


def grain_volume_m3(row: dict) -> float:
    """Mean volume of a grain in m3."""
    return 4.0 / 3.0 * math.pi * row["radius_m"] ** 3 * (1.0 + 3.0 * row["radius_sd_ratio"] ** 2)


def grains_and_steps(row: dict, settings: dict) -> tuple[int, float]:
    """Number of grains and expected number of steps of a simulation: a design row and `_study.experiment_settings`."""
    return {"repose": heap, "shear": box}[row["experiment"]](row, settings)


def expected_s(row: dict, settings: dict) -> float:
    """Seconds that a simulation is expected to take, its start excepted."""
    grains, steps = grains_and_steps(row, settings)
    return grains * steps / SPEED_PER_S


def runtime_min(members: list[tuple[dict, dict]], attempt: int) -> int:
    """Minutes to ask for at an attempt (1, 2, ...) for a batch, pairs of row and settings; whole and at least 1."""
    return math.ceil(attempt * (START_MIN + HEADROOM * sum(expected_s(*member) for member in members) / 60.0))


def memory_mb(members: list[tuple[dict, dict]], attempt: int) -> int:
    """Memory in MB to ask for at an attempt: as much as the largest simulation of the batch needs."""
    return math.ceil(attempt * (BASE_MB + max(grains_and_steps(*member)[0] for member in members) * GRAIN_MB))
