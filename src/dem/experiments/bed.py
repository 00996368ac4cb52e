"""A bed of grains dropped between smooth end walls, periodic in y: where a slope is cut, and what flows out of a box."""

from typing import Protocol

from dem import Box, BoxRegion, Simulation
from dem.experiments.soil import Engine, Soil


class Bed(Protocol):
    """What the setups of such tests have in common: distance of the end walls, period along y, and preparation."""

    @property
    def length_m(self) -> float: ...  # noqa: D102
    @property
    def thickness_m(self) -> float: ...  # noqa: D102
    @property
    def preparation_friction_ratio(self) -> float: ...  # noqa: D102
    @property
    def prepared_with_adhesion(self) -> bool: ...  # noqa: D102


def dropped(
    soil: Soil,
    bed: Bed,
    engine: Engine,
    seed: int,
    walls: list[Box],
    n_grains: int,
    *,
    endless: bool = False,
    velocity_sd_m_s: float = 0.0,
) -> Simulation:
    """Walls and dropped grains at time 0, with the friction and adhesion of the preparation.

    Walls of the material "plate" are as rough as the grains, those of "frame" are smooth and nothing sticks to them.
    endless : the bed is periodic along x too. velocity_sd_m_s : random velocity of the grains, see `dem.Factory`.
    """
    grain, options = soil.softened(engine.stiffness_reduction), engine.options(soil)
    early = options["adhesion"] if bed.prepared_with_adhesion else "none"
    prepared = soil.prepared(bed.preparation_friction_ratio, early)
    simulation = Simulation(
        materials={"soil": grain, "frame": grain, "plate": grain},
        interactions={("soil", "soil"): prepared, ("soil", "plate"): prepared, ("soil", "frame"): soil.interaction(0.0, 0.0)},
        walls=walls,
        period_m=(bed.length_m if endless else 0.0, bed.thickness_m, 0.0),
        smallest_radius_m=soil.smallest_sphere_m,
        floor_m=-2.0 * soil.sizes.largest_m,
        **options,
    )
    corners = {"low_m": (0.0, 0.0), "high_m": (bed.length_m, bed.thickness_m)}
    region = BoxRegion(**corners, bottom_m=0.0, periodic_x=endless, periodic_y=True)
    simulation.add_factory(soil.factory(n_grains, region, seed, velocity_sd_m_s))
    return simulation
