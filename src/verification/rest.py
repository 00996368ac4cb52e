"""Grains at rest: what carries their weight, how deep they sink into each other, and whether a heap stays as it is.

Static stack of n grains of weight w: the floor carries n w, and the contact below k grains has the overlap (k w / K)^(2/3), K being
4/3 E* sqrt(R*) of that contact. A bed at rest: the floor carries its weight; while it settles, the mean force is the weight plus
the change of momentum over time (Newton), to rounding. A settled heap: no closed form, but it should not move at all.
"""

from functools import partial

import numpy as np

import dem
from verification import closed_forms
from verification.check import Check
from verification.scene import FLOOR, SOFT, mass_kg, record, scene

GROUP = "Rest"
STATICS = "closed form (statics)"

RADIUS_M, GRAVITY_M_S2 = 1e-3, 9.81
TIME_STEP_S = 0.2 * dem.rayleigh_time(RADIUS_M, SOFT)

#: Units of rounding of the contact arithmetic.
PRECISIONS = {"float64": 2.0**-53, "float32": 2.0**-24}

HEAP_GRAINS, SETTLE_S, WATCH_S = 300, 1.0, 0.5


def checks() -> list[Check]:
    """All cases of rest."""
    return [
        *(check for precision in PRECISIONS for check in stack(precision)),
        *(check for precision in PRECISIONS for check in bed(precision)),
        *(check for model in ("type_a", "type_c") for check in heap(model)),
    ]


def under_gravity(**settings) -> dem.Simulation:
    """An empty simulation of soft, rough grains over the floor."""
    gravity = (0.0, 0.0, -GRAVITY_M_S2)
    settings = {"restitution": 0.5, "static_friction": 0.5, "rolling_friction": 0.2, "walls": [FLOOR]} | settings
    return scene(SOFT, RADIUS_M, TIME_STEP_S, gravity_m_s2=gravity, **settings)


def stack(precision: str) -> list[Check]:
    """Five grains on top of each other, after they have come to rest."""
    n, weight = 5, mass_kg(SOFT, RADIUS_M) * GRAVITY_M_S2
    simulation = under_gravity(precision=precision)
    simulation.add_grains([(0.0, 0.0, (2 * k + 1) * RADIUS_M) for k in range(n)], RADIUS_M, "grain")
    simulation.run(0.5)
    run = record(simulation, 1, 100)
    heights = run.positions_m[-1, :, 2]
    overlaps = np.concatenate([[RADIUS_M - heights[0]], 2.0 * RADIUS_M - np.diff(heights)])
    on_floor = closed_forms.on_wall(SOFT, RADIUS_M, 1.0).stiffness
    between = closed_forms.of_spheres(SOFT, RADIUS_M, RADIUS_M, 1.0).stiffness
    carried = weight * np.arange(n, 0, -1)
    expected = (carried / np.array([on_floor] + (n - 1) * [between])) ** (2.0 / 3.0)
    tolerance = 100.0 * PRECISIONS[precision] + 1e-9  # what is left of the motion after 0.5 s
    check = partial(Check, group=GROUP, case=f"stack of {n} grains, {precision}", source=STATICS)
    floor = -run.floor_forces_n[-1, 2]
    return [
        check(
            quantity="force on the floor over weight", unit="-", expected=1.0, obtained=float(floor / (n * weight)),
            tolerance=tolerance,
        ),
        *(
            check(
                quantity=f"overlap below grain {k + 1}", unit="m", expected=float(expected[k]), obtained=float(overlaps[k]),
                tolerance=tolerance * float(expected[k]),
            )
            for k in range(n)
        ),
    ]  # fmt: skip


def bed(precision: str) -> list[Check]:
    """A bed of 200 grains in a periodic box: while it settles, and at rest."""
    side = 10.0 * RADIUS_M
    simulation = under_gravity(precision=precision, period_m=(side, side, 0.0))
    region = dem.BoxRegion(low_m=(0.0, 0.0), high_m=(side - RADIUS_M / 4, side - RADIUS_M / 4), bottom_m=0.0)
    sizes = dem.Sizes(mean_m=1.25 * RADIUS_M, sd_ratio=0.1)
    simulation.add_factory(dem.Factory(n_grains=200, region=region, sizes=sizes, material="grain", seed=1))
    masses = mass_kg(SOFT, simulation.grains.radii_m)
    weight = masses.sum() * GRAVITY_M_S2
    falling = record(simulation, 1, 8000)
    gained = masses @ (falling.velocities_m_s[-1] - falling.velocities_m_s[0])
    balance = falling.floor_forces_n[-1] + gained / falling.times_s[-1] + (0.0, 0.0, weight)
    still = simulation.run(3.0, until=dem.Simulation.is_static)
    simulation.run(0.2)
    resting = record(simulation, 1, 2000)
    print(still, simulation.time_s, resting.floor_forces_n[-1]/weight, balance/weight, falling.floor_forces_n[-1]/weight)
    return []


def heap(model: str) -> list[Check]:
    """A column of grains collapses to a heap; then how far its grains drift in WATCH_S."""
    simulation = under_gravity(rolling_model=model)
    region = dem.TubeRegion(radius_m=6.0 * RADIUS_M, bottom_m=0.0)
    sizes = dem.Sizes(mean_m=1.25 * RADIUS_M, sd_ratio=0.1)
    simulation.add_factory(dem.Factory(n_grains=HEAP_GRAINS, region=region, sizes=sizes, material="grain", seed=1))
    simulation.run(SETTLE_S)
    run = record(simulation, 10, round(WATCH_S / 10 / TIME_STEP_S))
    ways = np.linalg.norm(run.positions_m - run.positions_m[0], axis=2) / RADIUS_M
    high = run.positions_m[0, :, 2].max() / RADIUS_M
    print(model, "height", high, "ways", ways.max(axis=1), ways.mean(axis=1), np.sort(ways[-1])[-5:], simulation.is_static(), np.linalg.norm(run.velocities_m_s[-1],axis=1).max())
    return []
