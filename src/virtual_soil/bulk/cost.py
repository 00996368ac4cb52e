"""Grains and steps of the bulk benchmarks, for the times that are requested from a scheduler before they run."""

from virtual_soil.bulk import cases
from virtual_soil.bulk.variants import LIGGGHTS, OURS

#: Duration of a step over that of the study's cost model (50 million grain-steps per second): the slowest run of each code on
#: docs/bulk-benchmarks.md, in processor time.
FACTORS = {OURS: 10.0, LIGGGHTS: 20.0}
#: Grains of the published packing of the drum.
DRUM_GRAINS = 38_000


def n_grains(case: str, variant: str) -> int:
    """Number of grains of a run, without the ball of the impact."""
    if case == "impact":
        return int(variant.split("_")[0])
    return DRUM_GRAINS if case == "drum" else cases.module_of(case).SETUPS[variant].n_grains


def of_run(case: str, code: str, variant: str) -> tuple[int, float]:
    """Number of grains of a run and its steps, in steps of the cost model."""
    setup = cases.module_of(case).SETUPS[variant]
    return n_grains(case, variant), FACTORS[code] * setup.duration_s / setup.time_step_s


def of_filling(orifice: str) -> tuple[int, float]:
    """Number of grains of a silo's filling and its steps, as `of_run`, if it takes all the time that it has to come to rest."""
    silo = cases.module_of("silo")
    setup = silo.SETUPS[orifice]
    return setup.n_grains, FACTORS[OURS] * silo.REST_TIME_S / setup.time_step_s
