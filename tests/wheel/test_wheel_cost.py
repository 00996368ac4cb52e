"""What jobs of wheel, plates and cone are expected to take, beside the engine's own counts and beside tests that were made."""

import copy

import pytest
import yaml

from dem.experiments import penetration, soil_bed, wheel
from virtual_soil.campaign import cost
from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.experiments.common import time_step_s
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.wheel import cost as wheel_cost
from virtual_soil.wheel.setups import bed_settings, press_test, shape_of, soil_and_engine
from virtual_soil.wheel.setups import test_of as of_run
from virtual_soil.wheel.soil import engine_settings, grain_settings, soil_with

TOY = {"shape": {"radius_m": 0.010, "width_m": 0.008}, "load_n": 0.1, "slips": [0.5], "speed_m_s": 0.05, "travel_ratio": 1.2}
TOY |= {"grains_per_radius": 5.0, "shear_modulus_pa": 1e6, "bed": {"length_ratio": 4.7, "width_ratio": 2.5, "depth_ratio": 1.5}}
#: A bed of 47 871 grains; of three such beds, lowering and slip 0.5 took 54 700 to 57 800 steps.
GUIDE = {"grains_per_radius": 0.058 / 5e-3, "bed": {"length_ratio": 5.5, "width_ratio": 3.4, "depth_ratio": 1.8}}
GUIDES_SOIL = {"density_kg_m3": 2650.0, "poisson_ratio": 0.25, "radius_sd_ratio": 0.1}


def study(wheel: dict, material: dict | None = None) -> dict:
    """The default configuration with changes of two sections."""
    config = copy.deepcopy(defaults(Study))
    config["material"] |= material or {}
    for key, value in wheel.items():
        config["wheel"][key] = config["wheel"][key] | value if isinstance(value, dict) else value
    return config


def job_of(config: dict) -> dict:
    """What the scripts get."""
    section = config["wheel"]
    engine = engine_settings(config, section)
    return {"soil": soil_with(config, {}), "grains": grain_settings(section), "engine": engine, "bed": bed_settings(section)}


def work(rule: str, config: dict, **wildcards) -> wheel_cost.Work:
    return wheel_cost.of_rule(rule, job_of(config), config, wildcards)


def test_grains_and_steps_of_the_guides_wheel_are_those_that_were_counted():
    config = study(GUIDE, GUIDES_SOIL)
    assert work("prepare_bed", config).spheres == 47_871
    found = [work("lower_wheel", config), work("drive_wheel", config, slip="0.5")]
    assert {part.spheres for part in found} == {47_871}
    assert 54_700 <= sum(part.steps for part in found) <= 57_800


def test_what_a_toy_took_was_expected_within_the_headroom():
    config = study(TOY, {"radius_sd_ratio": 0.05})
    config["plate"] |= {"depth_m": 0.004, "speed_m_s": 0.1}
    config["cone"] |= {"base_area_m2": 30e-6, "angle_deg": 120.0, "depth_m": 0.003, "speed_m_s": 0.1}
    soil, engine = soil_and_engine(job_of(config))
    bed = soil_bed.prepare(soil, soil_bed.Setup(**bed_settings(config["wheel"])), engine, 1)
    assert bed.n_particles == work("prepare_bed", config).spheres
    assert bed.simulation.time_step_s == time_step_s(soil, engine)
    shape, test = shape_of(config["wheel"]), of_run(config["wheel"], "0.5")
    lowered = wheel.lower(bed, soil, shape, test)
    lowering = lowered.simulation.n_steps - bed.simulation.n_steps
    run = wheel.drive(bed, soil, shape, test, state=lowered)
    plate_test, cone_test = press_test(config["plate"]), press_test(config["cone"])
    plate = penetration.press(bed, soil, penetration.disc(0.008, plate_test, soil), plate_test)
    cone = penetration.press(bed, soil, penetration.cone(30e-6, 120.0, cone_test, soil), cone_test)
    for expected, taken in (
        (work("prepare_bed", config), bed.simulation.n_steps),
        (work("lower_wheel", config), lowering),
        (work("drive_wheel", config, slip="0.5"), run.n_steps - lowering),
        (work("press_plate", config, diameter="0.008"), plate.n_steps),
        (work("push_cone", config), cone.n_steps),
    ):
        assert 1.0 / cost.HEADROOM < expected.steps / taken < 1.7


def test_a_held_rim_makes_a_slipping_wheel_travel_longer():
    axle, rim = (study(TOY | {"held": held}) for held in ("travel", "rim"))
    assert work("drive_wheel", axle, slip="0.75").steps == pytest.approx(work("drive_wheel", axle, slip="0").steps)
    travels = [work("drive_wheel", rim, slip=slip).steps for slip in ("0.75", "0")]
    assert travels[0] == pytest.approx(4.0 * travels[1])
    assert travels[1] == pytest.approx(1.2 * 0.010 / 0.05 / time_step_s(*soil_and_engine(job_of(rim))))


def test_stiffer_grains_weaker_gravity_and_slower_tools_take_longer():
    config = study(TOY)
    stiff, moon = study(TOY | {"shear_modulus_pa": 4e6}), study(TOY | {"gravity_m_s2": 9.81 / 4.0})
    slow = study(TOY)
    slow["plate"]["speed_m_s"] *= 0.25
    assert work("prepare_bed", stiff).steps == pytest.approx(2.0 * work("prepare_bed", config).steps)
    assert work("prepare_bed", moon).steps == pytest.approx(2.0 * work("prepare_bed", config).steps)
    plate = work("press_plate", config, diameter="0.008")
    assert work("press_plate", slow, diameter="0.008").steps == pytest.approx(4.0 * plate.steps)


def test_grains_on_the_rim_and_spheres_of_clumps_count():
    config = study(TOY)
    rough = study(TOY | {"shape": TOY["shape"] | {"rim": "sandpaper"}})
    lining = shape_of(rough["wheel"]).lining(soil_and_engine(job_of(rough))[0].radius_m)
    plain = work("drive_wheel", config, slip="0.5")
    assert work("drive_wheel", rough, slip="0.5").spheres == plain.spheres + len(lining)
    dimers = plain._replace(clumps=True)
    assert dimers.expected_s == pytest.approx(cost.CLUMP_FACTOR * plain.expected_s)


def test_the_search_for_a_density_takes_columns_of_the_beds_depth():
    config = study(GUIDE, GUIDES_SOIL)
    column, bed = work("steer_density", config), work("prepare_bed", config)
    assert column.spheres == pytest.approx(bed.spheres * (16 * 5e-3) ** 2 / (5.5 * 0.058 * 3.4 * 0.050), rel=1e-3)
    assert column.steps == pytest.approx((2 + wheel_cost.HALVINGS) * bed.steps, rel=1e-3)


def test_a_film_gets_memory_for_its_frames_and_every_attempt_more():
    run = work("drive_wheel", study(GUIDE), slip="0.5")
    film = work("film_wheel", study(GUIDE), slip="0.5")
    assert film == run
    asked = [wheel_cost.requested_mb("drive_wheel", run, attempt) for attempt in (1, 2)]
    assert asked[1] >= 2 * asked[0] - 1
    assert wheel_cost.requested_mb("film_wheel", film, 1) - asked[0] == pytest.approx(run.spheres * 40 * 80 / 1e6, abs=1.0)


def test_the_summary_adds_up_what_a_target_takes():
    config = study(GUIDE, GUIDES_SOIL)
    jobs = [("prepare_bed", {}, 2), ("steer_density", {}, 1), ("press_plate", {"diameter": "0.06"}, 2)]
    jobs += [("drive_wheel", {"slip": slip}, 2) for slip in ("0", "0.5")]
    planned = [(rule, work(rule, config, **wildcards), number) for rule, wildcards, number in jobs]
    seconds = sum(number * done.expected_s for _, done, number in planned)
    line = wheel_cost.summary("wheel", planned)
    assert line.startswith(
        "wheel (not part of `all`): 2 beds of 47 900 grains, 1 search for the density, 2 plates, 4 runs of the wheel: about "
    )
    assert 0.0 <= int(line.split("about ")[1].split()[0]) - seconds / 60.0 < 1.0


def test_the_summary_counts_changed_beds_and_repeated_tests():
    config = study(GUIDE, GUIDES_SOIL)
    base = work("prepare_bed", config)
    planned = [("prepare_bed", base, 2), ("prepare_bed", base._replace(spheres=162_000), 2), ("drive_wheel", base, 4)]
    seconds = sum(number * done.expected_s for _, done, number in planned) + 200.0
    line = wheel_cost.summary("check_wheel_soil", planned, (50.0,) * 4)
    assert "4 beds of 47 900 to 162 000 grains, 4 runs of the wheel, 4 tests of the calibration: about " in line
    assert 0.0 <= int(line.split("about ")[1].split()[0]) - seconds / 60.0 < 1.0


#: Mean and longest time in s of the jobs of `wheel_spread` (config/cmu_valley.yaml), as in docs/guides/cluster.md.
TAKEN_S = {
    "steer_density": (32.0, 40.0),
    "prepare_bed": (44.0, 59.0),
    "lower_wheel": (21.0, 38.0),
    "drive_wheel": (98.0, 164.0),
    "press_plate": (33.0, 64.0),
}


@pytest.mark.parametrize("rule", TAKEN_S)
def test_what_the_valleys_jobs_took_is_expected_and_the_longest_is_within_the_headroom(rule):
    changes = yaml.safe_load((ROOT / "config" / "cmu_valley.yaml").read_text())
    config = study(changes["wheel"], changes["material"])
    config["plate"] |= changes["plate"]
    (mean_s, longest_s), found_s = TAKEN_S[rule], work(rule, config, slip="0.3", diameter="0.06").expected_s
    assert found_s == pytest.approx(mean_s, rel=0.3)
    assert longest_s < cost.HEADROOM * found_s
