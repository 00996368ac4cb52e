"""The inference works on any responses: two made-up ones, a regression and a mean over runs, from fit to verification."""

import ast
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from virtual_soil import calibration
from virtual_soil.calibration.checks import reachability_table
from virtual_soil.calibration.models import fit_all, from_json, to_json
from virtual_soil.calibration.noise import scatter_at, student
from virtual_soil.calibration.optimise import calibrate
from virtual_soil.calibration.points import point_at, point_id
from virtual_soil.calibration.response import Response
from virtual_soil.calibration.space import space_of
from virtual_soil.calibration.twin import left_out_points, twin_soil
from virtual_soil.calibration.uncertainty import identifiability, likelihood_of, posterior_table, sample
from virtual_soil.calibration.verify import comparison_table, conclusion

RESPONSES = {
    response.name: response
    for response in (
        Response(name="zeal", column="zeal_n", unit="N", symbol="z", table="pull", error_column="zeal_se_n", smallest_scale=1.0),
        Response(name="moisture", column="moisture_percent", unit="%", symbol="m", table="oven"),
    )
}
MATERIAL = {"radius_m": 1e-3, "static_friction": 0.5, "density_kg_m3": 2650.0}
DESIGN = {
    "variables": ["static_friction", "radius_m"],
    "grid": {"static_friction": [0.0, 0.25, 0.5, 0.75, 1.0]},
    "sweep": {"radius_m": [5e-4, 1e-3, 2e-3]},
    "sweep_couples": [{"static_friction": 0.25}, {"static_friction": 0.75}],
}
FORMS = dict.fromkeys(RESPONSES, {"f": "quadratic", "g": "log", "model": "quadratic"})
OPTIONS = {"tolerance": 1e-3, "max_iterations": 50, "n_starts": 4, "unreachable": "nearest"}
#: The term for large grains sorts before both responses; it is the last of the campaign's own.
CASE = {"case": "field", "soil": "field", "weights": {"zeal": 0.5, "moisture": 0.5, "large_grains": 1e-6}}
TRUTH = {"radius_m": 1.5e-3, "static_friction": 0.6}


def truth_of(name, friction, radius):
    size = np.log(radius / 1e-3)
    return {"zeal": (40 + 80 * friction) * (1 - 0.2 * size), "moisture": (5 + 6 * friction**2) * (1 + 0.3 * size)}[name]


def simulated(materials, seeds=(1, 2, 3)):
    """Tables of simulations: one regression per point, one oven run per point and seed."""
    random, pull, oven = np.random.default_rng(3), [], []
    for values in materials:
        material = {**MATERIAL, **values}
        common = {**material, "point_id": point_id(material), "fidelity": "campaign", "purposes": "grid"}
        zeal, moisture = (truth_of(name, material["static_friction"], material["radius_m"]) for name in RESPONSES)
        line = {"zeal_n": zeal + 0.5 * random.standard_normal(), "zeal_se_n": 0.5, "relative_scatter": 0.1, "n_runs": 8}
        pull.append({**common, **line})
        oven += [{**common, "seed": seed, "moisture_percent": moisture + 0.05 * random.standard_normal()} for seed in seeds]
    return {"pull": pd.DataFrame(pull), "oven": pd.DataFrame(oven)}


@pytest.fixture(scope="module")
def campaign():
    """Tables, both models and the chosen ones of a campaign."""
    points = [{"static_friction": value} for value in DESIGN["grid"]["static_friction"]]
    points += [{**couple, "radius_m": r} for couple in DESIGN["sweep_couples"] for r in DESIGN["sweep"]["radius_m"] if r != 1e-3]
    tables = simulated(points)
    models, residuals = fit_all(RESPONSES, tables, DESIGN, MATERIAL, FORMS)
    assert set(residuals["response"]) == set(RESPONSES)
    text = to_json(models, FORMS)
    return tables, from_json(text), from_json(text, "gaussian_process")


def soil(**changed):
    values = {name: float(truth_of(name, TRUTH["static_friction"], TRUTH["radius_m"])) for name in RESPONSES} | changed
    rows = [("field", name, value, 0.02 * value) for name, value in values.items()]
    return pd.DataFrame(rows, columns=["soil", "property", "value", "standard_uncertainty"])


def optimum_of(models, soils):
    optima, _, minima = calibrate(RESPONSES, models, soils, {**OPTIONS, "cases": [CASE]}, DESIGN["variables"], "ours")
    assert len(minima) >= 1
    return optima


def test_the_parameters_of_a_made_up_soil_are_found(campaign):
    _, models, _ = campaign
    optimum = optimum_of(models, soil()).iloc[0]
    assert optimum["static_friction"] == pytest.approx(0.6, rel=0.05)
    assert optimum["radius_m"] == pytest.approx(1.5e-3, rel=0.1)
    assert (optimum["weight_moisture"], optimum["weight_zeal"], optimum["weight_large_grains"]) == (0.5, 0.5, 1e-6)
    assert optimum["moisture_percent"] == pytest.approx(optimum["target_moisture_percent"], rel=0.01)


def test_its_posterior_and_answer_have_the_made_up_responses(campaign):
    _, models, processes = campaign
    space = space_of(DESIGN)
    likelihood = likelihood_of(CASE, RESPONSES, models, soil(), space, 0.05)
    assert likelihood.weights == {"moisture": 1.0, "zeal": 1.0}
    by_hand = sum(likelihood.term(name, space.values(np.array([[0.3, 0.7]]))) for name in RESPONSES)
    assert likelihood(np.array([[0.3, 0.7]])) == pytest.approx(by_hand)
    posterior = posterior_table(CASE, likelihood, *sample(likelihood, 500))
    assert posterior["static_friction"].mean() == pytest.approx(0.6, abs=0.1)
    directions = identifiability(CASE, likelihood, TRUTH)
    assert directions["determined"].tolist() == [True, True]
    unverified = pd.DataFrame(columns=["case", "response", "prediction", "match", "n_spoiled", "max_overlap_ratio"])
    answer = conclusion(optimum_of(models, soil()), posterior, unverified, {"field": likelihood}, processes).iloc[0]
    assert answer["moisture_percent_low_95"] < answer["moisture_percent"] < answer["moisture_percent_high_95"]
    assert answer["missed"] == ""
    assert left_out_points(RESPONSES, processes, space)["credible_level"].median() < 0.95


@pytest.mark.parametrize(("seeds", "moisture_se"), [((1, 2, 3, 4), "own"), ((1, 2), "known")])
def test_simulating_the_optimum_is_compared_with_its_prediction(campaign, seeds, moisture_se):
    tables, models, _ = campaign
    optima = optimum_of(models, soil())
    values = {name: optima[name].iloc[0] for name in DESIGN["variables"]}
    verification = simulated([point_at(MATERIAL, values)], seeds)
    line = verification["pull"].iloc[0]
    own = {"point_id": line["point_id"], "zeal_n": line["zeal_n"] + 0.1 * np.arange(len(seeds))}
    by_seed = {"zeal": pd.DataFrame(own), "moisture": verification["oven"]}
    space = space_of(DESIGN)
    scatter = {name: partial(scatter_at, response, tables[response.table], space) for name, response in RESPONSES.items()}
    assert scatter["zeal"](values)[0] == pytest.approx(0.1)
    errors, numbers = {("field", name): 1.0 for name in RESPONSES}, {response.column: 1.0 for response in RESPONSES.values()}
    limits = {"difference_of_consequence": numbers, "standard_error": numbers}
    table = comparison_table(RESPONSES, optima, models, verification, by_seed, scatter, errors, limits, {}, {}, MATERIAL)
    table = table.set_index("response")
    assert list(table.index) == ["zeal", "moisture"]
    assert table["unit"].tolist() == ["N", "%"]
    assert table["n_seeds"].tolist() == [len(seeds)] * 2
    heaps = verification["oven"]["moisture_percent"]
    assert table.loc["moisture", "simulated"] == pytest.approx(heaps.mean())
    expected = heaps.std() / 2 * student(3) if moisture_se == "own" else scatter["moisture"](values)[0] / np.sqrt(2)
    assert table.loc["moisture", "simulated_se"] == pytest.approx(expected)
    if moisture_se == "known":  # the regression's own error, moderated by a scatter that equals it
        freedom = line["n_runs"] - 2
        assert table.loc["zeal", "simulated_se"] == pytest.approx(0.5 * student(6 + freedom) / student(freedom))
    assert table.loc["moisture", "gap"] == pytest.approx(heaps.mean() - optima["moisture_percent"].iloc[0])


def test_an_unreachable_target_and_a_twin_of_made_up_responses(campaign):
    tables, models, _ = campaign
    reach = reachability_table(RESPONSES, models, space_of(DESIGN), tables, soil(moisture=90.0), 0.05).set_index("response")
    assert reach["reachable"].to_dict() == {"zeal": True, "moisture": False}
    assert reach.loc["moisture", "highest_simulated"] == tables["oven"]["moisture_percent"].max()
    twin = twin_soil(
        "hidden", {"radius_m": 1e-3, "static_friction": 0.5, "oven_seeds": [1, 2]}, RESPONSES, tables, DESIGN, MATERIAL
    )
    here = tables["oven"].query("static_friction == 0.5 and radius_m == 1e-3 and seed < 3")["moisture_percent"]
    assert twin.set_index("property")["value"]["moisture"] == pytest.approx(here.mean())
    assert twin["unit"].tolist() == ["N", "%"]


#: Modules that belong to the two tests of the paper, not to the inference.
OF_THE_TESTS = {"design.py", "laboratory.py", "mohr_coulomb.py", "soil.py"}


def test_only_the_paper_names_responses():
    for path in sorted(Path(calibration.__file__).parent.glob("*.py")):
        if path.name in OF_THE_TESTS:
            continue
        words = [node.value for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Constant)]
        found = [word for word in words if isinstance(word, str) and any(name in word for name in calibration.paper.RESPONSES)]
        assert not found, path


def test_no_response_reaches_below_zero_unless_it_is_signed(campaign):
    tables, models, _ = campaign
    below = {
        name: SimpleNamespace(predict=lambda values, model=model: model.predict(values) - 1e3) for name, model in models.items()
    }
    reach = reachability_table(RESPONSES, below, space_of(DESIGN), tables, soil(), 0.05).set_index("response")
    assert (reach["lowest_predicted"] == 0.0).all()
