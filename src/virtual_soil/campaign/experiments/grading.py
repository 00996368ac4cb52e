"""The grading of the grains: distribution of their radii, as laboratories state it."""

import itertools
import math
from dataclasses import dataclass

from dem.factory import DISTRIBUTIONS
from virtual_soil.calibration.errors import demand
from virtual_soil.campaign.settings import choice, defaults, setting


@dataclass(frozen=True, kw_only=True)
class Grading:
    """Distribution of the radii about material.radius_m: of a standard deviation, or the laboratory's sieve curve."""

    distribution: str = choice(
        "of radii with material.radius_sd_ratio; cut off at two standard deviations, of the radius or of its logarithm",
        "normal",
        DISTRIBUTIONS,
    )
    sieve_diameters_m: list[float] | None = setting(
        "openings of the laboratory's sieves, ascending; null: no sieve curve",
        None,
        above=0,
        usual=(1e-7, 1.0),
        of={"minItems": 2, "uniqueItems": True},
        note="The grains are scaled so that their mean radius is material.radius_m.",
    )
    sieve_passing: list[float] | None = setting(
        "share of the mass that passes each sieve, from 0 to 1", None, minimum=0, maximum=1, of={"minItems": 2}
    )


#: A study's grading if it states none.
USUAL = defaults(Grading)


def grading_of(config: dict) -> dict:
    """The grading as part of a simulation's settings; empty for the default, so that it needs no words."""
    return {} if config["grading"] == USUAL else {"grading": config["grading"]}


def radii_of(settings: dict) -> dict:
    """Keyword arguments of a Soil for its distribution of radii; settings : of a simulation, or a configuration.

    Between two sieves the grains have the geometric mean of the openings. Raises CalibrationError for a curve that is none.
    """
    grading = settings.get("grading")
    if grading is None:
        return {}
    diameters, passing = grading["sieve_diameters_m"], grading["sieve_passing"]
    if diameters is None and passing is None:
        return {"distribution": grading["distribution"]}
    both = diameters is not None and passing is not None and len(diameters) == len(passing)
    demand(both, "grading.sieve_passing", passing, f"a share for each of sieve_diameters_m, {diameters}")
    rises = all(low < high for low, high in itertools.pairwise(diameters))
    demand(rises, "grading.sieve_diameters_m", diameters, "ascending openings")
    never_falls = all(low <= high for low, high in itertools.pairwise(passing))
    whole = passing[0] == 0.0 and passing[-1] == 1.0
    demand(never_falls and whole, "grading.sieve_passing", passing, "shares that rise from 0 to 1")
    pairs = zip(itertools.pairwise(diameters), itertools.pairwise(passing), strict=True)
    classes = [(0.5 * math.sqrt(low * high), more - less) for (low, high), (less, more) in pairs if more > less]
    return {"classes": tuple(classes)}
