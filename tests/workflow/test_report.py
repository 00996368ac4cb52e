"""What the report says about its own numbers, and the declared names of its sections and experiments."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import conclude
from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.experiments.registry import BY_NAME, RESPONSES, responses_of
from virtual_soil.campaign.experiments.shear.curves import Curve
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.study import as_printed
from virtual_soil.report.contents import FIGURES, TABLES, figure_names
from virtual_soil.report.curves import curves_at, draw_beside, sheared_test
from virtual_soil.report.experiments import DECLARED, EXPERIMENTS, measured
from virtual_soil.report.experiments.repose import lift_remarks
from virtual_soil.report.quantities import VARIABLES, value_with_interval
from virtual_soil.report.sections import SECTIONS, soils
from virtual_soil.report.sections.answer import answer_card, answer_remarks, next_step, packing_table, undetermined
from virtual_soil.report.sections.soils import reach_remarks
from virtual_soil.report.sections.uncertainty import (
    coverage_figure,
    coverage_table,
    equivalents_table,
    narrowing_table,
    simulated_table,
)
from virtual_soil.report.sections.verification import best_table
from virtual_soil.report.study import Study as Finished

ANGLE = RESPONSES["angle_of_repose"]
REPORT = ROOT / "src" / "virtual_soil" / "report"
OF_EXPERIMENT = {
    "NAME": str, "TITLE": str, "SPECIMEN": str, "RESPONSES": dict, "FIGURES": dict,
    "STAGE": str, "CUT": bool, "EYE": tuple, "FLAT": bool, "DISPLACED_SINCE": str, "ASSUMPTIONS": tuple, "REMARKS": dict,
    "SHEARED": tuple, "SOLID_FRACTIONS": dict,
}  # fmt: skip
DONE_BY_EXPERIMENT = ("figures", "views", "packed_views", "period_m", "colour", "title", "facts")
OF_SECTION = {"NAME": str, "TITLE": str, "HEADING": str, "LINKS": dict, "FIGURES": dict, "TABLES": dict}

SET = {"case": "sand", "soil": "sand", "rank": 2, "radius_m": 2e-4, "static_friction": 0.5, "rolling_friction": 0.1}
RANGES = {"cohesion": (-20.0, 80.0), "friction_angle": (8.0, 58.0), "angle_of_repose": (0.0, 53.0)}


def tables(determined=True, **changes):
    row = {
        "case": "sand", "surrogate": "ours", "at_bound": "", "n_distinct": 1, "deviation_sd": 0.5, "missed": "", "extrapolated": "",
        "prediction": "confirmed", "match": "matches", "n_spoiled": 0,
        "cohesion_pa": 24.0, "friction_angle_deg": 30.0, "angle_of_repose_deg": 30.0,
        **{f"{name}{end}": value for name in VARIABLES for end, value in (("", 0.5), ("_low_95", 0.4), ("_high_95", 0.6))},
        **changes,
    }  # fmt: skip
    reach = [{"response": name, "lowest_simulated": low, "highest_simulated": high} for name, (low, high) in RANGES.items()]
    direction = {"case": "sand", "determined": determined, "component_radius_m": 0.05, "component_static_friction": 0.9,
                 "component_rolling_friction": -0.4}  # fmt: skip
    return {
        "calibration": pd.DataFrame([row]),
        "reachability": pd.DataFrame(reach),
        "identifiability": pd.DataFrame([direction]),
        "equivalents": pd.DataFrame([SET, {**SET, "radius_m": 4e-4}]),
    }


def remark(**changes):
    study = SimpleNamespace(tables=tables(**changes), responses=responses_of(("repose", "shear")))
    (text,) = answer_remarks(study)
    return text


def test_a_prediction_beyond_everything_simulated_is_called_so():
    expected = "The predicted cohesion, 282.0 Pa, lies beyond all that the campaign simulated (-20.0 to 80.0)"
    assert expected in remark(cohesion_pa=282.0)


def test_an_optimum_in_order_needs_no_remark():
    assert remark() == "sand: nothing to add."


def test_every_reason_for_doubt_is_named():
    assert "misses cohesion, friction angle, by up to 11 standard deviations" in remark(
        deviation_sd=10.8, missed="cohesion,friction_angle"
    )
    assert "extrapolated: cohesion, angle of repose" in remark(extrapolated="cohesion,angle_of_repose")
    assert "edge of the design (r, µs)" in remark(at_bound="radius_m,static_friction")
    assert "does not confirm what was predicted (contradicted: cohesion)" in remark(prediction="contradicted: cohesion")
    assert "too few or too small to decide" in remark(match="not decided: friction_angle")
    assert "3 distinct minima" in remark(n_distinct=3)
    assert "µs lies outside the 95 % interval: the optimum weighs errors" in remark(static_friction=0.7)
    assert "µr lies outside the 95 % interval: the optimum also prefers large grains" in remark(
        rolling_friction=0.3, weight_large_grains=0.25
    )
    assert "Parameters can be traded" in remark(determined=False)


def test_a_fixed_radius_is_said_to_be():
    row = {"radius_m": 1e-3, "radius_m_low_95": 1e-3, "radius_m_high_95": 1e-3}
    assert value_with_interval(row, "radius_m") == ("1000", "fixed")
    assert value_with_interval(row | {"radius_m_high_95": 2e-3}, "radius_m") == ("1000", "1000 to 2000")


CARD = {
    "case": "sand", "match": "matches", "prediction": "confirmed", "n_spoiled": 0, "max_overlap_ratio": 0.03,
    **{f"{name}{end}": 0.5 for name in VARIABLES for end in ("", "_low_95", "_high_95")},
}  # fmt: skip
LINE = {"response": "cohesion", "simulated": 20.0, "simulated_se": 1.0, "target": 24.0, "match": "matches"}


def card(**changes):
    return answer_card({**CARD, **changes}, pd.DataFrame([LINE]))


def test_a_card_is_green_only_if_all_targets_are_matched_and_nothing_there_was_spoiled():
    assert card()["state"] == "good"
    assert not card()["spoiled"]
    assert not card()["soft"]
    assert card(match="not decided: cohesion")["state"] == "open"
    assert card(match="misses: cohesion")["state"] == "bad"
    assert card(n_spoiled=2)["state"] == "bad"
    assert card(n_spoiled=2)["spoiled"] == "2 of its simulations failed or did not come to rest"


def test_grains_that_overlap_too_much_are_on_the_card():
    assert card(max_overlap_ratio=0.13)["soft"].startswith("grains overlap by up to 13% of r in its simulations, more than 5%")
    assert card(max_overlap_ratio=float("nan"))["soft"] == ""


@pytest.mark.parametrize(
    ("section", "key", "value", "left"),
    [
        ("material", "density_kg_m3", 2650.0, []),
        ("engine", "gravity_m_s2", 1.62, []),
        ("design", "geometry", "fixed", []),
        ("repose", "n_particles", 700, ["shear"]),
        ("grading", "distribution", "log_normal", []),
        ("repose_test", "lift_speed_m_s", 0.01, ["shear"]),
        ("shear", "width_ratio", 6.0, ["repose"]),
        ("shear", "normal_stresses_pa", [100.0, 200.0, 400.0], ["shear", "repose"]),
    ],
)
def test_the_paper_stands_beside_studies_of_its_material_and_protocol_only(section, key, value, left):
    config = defaults(Study) | {"experiments": ["repose", "shear"]}
    assert as_printed(config) == ["shear", "repose"]
    config[section][key] = value
    assert as_printed(config) == left


def test_a_study_shows_the_figures_of_its_own_experiments():
    config = defaults(Study)
    box = figure_names(config | {"experiments": ["repose", "shear"]})
    assert "plane_shear_curves" not in box
    assert {"shear_curves", "cohesion", "lift"} <= set(box)
    assert "laboratory" not in box
    assert "laboratory" in figure_names(config, laboratory={"silica_barco_sand"})
    assert "radius_sweep" in box
    fixed = config | {"design": config["design"] | {"variables": ["static_friction", "rolling_friction"]}}
    assert "radius_sweep" not in figure_names(fixed)
    planar = figure_names(config | {"experiments": ["repose", "plane_shear"]})
    assert not {"shear_curves", "cohesion"} & set(planar)
    assert {"plane_shear_curves", "steady_friction_angle", "lift"} <= set(planar)


def text_of_soils(*rows):
    config = {"experiments": ["repose", "shear"]}
    return soils.words(SimpleNamespace(config=config, tables={"reachability": pd.DataFrame(rows)}))["remarks"]


def test_a_target_out_of_reach_is_told_with_the_way_on():
    row = {"soil": "moon", "response": "angle_of_repose", "target": 65.0, "reachable": False, "lowest_predicted": 0.0,
           "highest_predicted": 53.21, "nearest_reachable": 53.21, "grows_with": "+rolling_friction, -radius_m"}  # fmt: skip
    (text,) = reach_remarks(pd.DataFrame([row, {**row, "reachable": True}]))
    assert len(text_of_soils({**row, "reachable": True}, row)) == 1
    assert "without adhesion" in text_of_soils({**row, "response": "cohesion"})[-1]
    assert "The angle of repose of moon, 65, is out of reach: the design gives 0.0 to 53.2." in text
    assert "would go on with +µr, -r." in text


def test_the_coverage_is_counted():
    levels = pd.DataFrame({"kind": ["made up"] * 4 + ["simulated"], "credible_level": [0.1, 0.6, 0.92, 0.99, 0.3]})
    table = coverage_table(levels)
    assert table.to_numpy().tolist() == [["made up", 4, "25%", "50%", "75%"], ["simulated", 1, "100%", "100%", "100%"]]
    (axes,) = coverage_figure(levels).figure.axes
    assert axes.lines[1].get_xydata().tolist() == [[0.1, 0.25], [0.6, 0.5], [0.92, 0.75], [0.99, 1.0]]


def test_equivalent_sets_are_a_table_to_pick_from():
    table = equivalents_table(pd.DataFrame([{**SET, "angle_of_repose_deg": 30.04}]), {"angle_of_repose": ANGLE})
    assert table.iloc[0].tolist() == ["sand", 2, "200", "0.50", "0.100", "30.0"]


def test_only_responses_with_a_weight_are_called_targets():
    config = defaults(Study)
    config["optimise"]["cases"] = [{"case": "a", "weights": {"angle_of_repose": 1}}, {"case": "b", "weights": {"cohesion": 1}}]
    responses = responses_of(("repose", "shear"))
    study = SimpleNamespace(config=config, responses=responses)
    assert list(Finished.wanted.fget(study)) == [name for name in responses if name in ("angle_of_repose", "cohesion")]


def test_what_would_narrow_a_parameter_is_told_of_each_response_that_a_case_leaves():
    generator = np.random.default_rng(3)
    posterior = pd.DataFrame({"case": "sand", "static_friction": generator.uniform(0.2, 0.8, 500)})
    posterior["rolling_friction"] = generator.uniform(0.05, 0.15, 500)
    posterior["cohesion_pa"], posterior["friction_angle_deg"] = 0.0, 20.0 + 30.0 * posterior["static_friction"]
    responses = {name: RESPONSES[name] for name in ("angle_of_repose", "cohesion", "friction_angle")}
    config = {
        "verify": {"difference_of_consequence": {"cohesion_pa": 20.0, "friction_angle_deg": 2.0}},
    }
    variables = ["static_friction", "rolling_friction"]
    table = narrowing_table(posterior, variables, responses, {"sand": {"angle_of_repose"}}, config)
    assert list(table["expected"]) == ["0 ± 10", "34.94 ± 1"]  # none is read better than to half of what matters
    assert float(table["µr"].iloc[1]) > 0.95
    assert table["µs"].iloc[0] == "1.00"
    assert float(table["µs"].iloc[1]) == pytest.approx(1.0 / 30.0 / (0.6 / np.sqrt(12.0)), abs=0.05)
    assert list(table["halves µr at"]) == ["–", "–"]
    assert float(table["halves µs at"].iloc[1].removeprefix("± ")) == pytest.approx(2.9, abs=0.4)
    assert narrowing_table(posterior, variables, responses, {"sand": set(responses)}, config).empty


def test_simulated_equivalents_say_whether_they_meet_the_targets():
    line = {**SET, "response": "angle_of_repose", "simulated": 31.0, "simulated_se": 0.4, "match": "misses"}
    table = simulated_table(pd.DataFrame([line]), {"angle_of_repose": ANGLE})
    assert table.iloc[0].tolist() == ["sand", 2, "200", "0.50", "0.100", "31.0 ± 0.4", "misses: angle of repose"]
    assert simulated_table(None, {"angle_of_repose": ANGLE}).empty


def test_what_can_be_traded_is_told_by_the_farthest_sets():
    free = pd.DataFrame([{"case": "sand", "determined": False}])
    sets = pd.DataFrame(
        [SET, {**SET, "radius_m": 4e-4, "static_friction": 1.2}, {**SET, "radius_m": 1e-4, "rolling_friction": 0.2}]
    )
    (sentence,) = undetermined("sand", free, sets)
    assert "100 µm, 0.500, 0.2000 from 400 µm, 1.200, 0.1000" in sentence
    assert undetermined("sand", free.assign(determined=True), sets) == []


@pytest.mark.parametrize(
    ("match", "spoiled", "words"),
    [
        ("matches", 0, "export/sand"),
        ("misses: cohesion; not decided: angle_of_repose", 0, "within reach"),
        ("not decided: angle_of_repose", 0, "verify.more_seeds"),
        ("not simulated", 0, "why no simulation of it ended well"),
    ],
)
def test_the_card_says_what_to_do_next(match, spoiled, words):
    assert words in next_step({"case": "sand", "match": match, "n_spoiled": spoiled})


def test_the_best_simulated_points_are_those_nearest_to_the_targets():
    points = [
        {"point_id": name, "fidelity": "campaign", "purposes": "grid", "radius_m": radius, "static_friction": 0.5,
         "rolling_friction": 0.1, "seed": seed, "angle_of_repose_deg": angle + seed}
        for name, radius, angle in (("far", 5e-5, 40.0), ("near", 1e-4, 28.5), ("flat", 2e-4, 3.0)) for seed in (1, 2)
    ]  # fmt: skip
    tables = {"repose": pd.DataFrame(points)}
    line = {"case": "sand", "response": "angle_of_repose", "target": 30.0, "target_se": 1.0, "match": "misses"}
    tables["verification"] = pd.DataFrame([line])
    config = defaults(Study) | {"experiments": ["repose"], "optimise": {"cases": [{"case": "sand"}]}}
    shown = {name: VARIABLES[name] for name in config["design"]["variables"]}
    study = SimpleNamespace(config=config, tables=tables, every=tables, responses={"angle_of_repose": ANGLE}, variables=shown)
    table = best_table(study)
    assert table["r (µm)"].tolist() == ["100.0", "50.0", "200.0"]
    se = np.sqrt(0.5) / np.sqrt(2)
    assert table["distance"].tolist()[:2] == ["0.0", f"{11.5 / np.hypot(1.0, se):.1f}"]
    tables["verification"] = pd.DataFrame([{**line, "match": "not asked"}])
    assert best_table(study).empty


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda experiment: experiment.NAME)
def test_every_experiment_declares_what_the_report_asks_of_it(experiment):
    assert {name: type(getattr(experiment, name)) for name in OF_EXPERIMENT} == OF_EXPERIMENT
    assert all(callable(getattr(experiment, name)) for name in DONE_BY_EXPERIMENT)
    assert set(experiment.REMARKS) <= {section.NAME for section in SECTIONS}
    assert set(DECLARED) == {*OF_EXPERIMENT, *DONE_BY_EXPERIMENT}


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.NAME)
def test_every_section_declares_what_the_page_asks_of_it(section):
    assert {name: type(getattr(section, name)) for name in OF_SECTION} == OF_SECTION
    assert all(callable(getattr(section, name)) for name in ("figures", "tables", "words"))
    assert (REPORT / "sections" / f"{section.NAME}.html.j2").is_file()


@pytest.mark.parametrize(("folder", "listed"), [("experiments", EXPERIMENTS), ("sections", SECTIONS)])
def test_every_module_beside_a_list_is_in_it(folder, listed):
    modules = {path.stem for path in (REPORT / folder).glob("*.py")} - {"__init__"}
    assert modules == {module.__name__.rpartition(".")[2] for module in listed}


def test_every_response_belongs_to_one_experiment():
    named = [name for experiment in EXPERIMENTS for name in experiment.RESPONSES]
    assert sorted(named) == sorted(RESPONSES)
    for experiment in EXPERIMENTS:
        assert set(experiment.RESPONSES) == {response.name for response in BY_NAME[experiment.NAME].RESPONSES}
    assert [response.name for response in measured(EXPERIMENTS)] == named


def test_no_figure_or_table_is_listed_twice():
    assert len(FIGURES) == sum(len(section.FIGURES) for section in SECTIONS)
    assert len(TABLES) == sum(len(section.TABLES) for section in SECTIONS)


def test_only_the_modules_of_experiments_name_them():
    """Elsewhere in the report a list of experiments, or a branch on one, would have to be extended for another."""
    names = [f'"{name}"' for experiment in EXPERIMENTS for name in (experiment.NAME, *experiment.RESPONSES)]
    others = [path for path in REPORT.rglob("*") if path.suffix in {".py", ".js", ".j2"} and path.parent.name != "experiments"]
    others += [ROOT / "workflow" / "scripts" / f"{name}.py" for name in ("report", "animate", "record_lift", "export")]
    others += [ROOT / "workflow" / "rules" / "pictures.smk"]
    assert len(others) > 20
    assert [(path.name, name) for path in others for name in names if name in path.read_text()] == []


def test_the_lift_is_the_laboratorys_and_nothing_is_said_of_a_tube_that_does_not_grow():
    config, table = defaults(Study), pd.DataFrame({"parameter": ["radius_m"], "changed_value": [1e-4]})
    assert "from 0.226 to 0.160" in lift_remarks(table, config)[0]
    config["repose_test"] |= {"lift_speed_m_s": 0.01, "gravity_m_s2": "moon"}
    assert "from 1.111 to 0.786" in lift_remarks(table, config)[0]  # 0.01 / sqrt(1.62 * 5e-5)
    config["repose_test"] |= {"tube_diameter_m": 0.05, "fill_height_m": 0.1}
    assert lift_remarks(table, config) == []


def study_of_beds():
    """A study with two heaps and two beds at its optimum, and a heap elsewhere."""
    config = defaults(Study)
    config["design"] |= {"variables": ["static_friction"], "grid": {}}
    place = {"static_friction": 0.4, "fidelity": "campaign", "density_kg_m3": 2500.0}
    heaps = [{**place, "simulation_id": k, "poured_solid_fraction": v} for k, v in (("a", 0.55), ("b", 0.57))]
    heaps.append({**place, "simulation_id": "c", "static_friction": 0.7, "poured_solid_fraction": 0.4})
    beds = [
        {
            **place,
            "simulation_id": f"bed {p:g}",
            "solid_fraction": 0.6,
            "steady_solid_fraction": 0.5,
            "normal_stress_pa": p,
            "seed": 1,
        }
        for p in (1e3, 2e3)
    ]
    optimum = pd.DataFrame([{"case": "sand", "surrogate": "ours", "static_friction": 0.4}])
    every = {"repose": pd.DataFrame(heaps), "plane_shear": pd.DataFrame(beds)}
    histories = {
        f"bed {p:g}": pd.DataFrame({"shear_strain": [0.0, 1.0], "shear_stress_pa": [0.3 * p, 0.5 * p], "plane_normal_stress_pa": p})
        for p in (1e3, 2e3)
    }
    return SimpleNamespace(config=config, tables={"calibration": optimum}, every=every, histories=histories)


def test_solid_fraction_void_ratio_and_bulk_density_are_those_of_the_optimum():
    table = packing_table(study_of_beds()).set_index("state")
    assert table.loc["poured into the tube"].tolist() == ["sand", "0.560", "0.786", "1400", 2]
    assert table.loc["steadily sheared"].tolist() == ["sand", "0.500", "1.000", "1250", 2]


def test_curves_of_laboratory_and_optimum_are_drawn_over_their_normal_stress():
    study = study_of_beds()
    simulated = curves_at(study, study.tables["calibration"].iloc[0])
    curve = Curve("1", np.array([0.0, 1e-3]), np.array([2e4, 6e4]), np.array([1e5, 1e5]))
    figure = draw_beside(SimpleNamespace(curves=[curve]), simulated, sheared_test(study.config).SHEARED)
    left, right = figure.axes
    assert [line.get_ydata().tolist() for line in left.lines] == [[0.2, 0.6]]
    assert [line.get_ydata().tolist() for line in right.lines] == [[0.3, 0.5]] * 2
    assert left.lines[0].get_xdata().tolist() == [0.0, 1.0]  # mm


def test_a_table_without_rows_leaves_whole_numbers_whole():
    joined = conclude.joined([pd.DataFrame({"n": [1, 2]}), pd.DataFrame({"n": pd.Series(dtype=float)})])
    assert joined["n"].dtype.kind == "i"
