"""Angles of cut slopes: what of a bisection becomes a response, and what is counted, expected and drawn of it."""

import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from dem.experiments import cut_slope
from virtual_soil.campaign.experiments.common import engine_of, soil_of, time_step_s
from virtual_soil.campaign.experiments.slope import declared, measure, simulate
from virtual_soil.campaign.grains import grain_table
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.report.experiments import slope as described

RUN = {"status": "done", "stands_deg": 52.0, "falls_deg": 53.0, "slope_height_m": 0.012}


def angles(**run):
    return measure.measured({**RUN, **run}, None, {})


def test_the_angle_is_the_middle_of_its_bracket():
    assert angles()["slope_angle_deg"] == 52.5
    assert angles()["slope_half_width_deg"] == 0.5
    assert math.isnan(angles()["slope_bound_deg"])


def test_where_nothing_stands_the_angle_lies_between_zero_and_the_flattest_cut():
    flat = angles(status="flat", stands_deg=math.nan, falls_deg=20.0)
    assert (flat["slope_angle_deg"], flat["slope_bound_deg"]) == (10.0, 20.0)


@pytest.mark.parametrize("status", ["column", "failed"])
def test_a_wall_and_a_failure_have_no_angle(status):
    run = angles(status=status, stands_deg=90.0, falls_deg=math.nan)
    assert all(math.isnan(run[name]) for name in measure.NOTHING)
    assert status not in declared.SOUND


@pytest.fixture(scope="module")
def small():
    """A slope of the smallest size: its design row, settings and result."""
    config = defaults(Study)
    config["material"]["radius_m"] = 1e-3
    config["slope"] |= {"height_ratio": 13.0, "thickness_ratio": 6.0, "tolerance_deg": 8.0}
    row = {**config["material"], "experiment": "slope", "fidelity": "campaign", "normal_stress_pa": None}
    settings = declared.setup(config, row)
    return row, settings, simulate.run(soil_of(row, settings), settings["setup"], engine_of(settings), 1)


def test_grains_and_steps_were_expected_within_the_headroom(small):
    row, settings, slope = small
    n, steps = declared.cost(row, settings)
    assert n == slope.n_particles
    assert 0.3 < n * steps / (slope.n_particles * slope.n_steps) < 3.0
    step = time_step_s(soil_of(row, settings), engine_of(settings))
    assert slope.simulated_time_s == pytest.approx(slope.n_steps * step)


def test_a_row_of_the_table_has_the_bracket_and_the_bed(small):
    _, settings, slope = small
    row, failed = simulate.row_of(slope, settings), simulate.row_of(None, settings)
    assert set(row) == set(failed)
    assert (row["stands_deg"], row["falls_deg"]) == (slope.stands_deg, slope.falls_deg)
    assert row["slope_height_m"] == pytest.approx(0.013)
    assert set(slope.history) == set(simulate.HISTORY)


def test_the_picture_shows_the_steepest_cut_that_stood(small):
    _, settings, slope = small
    run = measure.measured(simulate.row_of(slope, settings), None, {})
    before, after = (pd.DataFrame(grain_table(grains, "s")) for grains in (slope.before, slope.after))
    figure = described.slope(before, after, run)
    x, z = figure.axes[0].lines[0].get_data()
    assert np.degrees(np.arctan2(z[0] - z[1], x[1] - x[0])) == pytest.approx(slope.stands_deg)
    assert (x[0], z[0] - z[1]) == pytest.approx((1e3 * cut_slope.CREST_RATIO * 0.013, 13.0))
    assert f"β {run['slope_angle_deg']:.1f} ± " in described.facts(run)
    assert described.facts({**run, "status": "column"}) == "column, 13 mm high"


def test_culmanns_wedge_is_that_of_the_books():
    """Stability of a vertical cut, H = 4 c / gamma tan(45 + phi / 2), and values of a table."""
    assert described.culmann_kappa(90.0, 40.0) == pytest.approx(1.0 / (4.0 * math.tan(math.radians(65.0))))
    assert described.culmann_kappa(40.0, 40.0) == 0.0
    assert described.culmann_kappa(65.0, 40.0) == pytest.approx(0.0337, abs=1e-4)


def study(lines):
    """A study of three slopes of one height; lines : their peak strengths, or None."""
    runs = pd.DataFrame(
        {
            "simulation_id": list("abc"), "point_id": list("ABC"), "fidelity": "campaign", "density_kg_m3": 2500.0,
            "adhesive_stress_pa": [0.0, 150.0, 3000.0], "status": ["done", "done", "column"], "bed_solid_fraction": 0.6,
            "slope_angle_deg": [40.0, 60.0, math.nan], "slope_height_m": 0.1,
        }
    )  # fmt: skip
    return SimpleNamespace(tables={"slope": runs} | ({} if lines is None else {"peak_strength": lines}), config=defaults(Study))


def test_slopes_stand_over_kappa_with_culmanns_wedge_where_the_strength_is_measured():
    columns = {"peak_cohesion_pa": [0.0, 60.0, 1200.0], "peak_friction_angle_deg": [39.0, 40.0, 41.0]}
    points = described.cohesive_points(study(pd.DataFrame({"point_id": list("ABC"), "fidelity": "campaign", **columns})))
    assert list(points["kappa"]) == pytest.approx([0.0, 60.0 / (1500.0 * 9.81 * 0.1), 1200.0 / (1500.0 * 9.81 * 0.1)])
    axes = described.against_cohesion(points).axes[0]
    assert [line.get_label() for line in axes.lines][2:] == ["Culmann's wedge, φ 39°", "Culmann's wedge, φ 41°"]
    assert list(axes.lines[1].get_ydata()) == [90.0]
    unknown = described.cohesive_points(study(None))
    assert unknown["kappa"].isna().all()
    axes = described.against_cohesion(unknown).axes[0]
    assert len(axes.lines) == 2
    assert list(axes.lines[0].get_xdata()) == pytest.approx([0.0, 150.0 / (1500.0 * 9.81 * 0.1)])
