"""Adhesion on the card and in the files: the programs' grains hold as much as virtual-soil's, and the files say what differs."""

import copy
import csv
import math
import re

import jsonschema
import numpy as np
import pytest
from programs import LAMMPS, LIGGGHTS, LMP, RADIUS, SCENE, all_numbers, needs_lammps, needs_liggghts, run

from virtual_soil.exports import PROGRAMS, check_card, inputs

STRESS, MU_S, MU_R, E_STAR = 200.0, 0.4, 0.1, 6.25e7
PULL_OFF = STRESS * (2 * RADIUS) ** 2
HERTZ = 4 / 3 * E_STAR * math.sqrt(RADIUS / 2)
programs = pytest.mark.parametrize(
    ("program", "law"),
    [
        pytest.param("LIGGGHTS", "constant", marks=needs_liggghts),
        pytest.param("LAMMPS", "constant", marks=needs_lammps),
        pytest.param("LAMMPS", "jkr", marks=needs_lammps),
    ],
)


@pytest.fixture
def sticky(make_card):
    """A card of a soil with adhesion, by the law; grains that lose no energy unless another restitution is given."""

    def make(law="constant", restitution=1.0, **material):
        return make_card(
            material={"adhesive_stress_pa": STRESS, "restitution": restitution, **material},
            engine={"adhesion": law, "rolling_model": "type_c"},
        )

    return make


# --- the card -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("law", "factor"), [("constant", 2.0), ("jkr", 1.5)])
def test_the_card_has_the_adhesive_stress_the_law_and_both_energies(sticky, law, factor):
    card = sticky(law)
    assert card["format_version"] == 3
    assert card["parameters"]["adhesive_stress_pa"]["value"] == STRESS
    said = card["adhesion"]
    assert said["law"] == law
    assert said["pull_off_force_n"] == pytest.approx(8e-6)
    assert said["work_of_adhesion_j_m2"] == pytest.approx(8e-6 / (factor * math.pi * RADIUS / 2))
    assert said["surface_energy_j_m2"] == said["work_of_adhesion_j_m2"] / 2
    assert said["prepared_with_adhesion"] == {"repose": False, "plane_shear": False}
    assert {"constant": "constant pull-off force", "jkr": "JKR adhesive contact"}[law] in card["models"]["normal"]["words"]


def test_a_soil_without_adhesion_has_the_card_and_the_files_that_it_always_had(make_card):
    card = make_card(engine={"adhesion": "jkr"})
    assert card == make_card() | {"provenance": card["provenance"]}
    assert (card["format_version"], "adhesion" in card, "adhesive_stress_pa" in card["parameters"]) == (2, False, False)
    for text in inputs(card).values():
        assert not re.search("adhesi|gamma|cohes", text, flags=re.IGNORECASE)
    assert inputs(card)["in.lammps"].count("damping coeff_restitution") == 3


def test_a_calibrated_adhesive_stress_of_zero_stands_on_the_card_but_in_no_file(make_card):
    variables = ["radius_m", "static_friction", "rolling_friction", "adhesive_stress_pa"]
    found = {"adhesive_stress_pa": 0.0, "adhesive_stress_pa_high_95": 30.0}
    card = make_card(found, design={"variables": variables})
    stress = card["parameters"]["adhesive_stress_pa"]
    assert (card["format_version"], stress["value"], stress["high_95"], stress["calibrated"]) == (3, 0.0, 30.0, True)
    assert inputs(card) == inputs(make_card())


@pytest.mark.parametrize(
    "spoil",
    [
        lambda card: card.update(format_version=2),
        lambda card: card.pop("adhesion"),
        lambda card: card["parameters"].pop("adhesive_stress_pa"),
        lambda card: card["adhesion"].update(law="sjkr"),
        lambda card: card["adhesion"].pop("surface_energy_j_m2"),
    ],
)
def test_a_card_that_hides_adhesion_is_refused(sticky, spoil):
    card = copy.deepcopy(sticky())
    spoil(card)
    with pytest.raises(jsonschema.ValidationError):
        check_card(card)


# --- the files ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("law", "lammps"), [("constant", "dmt"), ("jkr", "jkr")])
def test_each_program_gets_the_parameter_that_makes_the_pull_off_force_equal(sticky, law, lammps):
    texts = inputs(sticky(law))
    factor = {"constant": 4, "jkr": 3}[law]
    words = re.findall(r'^variable vs_\w+ string "(.*)"$', texts["in.lammps"], flags=re.MULTILINE)
    for word in words:
        name, young, _, poisson, gamma = word.split()[:5]
        assert (name, float(young), float(poisson)) == (lammps, 1.2e8, 0.2)
        assert factor * math.pi * float(gamma) * RADIUS / 2 == pytest.approx(PULL_OFF)
    yade = float(re.search(r"gamma=([\d.e-]+),", texts["yade_material.py"]).group(1))
    assert 4 * math.pi * yade * RADIUS / 2 == pytest.approx(PULL_OFF)
    assert "includeAdhesion=True" in texts["yade_material.py"]
    rows = {tuple(row[:2]): row[2:] for row in csv.reader(texts["edem.csv"].splitlines()) if len(row) == 4}
    for wall in ("grain", "wall"):
        gamma, unit = rows[f"interaction grain-{wall}", "surface energy"]
        assert (3 * math.pi * float(gamma) * RADIUS / 2, unit) == (pytest.approx(PULL_OFF), "J/m2")
    assert rows["physics", "contact model"][0].startswith("Hertz-Mindlin with JKR")
    values = re.search(r"cohesionEnergyDensity peratomtypepair 2 (.*)$", texts["in.liggghts"], flags=re.MULTILINE).group(1)
    k, k_wall = (float(value) for value in values.split()[:2])
    assert 2 * math.pi**3 / 3 * k**3 * (RADIUS / 2) ** 2 / E_STAR**2 == pytest.approx(PULL_OFF)
    assert 2 * math.pi**3 / 3 * k_wall**3 * RADIUS**2 / E_STAR**2 == pytest.approx(2 * PULL_OFF)


def test_every_file_says_what_is_not_the_same(sticky):
    heads = {}
    for program, (name, comment) in PROGRAMS.items():
        lines = [line[len(comment) :] for line in inputs(sticky())[name].splitlines() if line.startswith(comment)]
        heads[program] = " ".join(lines)
        assert "F_c = 8e-06 N" in heads[program]
    for program, limit in {"LAMMPS": "2 mu F_c", "YADE": "mu F_c", "EDEM": "4 mu F_c", "LIGGGHTS": "27/4 mu F_c"}.items():
        assert f"without load: mu F_c in virtual-soil, {limit} (" in heads[program]
        assert "CARRY c, NOT gamma" in heads[program]
    assert "ADHESION IS NOT CARRIED" in heads["MercuryDPM"]
    assert "MEASURE THE PULL-OFF OF TWO GRAINS IN EDEM" in heads["EDEM"]
    assert "this size of grains only" in heads["LIGGGHTS"]
    differ = "The law is another than virtual-soil's"
    assert {program for program, head in heads.items() if differ in head} == {"EDEM"}
    assert differ in inputs(sticky("jkr"))["yade_material.py"]


# --- the programs ---------------------------------------------------------------------------------------------------


def forces(program, folder, card, place, velocity, steps, time_step_s, wall=False):
    """Forces (steps, 2) along x and y on the first grain while the second, or a plate below, departs at a constant velocity."""
    settings, command = (LIGGGHTS, ["liggghts"]) if program == "LIGGGHTS" else (LAMMPS, [str(LMP), "-log", "none"])
    name = settings["include"]
    text = inputs(card)[name]
    (folder / name).write_text(text)
    plate = re.search(r"^# Walls:  (.*)$", text, flags=re.MULTILINE).group(1)
    second = "" if wall else f"create_atoms 1 single {place} 0 0{settings['box']}"
    scene = SCENE.split("{wall}")[0].format(**settings, second=second, diameter=2 * RADIUS)
    mover = f"set atom 1 vz {velocity[0]}" if wall else f"set atom 2 vx {velocity[0]} vy {velocity[1]}"
    ask = f"""{plate.replace("zplane 0.0", f"zplane {-place}") if wall else ""}
{mover}
timestep {time_step_s}
variable x equal f{"z" if wall else "x"}[1]
variable y equal fy[1]
thermo_style custom step v_x v_y
thermo_modify lost ignore format float %.12g
thermo 1
fix still all nve/noforce
run {steps}
"""
    return all_numbers(run(command, scene + ask, folder), 2)


@programs
@pytest.mark.parametrize("wall", [False, True])
def test_two_grains_and_a_grain_at_a_wall_part_at_virtual_soils_pull_off_force(sticky, tmp_path, program, law, wall):
    first, last, steps = 1.5e-7, -1.5e-7, 3000
    place = (1 if wall else 2) * RADIUS - first
    time_step_s = 1e-8
    speed = (first - last) / (steps * time_step_s)
    found = forces(program, tmp_path, sticky(law), place, (speed, 0.0), steps, time_step_s, wall)[:, 0]
    pull = -found.min() if wall else found.max()  # towards the plate, towards the second grain
    lens = 3e-3  # LIGGGHTS takes the area of the lens, not 2 pi R* delta
    assert pull == pytest.approx((2 if wall else 1) * PULL_OFF, rel=lens if program == "LIGGGHTS" else 2e-4)
    assert found[-1] == 0.0


@programs
def test_the_limit_of_sliding_is_the_one_that_the_file_states(sticky, tmp_path, program, law):
    multiple = 27 / 4 if program == "LIGGGHTS" else 2.0
    tear = 3 * (math.pi * PULL_OFF / (1.5 * math.pi * RADIUS / 2) * (RADIUS / 2) ** 2 / (8 * E_STAR)) ** (2 / 3) / (RADIUS / 2)
    overlap = {"constant": (PULL_OFF / HERTZ) ** (2 / 3), "jkr": tear * (6 ** (4 / 3) - 4 * 6 ** (1 / 3)) / 3}[law]
    if program == "LIGGGHTS":  # Hertz's force is there 27/4 F_c
        overlap = (multiple * PULL_OFF / HERTZ) ** (2 / 3)
    time_step_s = 1e-9
    card = sticky(law)
    x, y = forces(program, tmp_path, card, 2 * RADIUS - overlap, (0.0, 1.0), 300, time_step_s)[-1]
    assert abs(x) < 0.02 * PULL_OFF
    assert y == pytest.approx(multiple * MU_S * PULL_OFF, rel=0.01)


@needs_lammps
@pytest.mark.parametrize("law", ["constant", "jkr"])
def test_lammps_dashpot_is_virtual_soils_without_load(sticky, tmp_path, law):
    """Without load the overlap's rate alone pushes: 2 sqrt(5/6) beta sqrt(S_n m*) v, S_n = 2 E* a_0."""
    pull = PULL_OFF
    a_0 = (3 * pull * RADIUS / 2 / (4 * E_STAR) * {"constant": 1, "jkr": 4}[law]) ** (1 / 3)
    overlap = a_0**2 / (RADIUS / 2) / {"constant": 1, "jkr": 3}[law]
    found = []
    for restitution in (0.5, 1.0):
        folder = tmp_path / str(restitution)
        folder.mkdir()
        card = sticky(law, restitution)
        found.append(forces("LAMMPS", folder, card, 2 * RADIUS - overlap, (-0.01, 0.0), 0, 1e-9)[0, 0])
    mass = 3000.0 * 4 / 3 * np.pi * RADIUS**3
    beta = math.log(2) / math.hypot(math.log(2), math.pi)
    assert found[0] - found[1] == pytest.approx(
        -2 * math.sqrt(5 / 6) * beta * math.sqrt(2 * E_STAR * a_0 * mass / 2) * 0.01, rel=1e-3
    )
