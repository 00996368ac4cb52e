"""The page says whether the soil is confirmed, what was found, and which runs are not as they should be."""

import numpy as np
import pandas as pd
import pytest
from made_up_runs import BEDS, pressed, rows, travelled

from virtual_soil.wheel.measured import cone_table, plate_table, wheel_table
from virtual_soil.wheel.page import Results, assumptions, write_page

SOUND = {"sand": ["confirmed", "matches"]}


def page_of(folder, verdicts=SOUND, history=None, **run):
    """Page of two runs of a wheel, two plates and a cone, all made up; run : changed columns of the second run."""
    plain = {"status": "done", "warnings": run.get("warnings", ""), "momentum_residual_ratio": 0.0, "max_overlap_ratio": 0.01}
    changed = {name: [plain[name], value] for name, value in run.items()}
    columns = {"seed": [1, 2], "radius_m": [0.1, 0.1], "asked_slip": [0.5, 0.5], "momentum_residual_ratio": [0.0, 0.0]} | changed
    runs = {"wheel": rows("wheel_run", **columns)}
    histories = {"wheel": [travelled(3.0), travelled(-1.0) if history is None else history]}
    runs["plate"] = rows("press_run", seed=[1, 1], diameter_m=[0.04, 0.08], depth_m=[0.025, 0.025])
    histories["plate"] = [pressed(2e6, 1.2), pressed(1.5e6, 1.2)]
    runs["cone"] = rows("press_run", seed=[1], depth_m=[0.05])
    histories["cone"] = [pressed(3e6, 1.0, 0.05)]
    measure = {"wheel": wheel_table, "plate": plate_table, "cone": cone_table}
    tables = {tool: measure[tool](runs[tool], histories[tool], BEDS) for tool in runs}
    write_page(Results(verdicts, tables, runs, histories), folder / "wheel.md", folder / "wheel/figures")
    return (folder / "wheel.md").read_text(encoding="utf-8")


def test_the_first_line_says_that_the_answer_is_confirmed(tmp_path):
    text = page_of(tmp_path)
    assert text.splitlines()[0] == "The soil's answer is confirmed by simulation and matches its targets: sand."
    assert "All runs are done, steady, and balance." in text
    for figure in ("wheel", "wheel_over_time", "plate", "cone"):
        assert f"](wheel/figures/{figure}.png)" in text
        assert (tmp_path / f"wheel/figures/{figure}.png").stat().st_size > 5000


def test_the_first_line_names_the_cases_that_are_not_confirmed(tmp_path):
    first = page_of(tmp_path, SOUND | {"clay": ["confirmed", "misses: cohesion"]}).splitlines()[0]
    assert first == "**The soil's answer is not confirmed**: clay: prediction confirmed, match misses: cohesion."


def test_the_tables_have_the_numbers_of_the_runs(tmp_path):
    text = page_of(tmp_path)
    lines = [line for line in text.splitlines() if line.startswith("| sand |") and "done" in line]
    pull, none = ([cell.strip() for cell in line.split("|")] for line in lines)
    assert pull[5].startswith("3.00 ± 0.0")
    assert (pull[6][:5], pull[8][:5], pull[9][:5], pull[11][:5]) == ("0.300", "0.500", "20.00", "0.300")
    assert (none[5][:5], none[11]) == ("-1.00", "–")  # no efficiency of a wheel that pulls nothing
    plate = next(line for line in text.splitlines() if line.startswith("| sand | 1 | 40 |"))
    assert float(plate.split("|")[5]) == pytest.approx(2e3 * 0.01**1.2, rel=5e-3)  # kPa at two fifths of the depth
    assert "Bekker's moduli" in text
    assert "| 3.000 ± " in text


def test_the_page_says_that_the_rim_is_sandpaper():
    def said(rim):
        runs = rows("wheel_run", seed=[1], radius_m=[0.1], asked_slip=[0.5], rim=[rim])
        return assumptions(wheel_table(runs, [travelled(1.0)], BEDS))

    assert "on its sides alone: grains of the soil are glued to the rim" in said("sandpaper")
    assert "glued" not in said("smooth")


def test_the_page_says_where_grains_are_too_soft(tmp_path):
    firm = page_of(tmp_path, max_overlap_ratio=0.04)
    soft = page_of(tmp_path, max_overlap_ratio=0.098)
    said = "Grains overlap by up to 9.8 % of a radius, more than 5 %: too soft (`wheel.shear_modulus_pa`)."
    assert said in soft
    assert said not in firm


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"status": "bottomed"}, "- sand, bed 2, slip 0.5: bottomed"),
        ({"momentum_residual_ratio": 1e-3}, "- sand, bed 2, slip 0.5: the momentum misses 1.0e-03"),
        (
            {"history": travelled(-1.0).assign(sinkage_m=np.where(np.arange(301) > 280, 0.021, 0.02))},
            "- sand, bed 2, slip 0.5: not steady, the wheel still sank by 1.00 mm",
        ),
        ({"history": travelled(20.0)}, "- sand, bed 2, slip 0.5: the wheel pulls with more power than its motor gives"),
    ],
)
def test_a_run_that_is_not_as_it_should_be_is_named(tmp_path, change, expected):
    text = page_of(tmp_path, **change)
    assert expected in text
    assert "All runs are done" not in text


def test_warnings_stand_once_each_and_whole(tmp_path):
    one, other = "radius is 5; results depend on it below 14", "speed is 1; results depend on it above 0.005"
    text = page_of(tmp_path, warnings=f"{one} | {other}")
    assert [line for line in text.splitlines() if line.startswith("- ")][:2] == [f"- {one}", f"- {other}"]


def test_a_page_without_plates_and_cone_has_no_sections_for_them(tmp_path):
    runs = rows("wheel_run", seed=[1], radius_m=[0.1], asked_slip=[np.nan], held=["free"], momentum_residual_ratio=[0.0])
    table = wheel_table(runs, [travelled(1.0)], BEDS)
    results = Results(SOUND, {"wheel": table}, {"wheel": runs}, {"wheel": [travelled(1.0)]})
    write_page(results, tmp_path / "wheel.md", tmp_path / "figures")
    text = (tmp_path / "wheel.md").read_text(encoding="utf-8")
    assert "## Plate" not in text
    assert "| sand | 1 | free | done |" in text
    assert pd.isna(table["asked_slip"]).all()


def test_a_page_of_runs_that_all_broke_off_says_so(tmp_path):
    """Their histories have no rows; warnings are errors in these tests."""
    runs = rows("wheel_run", seed=[1], radius_m=[0.1], status=["failed"], reason=["grains fell"], max_overlap_ratio=[np.nan])
    none = travelled(1.0)[:0]
    results = Results(SOUND, {"wheel": wheel_table(runs, [none], BEDS)}, {"wheel": runs}, {"wheel": [none]})
    write_page(results, tmp_path / "wheel.md", tmp_path / "figures")
    assert "slip 0.5: failed (grains fell)" in (tmp_path / "wheel.md").read_text(encoding="utf-8")
