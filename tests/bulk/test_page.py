"""The page says what was run, and whether the codes agree."""

import numpy as np
import pandas as pd
import pytest

from virtual_soil.bulk import compare, drum, silo
from virtual_soil.bulk.cases import cost_table, curve_table, curves_of
from virtual_soil.bulk.packings import Packing
from virtual_soil.bulk.page import Results, write_page
from virtual_soil.bulk.run import Run
from virtual_soil.bulk.variants import CODES, OURS


def run_of(times_s, values, n_grains, wall_s):
    values = {name: np.broadcast_to(value, times_s.shape) for name, value in values.items()}
    return Run(
        times_s=times_s, values=values, n_grains=n_grains, grain_steps=1e6 * n_grains, n_steps=1000, time_step_s=1e-6,
        wall_s=2.0 * wall_s, processor_s=wall_s,
    )  # fmt: skip


def results(deeper_m=0.0, more_in_zone=0.0, faster=1.0):
    """Runs in which our ball is deeper, our zone has more grains, or our silo flows faster, by so much."""
    runs = {}
    for code in CODES:
        ours, wall = code == OURS, 1.0 if code == OURS else 8.0
        fall = np.linspace(0.0, 12e-3, 13)
        for start in range(6):
            heights = -0.04 - 2.0 * fall - 1e-4 * start - deeper_m * ours
            values = {"ball_z_m": heights, "ball_speed_m_s": -2.0, "bed_z_m": -0.07, "grains": 25_001.0}
            runs["impact", code, f"25000_{start}"] = run_of(fall, values, 25_001, wall)
        turn = np.linspace(0.0, 2.5, 26)
        for start in range(3):
            values = {f"{zone}_{name}": 5000.0 + 380.0 * start for zone in drum.ZONES for name in drum.GRAINS}
            values |= {f"{axis}_{name}": 0.01 for axis in "xz" for name in drum.GRAINS} | {"grains": 38_000.0}
            values["zone_1_M1"] += more_in_zone * ours
            runs["drum", code, f"soft_{start}"] = run_of(turn, values, 38_000, wall)
        runs["drum", code, "hard_beginning"] = run_of(turn, values, 38_000, wall)
        flow = np.linspace(0.0, 0.6, 61)
        for variant, outflow in (("small", 7000.0), ("large", 22_000.0)):
            above = 30_000.0 - outflow * flow * (faster if ours else 1.0)
            runs["silo", code, variant] = run_of(flow, {"above": above, "grains": above}, 30_000, wall)
    heights = np.concatenate([np.full(15_000, 0.1), np.full(15_000, 0.0)])  # half of them in the cone
    places = np.column_stack([np.zeros((30_000, 2)), heights])
    filling = Packing(positions_m=places, radii_m=np.full(30_000, 2e-3), materials=np.full(30_000, "M1"))
    return Results(
        costs=pd.concat([cost_table(run, *name, "a processor") for name, run in runs.items()], ignore_index=True),
        curves={name: curves_of(curve_table(run)) for name, run in runs.items()},
        fillings={"small": filling, "large": filling},
    )


def page_of(tmp_path, **changes):
    write_page(results(**changes), tmp_path / "page.md", tmp_path / "images")
    return (tmp_path / "page.md").read_text(encoding="utf-8")


def test_a_page_states_ratios_differences_and_what_was_not_run(tmp_path):
    text = page_of(tmp_path)
    for case in ("impact", "drum", "silo"):
        assert f"](images/bulk_{case}.png)" in text
        assert (tmp_path / f"images/bulk_{case}.png").stat().st_size > 5000
    assert text.count("| 8.0 |") == 12
    assert "| M1 in zone 1 | 5000 | 5380 ± 380 | 5380 ± 380 | +0.00 % |" in text
    assert "scatter by 1.00 % (virtual-soil) and 1.00 % (LIGGGHTS)" in " ".join(text.split())
    assert "<figure>" not in text
    assert "**does not hold**" not in text
    assert "Largest difference of the means: 0.000 mm" in text
    assert "| small | 6897 | 7000 |" in text
    assert "3.14 (virtual-soil)" in text
    for missing in ("100 000 grains", "50000 grains", "`bulk.drum: hard`", "`bulk.silo: full`", "M2"):
        assert missing in text.split("## Not run")[1]


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"deeper_m": 5e-4}, "Largest difference of the means: 0.500 mm"),
        ({"deeper_m": 1e-3}, "(below 5 % they would differ by more than chance): **does not hold**"),
        ({"more_in_zone": 0.04 * 38_000}, "of a count: 4.00 % of all grains, at 0.00 s (tolerance 3 %: **does not hold**)"),
        ({"faster": 1.2}, "(tolerance 3 %: **does not hold**)"),
        ({"faster": 1.3}, "which is for flat bottoms: **does not hold** (up to +31.9 %)"),
    ],
)
def test_a_page_says_where_the_codes_differ(tmp_path, change, expected):
    assert expected in " ".join(page_of(tmp_path, **change).split())


def test_codes_differ_by_more_than_chance_once_in_twenty_and_where_they_do():
    """Wherever it is looked for: single times of forty would differ in more than a third of these draws."""
    rng, alarms, missed = np.random.default_rng(1), 0, 0
    for _ in range(200):
        curves = [pd.DataFrame({"z": rng.normal(size=40)}) for _ in range(8)]
        alarms += compare.beyond_chance(curves[:4], curves[4:], "z", 1e-9).share < compare.LEAST_SHARE
        shifted = [curve + 4.0 for curve in curves[:4]]
        missed += compare.beyond_chance(shifted, curves[4:], "z", 1e-9).share >= compare.LEAST_SHARE
    assert alarms <= 15
    assert missed <= 2


def test_too_few_starts_cannot_tell_codes_apart():
    curves = [pd.DataFrame({"z": np.arange(3.0) + k}) for k in range(6)]
    with pytest.raises(ValueError, match="starts are 3 and 3; allowed: 4 and 4 or more"):
        compare.beyond_chance(curves[:3], curves[3:], "z", 1e-9)


def test_a_silo_that_has_run_out_of_its_cylinder_is_no_longer_steady():
    times = np.linspace(0.0, 0.5, 6)
    assert silo.steady(times, np.array([50, 40, 30, 20, 10, 0]), 15).tolist() == [False, True, True, True, False, False]


def test_cases_that_were_not_run_are_listed_as_such(tmp_path):
    every = results()
    few = Results(
        costs=every.costs[every.costs["case"] == "impact"],
        curves={name: curve for name, curve in every.curves.items() if name[0] == "impact"},
        fillings={},
    )
    write_page(few, tmp_path / "page.md", tmp_path / "images")
    text = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert "## Impact" in text
    assert "## Drum" not in text
    assert "- the drum (`bulk.cases`)\n- the silo (`bulk.cases`)" in text
    assert [path.name for path in (tmp_path / "images").iterdir()] == ["bulk_impact.png"]


def test_a_late_curve_is_late_by_its_lag():
    times = np.linspace(0.0, 2.0, 41)
    early, late = (2 * [pd.DataFrame({"x_M1": np.sin(3.0 * (times - shift))}, index=times)] for shift in (0.0, 0.02))
    assert compare.lag_s(compare.apart(early, late, "x_M1")) == pytest.approx(0.02, abs=0.003)
    assert compare.lag_s(compare.apart(late, early, "x_M1")) == pytest.approx(-0.02, abs=0.003)


def test_a_page_names_the_runs_that_miss_the_goal(tmp_path):
    assert "It is missed" not in page_of(tmp_path)
    slow = results()
    costs = slow.costs.assign(processor_s=slow.costs["processor_s"].where(slow.costs["case"] != "drum", 2.0))
    write_page(Results(costs=costs, curves=slow.curves, fillings=slow.fillings), tmp_path / "page.md", tmp_path / "images")
    assert "It is missed in: drum, soft_0; drum, soft_1; drum, soft_2; drum, hard_beginning." in " ".join(
        (tmp_path / "page.md").read_text(encoding="utf-8").split()
    )
