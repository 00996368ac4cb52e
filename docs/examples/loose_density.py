"""An experiment of one's own on the public API: how densely grains lie that were poured into a tube.

Run: .venv/bin/python docs/examples/loose_density.py (seconds, after the first run). The guide add-an-experiment.md makes it part of
the workflow.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from dem import Box, Factory, Grains, Simulation, SimulationError, Tube, TubeRegion
from dem.experiments.soil import Engine, Soil

#: The column counts as settled at this kinetic energy (`Simulation.is_static`), or after so many free-fall times.
SETTLED_ENERGY_RATIO = 1e-6
SETTLE_FALL_TIMES = 12.0
#: Walls, floor and surface order the grains; so far from them (grain radii) they are not counted.
MARGIN_RADII = 4.0
#: Random points in the core: a standard error of 0.0015.
N_POINTS = 100_000


@dataclass(frozen=True, kw_only=True)
class Setup:
    """Number of grains, and the tube's radius over scale_radius_m, which is the grain radius as a rule."""

    n_particles: int
    tube_radius_ratio: float
    scale_radius_m: float


@dataclass(frozen=True)
class Density:
    """Result of the test: solid fraction of the core, bulk density, steps, largest overlap over the radius, grains at rest."""

    solid_fraction: float
    bulk_density_kg_m3: float
    n_steps: int
    overlap_ratio: float
    grains: Grains


def run(soil: Soil, setup: Setup, engine: Engine, seed: int, each: Callable[[Simulation, str], None] | None = None) -> Density:
    """Pour and measure. `each(simulation, stage)` is called every 500 steps.

    Raises
    ------
    dem.SimulationError : the run blew up, or the column is too small to have a core.
    """
    grain, half = soil.softened(engine.stiffness_reduction), 2.0 * setup.tube_radius_ratio * setup.scale_radius_m
    tube_radius = setup.tube_radius_ratio * setup.scale_radius_m
    simulation = Simulation(
        materials={"soil": grain},
        interactions={("soil", "soil"): soil.interaction()},
        walls=[
            Box(name="floor", material="soil", low_m=(-half, -half, 0.0), high_m=(half, half, 0.0)),
            Tube(name="tube", material="soil", radius_m=tube_radius, bottom_m=0.0, top_m=1e3 * setup.scale_radius_m),
        ],
        smallest_radius_m=soil.sizes.smallest_m,
        **engine.options(soil),
    )
    region = TubeRegion(radius_m=tube_radius, bottom_m=0.0)
    simulation.add_factory(Factory(n_grains=setup.n_particles, region=region, sizes=soil.sizes, material="soil", seed=seed))
    drop = float(simulation.grains.positions_m[:, 2].max())
    simulation.run(
        SETTLE_FALL_TIMES * math.sqrt(2.0 * drop / engine.gravity_m_s2),
        until=lambda s: s.is_static(SETTLED_ENERGY_RATIO),
        each=None if each is None else lambda s: each(s, "fill"),
    )
    solid = core_solid_fraction(simulation.grains, tube_radius, MARGIN_RADII * soil.radius_m)
    overlap = simulation.largest_overlap_ratio()
    return Density(solid, solid * soil.density_kg_m3, simulation.n_steps, overlap, simulation.grains)


def core_solid_fraction(grains, tube_radius_m: float, margin_m: float) -> float:
    """Share of random points in the core that lie in a grain; the core is a margin away from all boundaries.

    Counting the grains whose centres lie in the core would jump with the layers that equal grains form along the walls.
    """
    low, high, radius = margin_m, float(grains.positions_m[:, 2].max()) - margin_m, tube_radius_m - margin_m
    if high <= low or radius <= 0.0:
        raise SimulationError(f"there is no core {1e3 * margin_m:g} mm away from tube, floor and surface; allowed: a larger column")
    random = np.random.default_rng(0)
    distance, angle = radius * np.sqrt(random.random(N_POINTS)), random.uniform(0.0, 2.0 * math.pi, N_POINTS)
    points = np.stack([distance * np.cos(angle), distance * np.sin(angle), random.uniform(low, high, N_POINTS)], axis=1)
    away, grain = cKDTree(grains.positions_m).query(points, k=4)
    return float((away < grains.radii_m[grain]).any(axis=1).mean())


if __name__ == "__main__":
    for friction in (0.0, 0.3, 0.9):
        sand = Soil(
            radius_m=1e-3,
            density_kg_m3=2650.0,
            poisson_ratio=0.2,
            shear_modulus_pa=1e9,
            static_friction=friction,
            rolling_friction=friction / 3.0,
            restitution=0.5,
        )
        poured = run(
            sand,
            Setup(n_particles=1500, tube_radius_ratio=12.0, scale_radius_m=1e-3),
            Engine(stiffness_reduction=100.0, time_step_rayleigh_ratio=0.4),
            seed=1,
        )
        print(f"static friction {friction:g}: solid fraction {poured.solid_fraction:.3f}, {poured.bulk_density_kg_m3:.0f} kg/m3")
