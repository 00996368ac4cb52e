"""The friction of the preparation that gives a bed its density, found on narrow columns of the bed's depth."""

from dataclasses import replace

from dem.experiments import soil_bed
from dem.experiments.checks import require
from dem.experiments.soil import Engine, Soil
from dem.experiments.soil_bed import Setup

#: Sides of a column in mean grain diameters.
COLUMN_DIAMETERS = 16.0
#: Ratio of the loosest preparation: grains that come to rest with more friction are no looser when they have their own.
LOOSEST_RATIO = 4.0
#: Largest number of halvings of the interval of ratios.
MOST_HALVINGS = 10


def preparation_for(
    soil: Soil, setup: Setup, engine: Engine, seed: int, solid_fraction: float, tolerance: float = 0.003, nearest: bool = False
) -> tuple[float, float]:
    """Preparation friction ratio, up to LOOSEST_RATIO, at which a bed has a solid fraction to a tolerance; its column's fraction.

    By bisection, for the fraction falls with the ratio; not without scatter, so that after MOST_HALVINGS the fraction may miss the
    tolerance. The bed itself differs by the scatter of two packings, and by more if it is narrower than the columns: grains
    between near images form rows, and pack more densely. nearest : take the loosest or the densest column if it is not reached.

    Raises
    ------
    ValueError : these grains do not pack so loosely or so densely in this preparation; the message has the limits.
    """
    side = COLUMN_DIAMETERS * 2.0 * soil.radius_m

    def packed(ratio: float) -> float:
        column = replace(setup, length_m=side, width_m=side, preparation_friction_ratio=ratio)
        return soil_bed.prepare(soil, column, engine, seed).solid_fraction

    low, high = 0.0, LOOSEST_RATIO
    dense, loose = packed(low), packed(high)
    allowed = f"{loose:.4f} to {dense:.4f}, as these grains pack with {high:g} times their friction and with none"
    reached = loose - tolerance <= solid_fraction <= dense + tolerance
    require(reached or nearest, "solid_fraction of the bed", solid_fraction, allowed)
    ratio, found = min(((high, loose), (low, dense)), key=lambda pair: abs(pair[1] - solid_fraction))
    if not reached:
        return ratio, found
    for _ in range(MOST_HALVINGS):
        if abs(found - solid_fraction) <= tolerance:
            break
        ratio = 0.5 * (low + high)
        found = packed(ratio)
        low, high = (ratio, high) if found > solid_fraction else (low, ratio)
    return ratio, found
