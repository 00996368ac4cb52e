"""The noise of a response at a point of the design: from repeated runs around, and from runs of which only a bound is known."""

import numpy as np
import pandas as pd
import pytest

from virtual_soil.calibration.models import known_points
from virtual_soil.calibration.noise import BORROWED, censoring, error_of_mean, known_scatter, scatter_at
from virtual_soil.calibration.response import Response
from virtual_soil.calibration.space import space_of

ANGLE = Response(
    name="angle", column="angle_deg", unit="deg", symbol="A", table="heaps", bound_column="angle_bound_deg", maximum=90.0
)
DESIGN = {
    "variables": ["radius_m", "static_friction"],
    "grid": {"static_friction": [0.1, 1.0]},
    "sweep": {"radius_m": [1e-4, 1e-2]},
}
SPACE = space_of(DESIGN)
MATERIAL = {"radius_m": 1e-3, "static_friction": 0.5}


def heaps(radius_m, sd, n_points=20, n_seeds=2, **changed):
    """Repeated heaps at one place of the design, as if it were many points, with a scatter."""
    random = np.random.default_rng(int(1e6 * radius_m))
    rows = [
        {"point_id": f"{radius_m}-{k}", "fidelity": "campaign", "radius_m": radius_m, "static_friction": 0.5, "seed": seed,
         "purposes": "grid", "angle_deg": 30.0 + sd * random.standard_normal(), "angle_bound_deg": np.nan}
        for k in range(n_points) for seed in range(n_seeds)
    ]  # fmt: skip
    return pd.DataFrame(rows).assign(**changed)


def at(radius_m):
    return {"radius_m": np.array([radius_m]), "static_friction": np.array([0.5])}


def test_the_scatter_follows_the_point():
    table = pd.concat([heaps(1e-4, 0.5), heaps(1e-2, 2.0)])
    fine, coarse = (scatter_at(ANGLE, table, SPACE, at(radius))[0] for radius in (1e-4, 1e-2))
    assert (
        0.4 < fine < 0.7 * known_scatter(ANGLE, table) < known_scatter(ANGLE, table) < coarse
    )  # some of the pooled one is borrowed
    points = known_points(ANGLE, {"heaps": table}, DESIGN, MATERIAL).groupby("radius_m")["noise"].mean()
    assert points[1e-4] == pytest.approx(fine / np.sqrt(2))
    assert points[1e-2] == pytest.approx(coarse / np.sqrt(2))


def test_far_from_all_repeats_the_scatter_is_the_pooled_one():
    table = heaps(1e-4, 0.5)
    far = scatter_at(ANGLE, table, SPACE, at(1e-2))[0]
    assert far == pytest.approx(known_scatter(ANGLE, table), rel=1e-3)


def test_repeats_count_by_their_degrees_of_freedom():
    table = pd.concat([heaps(1e-4, 0.5), heaps(1e-2, 2.0, n_points=1, n_seeds=3)])
    there = table[table["radius_m"] == 1e-2]["angle_deg"].var(ddof=1)
    by_hand = (BORROWED * known_scatter(ANGLE, table) ** 2 + 2 * there) / (BORROWED + 2)
    assert scatter_at(ANGLE, table, SPACE, at(1e-2))[0] == pytest.approx(np.sqrt(by_hand), rel=1e-3)


def test_a_flat_heap_is_known_to_lie_between_zero_and_the_lowest_slope():
    flat = heaps(1e-3, 0.0, n_points=1, n_seeds=2, point_id="flat", angle_deg=3.0, angle_bound_deg=6.0)
    table = pd.concat([heaps(1e-4, 0.5), flat])
    assert known_scatter(ANGLE, table) == known_scatter(ANGLE, heaps(1e-4, 0.5))  # flat heaps that agree are no sharp test
    assert censoring(ANGLE, flat) == pytest.approx(6.0 / np.sqrt(12.0))
    assert error_of_mean(ANGLE, flat, 0.5, 2) == pytest.approx(np.hypot(0.5 / np.sqrt(2), 6.0 / np.sqrt(12.0)))
    noise = known_points(ANGLE, {"heaps": table}, DESIGN, MATERIAL).set_index("point_id")["noise"]
    assert noise["flat"] > 1.7 > 0.6 > noise["0.0001-0"]


def test_without_bounds_nothing_is_censored():
    table = heaps(1e-4, 0.5).drop(columns="angle_bound_deg")
    assert censoring(ANGLE, table) == 0.0
    assert scatter_at(ANGLE, table, SPACE, at(1e-4))[0] < 1.0


def test_where_all_repeats_are_flat_the_scatter_is_what_their_bound_leaves_open():
    flat = heaps(1e-3, 0.0, n_points=1, n_seeds=2, point_id="flat", angle_deg=3.0, angle_bound_deg=6.0)
    table = pd.concat([heaps(1e-4, 0.5, n_seeds=1), flat])
    assert known_scatter(ANGLE, table) == pytest.approx(6.0 / np.sqrt(12.0))
    assert scatter_at(ANGLE, table, SPACE, at(1e-4))[0] == pytest.approx(6.0 / np.sqrt(12.0))
    assert np.isnan(known_scatter(ANGLE, heaps(1e-4, 0.5, n_seeds=1)))
    mixed = pd.concat([flat.iloc[:1], heaps(1e-3, 0.0, n_points=1, n_seeds=1, point_id="flat", angle_deg=13.0)])
    assert known_scatter(ANGLE, mixed) == pytest.approx(10.0 / np.sqrt(2.0))
