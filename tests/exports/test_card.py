"""The material card says everything, in plain JSON, and obeys its schema."""

import copy
import json

import jsonschema
import pytest

from virtual_soil.exports import check_card


def test_the_card_holds_the_answer_its_intervals_and_its_doubts(make_card):
    card = make_card()
    assert json.loads(json.dumps(card, allow_nan=False)) == card
    assert card["parameters"]["static_friction"] | {"meaning": ""} == {
        "value": 0.4, "unit": "1", "meaning": "", "calibrated": True, "low_95": 0.3, "high_95": 0.5,
    }  # fmt: skip
    assert (card["parameters"]["restitution"]["value"], card["parameters"]["restitution"]["calibrated"]) == (0.5, False)
    assert card["responses"]["cohesion_pa"] == {"unit": "Pa", "target": 24.0, "predicted": 1.0, "low_95": -5.0, "high_95": 6.0}
    verdicts = [card["verification"][name] for name in ("prediction", "match")]
    assert verdicts == ["contradicted: angle_of_repose", "misses: angle_of_repose"]
    assert (card["verification"]["missed"], card["verification"]["extrapolated"]) == (["cohesion"], [])
    assert card["verification"]["simulations"][0]["simulated"] is None
    assert card["walls"] == {"static_friction": 0.4, "rolling_friction": 0.1}
    assert card["provenance"]["engine"] == "abc"


def test_the_card_names_the_rolling_model_of_the_study(make_card):
    assert make_card()["models"]["rolling"]["equation"] == "M_i = -mu_r F_n R_i w_i / |w_i|"
    assert make_card(engine={"rolling_model": "type_c"})["models"]["rolling"]["type"] == "type_c"
    assert make_card(repose={"wall_static_friction": 0.7})["walls"]["static_friction"] == 0.7


def test_the_card_has_the_plate_and_the_lift_of_the_laboratory(make_card):
    assert make_card()["simulated_with"]["n_particles"] == 3000
    card = make_card(repose_test={"plate": 0.25, "lift_speed_m_s": 0.01, "tube_diameter_m": 0.05, "fill_height_m": 0.1})
    assert card["walls"] == {"static_friction": 0.25, "rolling_friction": 0.1}
    assert card["simulated_with"]["lift_speed_m_s"] == 0.01
    assert "n_particles" not in card["simulated_with"]
    rough = make_card(repose_test={"plate": "rough"}, repose={"wall_static_friction": 0.7})
    assert rough["walls"]["static_friction"] == 0.4  # as between grains


def test_the_card_has_the_tests_of_the_laboratory_that_its_angles_come_from(make_card):
    stated = {"height_m": 0.4, "gravity_m_s2": "earth"}
    simulated_with = make_card(slope_test=stated)["simulated_with"]
    assert simulated_with["slope_test"] == stated
    assert {"repose_test", "shear_test", "draw_down_test", "drum_test"} <= set(simulated_with)


def test_the_configuration_is_fingerprinted_whatever_the_order_of_its_keys(make_card, config):
    hashes = {make_card()["provenance"]["config_sha256"], make_card(repose={"n_particles": 2999})["provenance"]["config_sha256"]}
    assert len(hashes) == 2
    config_reversed = dict(reversed(config.items()))
    config.clear()
    config.update(config_reversed)
    assert make_card()["provenance"]["config_sha256"] in hashes


@pytest.mark.parametrize(
    "spoil",
    [
        lambda card: card["parameters"].pop("radius_m"),
        lambda card: card["parameters"]["radius_m"].update(value=-1.0),
        lambda card: card["provenance"].update(config_sha256="x"),
        lambda card: card["models"]["rolling"].pop("type"),
        lambda card: card["verification"].update(match=""),
        lambda card: card.update(colour="grey"),
    ],
)
def test_a_card_that_breaks_the_schema_is_refused(make_card, spoil):
    card = copy.deepcopy(make_card())
    spoil(card)
    with pytest.raises(jsonschema.ValidationError):
        check_card(card)
