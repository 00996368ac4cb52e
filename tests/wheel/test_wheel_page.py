"""The page says whether the soil is confirmed, what was found, and which runs are not as they should be."""

import numpy as np
import pandas as pd
import pytest
from made_up_runs import BEDS, pressed, rows, travelled

from virtual_soil.campaign.tables import check_table
from virtual_soil.wheel import figures
from virtual_soil.wheel.measured import cone_table, plate_table, wheel_table
from virtual_soil.wheel.page import Results, assumptions, density, write_page

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
    soils = {"sand": {"radius_m": 1e-3, "static_friction": 0.5, "aspect_ratio": None}}
    results = Results(verdicts, tables, runs, histories, soils=soils, engine={"gravity_m_s2": 9.81})
    write_page(results, folder / "wheel.md", folder / "wheel/figures")
    return (folder / "wheel.md").read_text(encoding="utf-8")


def test_the_first_line_says_that_the_answer_is_confirmed(tmp_path):
    text = page_of(tmp_path)
    assert text.splitlines()[0] == "The soil's answer is confirmed by simulation and matches its targets: sand."
    assert "All runs are done, steady, and balance." in text
    for figure in ("wheel", "wheel_over_time", "plate", "cone"):
        assert f"](wheel/figures/{figure}.png)" in text
        assert (tmp_path / f"wheel/figures/{figure}.png").stat().st_size > 5000


def test_the_soil_card_has_the_grains_and_the_engine(tmp_path):
    card = page_of(tmp_path).split("## Soil card")[1]
    for line in (
        "| `radius_m` | 0.001 |",
        "| `static_friction` | 0.5 |",
        "| `aspect_ratio` | – |",
        "| `engine.gravity_m_s2` | 9.81 |",
    ):
        assert line in card


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


def point_of(quantity, verdict, predicted, measured, **where):
    """A compared point of a made-up file."""
    values = {"case": "sand", "tool": "wheel", "quantity": quantity, "slip": 0.5, "diameter_m": np.nan, "at_m": np.nan}
    values |= {"measured": measured, "measured_sd": np.nan, "predicted": predicted, "predicted_error": 1e-3, "n_beds": 2}
    return values | {"difference": predicted - measured, "allowed": 0.05, "verdict": verdict} | where


def beside(folder, *points, handbook=None):
    """Page of two runs of a wheel and a plate with these points beside them."""
    runs = {"wheel": rows("wheel_run", seed=[1, 2], radius_m=[0.1, 0.1], asked_slip=[0.5, 0.5])}
    runs["plate"] = rows("press_run", seed=[1], diameter_m=[0.04], depth_m=[0.025], warnings=["near to its images"])
    histories = {"wheel": [travelled(3.0), travelled(-1.0)], "plate": [pressed(2e6, 1.2)]}
    measure = {"wheel": wheel_table, "plate": plate_table}
    tables = {tool: measure[tool](runs[tool], histories[tool], BEDS) for tool in runs}
    table = check_table(pd.DataFrame(points), "wheel_measured", "points") if points else None
    results = Results(SOUND, tables, runs, histories, measured=table, handbook=handbook, sources=("J. Doe 2001", "J. Doe 2001"))
    write_page(results, folder / "wheel.md", folder / "figures")
    return (folder / "wheel.md").read_text(encoding="utf-8")


SINKAGE = point_of("sinkage_m", "agrees", 0.0205, 0.0201, allowed=0.006)
PRESSURE = {"tool": "plate", "slip": np.nan, "diameter_m": 0.04, "at_m": 0.01}


def test_points_stand_on_the_page_with_their_source_and_verdict(tmp_path):
    pull = point_of("drawbar_ratio", "misses", -0.091, 0.028, measured_sd=0.007)
    pressure = point_of("pressure_pa", "no criterion", 7.9e3, 7.7e3, allowed=np.nan, **PRESSURE)
    text = beside(tmp_path, SINKAGE, pull, pressure)
    assert text.count("- J. Doe 2001") == 1
    assert "🔴 **1 of 2 verdicts agree, 1 miss**." in text
    assert "| sand | sinkage (mm) | s = 0.5 | 20.5 ± 1.0 | 20.1 | 2 | 0.4 | 6.0 | 🟢 agrees |" in text
    assert "| sand | F_DP/W | s = 0.5 | -0.091 ± 0.001 | 0.028 ± 0.007 | 2 | -0.119 | 0.050 | 🔴 **misses** |" in text
    assert "| sand | pressure (kPa) | 40 mm plate, 10 mm | 7.90 ± 0.00 | 7.70 | 2 | 0.20 | – | no criterion |" in text
    assert "| sand | F_DP/W | within 0.05 | 0 | 1 | 0 | 0 |" in text
    assert "- near to its images" in text.split("## Plate")[1]


def test_the_page_is_green_only_if_no_point_misses(tmp_path):
    sign = point_of("drawbar_sign", "not decided", 0.001, 0.028, allowed=np.nan)
    away = point_of("sinkage_m", "not run", np.nan, 0.02, slip=0.9, n_beds=0)
    assert "🟢 1 of 1 verdicts agree; 1 not decided, 1 not run." in beside(tmp_path, SINKAGE, sign, away)
    assert "**No measured point has a verdict.**" in beside(tmp_path, sign)


def shown(figure):
    """Label -> x, y of what is drawn, for each axes of a figure."""
    found = []
    for axes in figure.axes:
        labelled = zip(*axes.get_legend_handles_labels(), strict=True)
        found.append({label: np.array(getattr(drawn, "lines", [drawn])[0].get_data()) for drawn, label in labelled})
    return found


def test_measured_points_and_the_handbooks_line_are_drawn_at_their_values():
    table = wheel_table(rows("wheel_run", seed=[1], radius_m=[0.1], asked_slip=[0.5]), [travelled(3.0)], BEDS)
    points = [SINKAGE, SINKAGE | {"case": "clay"}, point_of("drawbar_ratio", "misses", 0.0, 0.03, slip=0.9, measured_sd=0.01)]
    line = rows("wheel_handbook", case=["", ""], slip=[0.0, 0.5], sinkage_m=[0.021, 0.023], drawbar_ratio=[-0.2, np.nan])
    pull, torque, sinkage, efficiency = shown(figures.against_slip(table, pd.DataFrame(points), line))
    assert pull["measured"].tolist() == [[0.9], [0.03]]
    assert sinkage["measured"] == pytest.approx(np.array([[0.5], [20.1]]))  # once, of two cases
    assert "measured" not in torque
    names = [axes.get_ylabel() for axes in figures.against_slip(table, pd.DataFrame(points), line).axes]
    assert names == ["drawbar pull over load", "torque over load and radius", "sinkage (mm)", "efficiency"]
    assert "handbook" not in efficiency
    assert sinkage["handbook"] == pytest.approx(np.array([[0.0, 0.5], [21.0, 23.0]]))
    drawn = figures.against_slip(table, pd.DataFrame(points)).axes[0].containers[-1]
    ((low, high),) = (segment[:, 1] for segment in drawn[2][0].get_segments())
    assert (low, high) == (pytest.approx(0.02), pytest.approx(0.04))


def test_only_a_wheel_that_pulls_has_an_efficiency():
    runs = rows("wheel_run", seed=[1, 1], radius_m=[0.1, 0.1], asked_slip=[0.5, 0.2])
    table = wheel_table(runs, [travelled(3.0), travelled(-1.0)], BEDS)
    efficiency = shown(figures.against_slip(table))[3]
    assert efficiency["sand, bed 1"] == pytest.approx(np.array([[0.5], [table["efficiency"].iloc[0]]]))
    measured = pd.DataFrame([{"tool": "wheel", "quantity": "sinkage_m", "slip": 0.2, "measured": 0.01, "measured_sd": 0.001}])
    drawn = figures.against_slip(table.assign(drawbar_pull_n=-1.0), measured).axes[3]
    assert ([text.get_text() for text in drawn.texts], list(drawn.get_yticks())) == (["no wheel pulls"], [])
    assert not figures.against_slip(table).axes[3].texts


def test_the_band_is_that_of_the_beds_scatter_or_of_the_runs_own_errors():
    runs = pd.DataFrame({"asked_slip": [0.2, 0.2, 0.5], "x": [1.0, 3.0, 4.0], "x_error": [0.1, 0.1, 0.5]})
    found = figures.means_of(runs, "x", "x_error")
    assert found.loc[0.2].tolist() == pytest.approx([2.0, 0.0, 4.0])  # beds differ by 2: standard error 1
    assert found.loc[0.5].tolist() == pytest.approx([4.0, 3.0, 5.0])
    close = figures.means_of(runs.assign(x=[2.0, 2.0, 4.0]), "x", "x_error").loc[0.2]
    assert close.tolist() == pytest.approx([2.0, 2.0 - 0.2 / np.sqrt(2.0), 2.0 + 0.2 / np.sqrt(2.0)])


def test_measured_pressures_are_drawn_by_diameter():
    runs = rows("press_run", seed=[1], diameter_m=[0.04], depth_m=[0.025])
    points = [
        point_of("pressure_pa", "agrees", 8e3, 7.7e3, **PRESSURE),
        point_of("pressure_growth", "agrees", 2.0, 2.0, **PRESSURE),
    ]
    (axes,) = shown(figures.pressed(runs, [pressed(2e6, 1.2)], "plate", pd.DataFrame([*points, SINKAGE])))
    assert axes["measured, 40 mm"] == pytest.approx(np.array([[10.0], [7.7]]))


def test_the_page_says_what_the_handbooks_line_is_made_of(tmp_path):
    values = {
        "case": ["", ""],
        "diameter_m": [0.06] * 2,
        "k_pa_m_n": [3.6e6] * 2,
        "n": [1.34] * 2,
        "internal_friction_angle_deg": [29.0] * 2,
    }
    values |= {"cohesion_pa": [0.0] * 2, "shear_displacement_m": [0.01] * 2, "slip": [0.0, 0.5], "sinkage_m": [0.02, np.nan]}
    line = rows("wheel_handbook", **values)
    text = beside(tmp_path, handbook=line)
    assert "k = 3.6e+06 Pa/mⁿ and n = 1.34 of the measured plate of 60 mm; stated: φ = 29°, c = 0 Pa, K = 10 mm." in text
    assert "Its line ends where the wheel would sink to its axle." in text
    assert "Beside measurements" not in text
    assert "of the simulated plate of 60 mm on sand" in beside(tmp_path, handbook=line.assign(case="sand"))
    assert "No plate gave a law" in beside(tmp_path, handbook=line[:0])


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (None, "Bulk density of the beds 1320 to 1340 kg/m³."),
        (1330.0, "Bulk density of the beds 1320 to 1340 kg/m³, asked for 1330 kg/m³."),
        (1300.0, "Bulk density of the beds 1320 to 1340 kg/m³, **asked for 1300 kg/m³: off by 3.1 %**."),
    ],
)
def test_beds_that_miss_their_density_are_said_to(asked, said):
    assert density(pd.DataFrame({"bulk_density_kg_m3": [1340.0, 1320.0]}), asked) == said
