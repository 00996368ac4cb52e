"""Clumps on the card and in the files: the programs' grains have virtual-soil's spheres, mass and moments."""

import copy
import csv
import math
import re

import jsonschema
import numpy as np
import pytest
from programs import LMP, RADIUS, last_numbers, needs_lammps, needs_liggghts, run

from dem import Clump
from virtual_soil.exports import PROGRAMS, SHAPE_FILES, check_card, inputs

PEAR = Clump.of_spheres([(0.0, 0.0, 0.0, 1.0), (0.9, 0.0, 0.0, 0.7), (0.5, 0.8, 0.0, 0.5)], name="pear")
DIMER = Clump.preset("dimer")
MASS = 3000.0 * 4.0 / 3.0 * math.pi * RADIUS**3


@pytest.fixture
def clumps(make_card):
    """A card of grains that are clumps and do not resist rolling."""

    def make(clump=PEAR, rolling_friction=0.0, **material):
        return make_card({"rolling_friction": rolling_friction}, clump, material=material)

    return make


# --- the card -------------------------------------------------------------------------------------------------------


def test_the_card_has_the_spheres_the_mass_and_the_moments_of_a_mean_grain(clumps):
    card = clumps()
    shape = card["shape"]
    assert (card["format_version"], shape["name"], len(shape["spheres"])) == (4, "pear", 3)
    assert shape["mass_kg"] == pytest.approx(MASS)
    assert shape["moments_kg_m2"] == pytest.approx([MASS * RADIUS**2 * moment for moment in PEAR.moments])
    found = [[sphere[key] for key in ("x_m", "y_m", "z_m", "radius_m")] for sphere in shape["spheres"]]
    assert found == pytest.approx(RADIUS * np.array(PEAR.spheres))
    assert "aspect_ratio" not in card["parameters"]


def test_a_dimer_s_card_has_its_aspect_ratio(clumps):
    card = clumps(DIMER, aspect_ratio=1.5)
    assert card["parameters"]["aspect_ratio"]["value"] == 1.5
    assert not card["parameters"]["aspect_ratio"]["calibrated"]


def test_adhesion_is_that_of_two_spheres_of_the_clumps(clumps):
    card = clumps(DIMER, adhesive_stress_pa=200.0)
    member = DIMER.smallest_ratio * RADIUS
    assert card["format_version"] == 4
    assert card["adhesion"]["pull_off_force_n"] == pytest.approx(200.0 * (2 * RADIUS) ** 2)
    assert 2 * math.pi * card["adhesion"]["work_of_adhesion_j_m2"] * member / 2 == pytest.approx(8e-6)
    gamma = float(re.search(r"gamma=([\d.e-]+),", inputs(card)["yade_material.py"]).group(1))
    assert 4 * math.pi * gamma * member / 2 == pytest.approx(8e-6)


def test_spheres_have_the_card_and_the_files_that_they_always_had(make_card):
    card = make_card()
    assert (card["format_version"], "shape" in card) == (2, False)
    assert set(inputs(card)) == {name for name, _ in PROGRAMS.values()}
    for text in inputs(card).values():
        assert not re.search("clump|multisphere|molecule", text)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda card: card.update(format_version=2),
        lambda card: card.update(format_version=3),
        lambda card: card.pop("shape"),
        lambda card: card["shape"].pop("mass_kg"),
        lambda card: card["shape"]["spheres"].pop(),
    ],
)
def test_a_card_that_hides_the_shape_is_refused(clumps, spoil):
    card = copy.deepcopy(clumps(DIMER))
    spoil(card)
    with pytest.raises(jsonschema.ValidationError):
        check_card(card)


# --- the files ------------------------------------------------------------------------------------------------------


def test_every_file_has_the_spheres_or_says_that_it_has_not(clumps, tmp_path):
    card = clumps()
    texts = inputs(card)
    wanted = RADIUS * np.array(PEAR.spheres)
    values = re.search(r" spheres (.*) type 1 mass", texts["in.liggghts"]).group(1)
    assert np.array(values.split(), float).reshape(-1, 4) == pytest.approx(wanted, rel=1e-7)
    yade = re.findall(r"\(Vector3\((.*)\), (.*)\),", texts["yade_material.py"])
    assert [[*map(float, place.split(",")), float(radius)] for place, radius in yade] == [pytest.approx(row) for row in wanted]
    rows = [row for row in csv.reader(texts["edem.csv"].splitlines()) if row[0].startswith("particle sphere")]
    assert [float(row[2]) for row in rows] == pytest.approx(wanted.ravel())
    assert set(SHAPE_FILES) < set(texts)
    (tmp_path / "clump.txt").write_text(texts["clump.txt"])
    again = Clump.read(tmp_path / "clump.txt")
    assert np.array(again.spheres) == pytest.approx(np.array(PEAR.spheres), abs=2e-4)
    assert "THE SHAPE IS NOT CARRIED" in texts["mercurydpm_species.h"]
    heads = {program: texts[name] for program, (name, _) in PROGRAMS.items()}
    assert {program for program, text in heads.items() if "was not run" in text} == {"YADE"}
    assert all(f"mass of {MASS:.6g} kg" in text for text in heads.values())
    assert not any("Rolling friction acts" in text for text in heads.values())
    assert "Rolling friction acts between the spheres there" in inputs(clumps(rolling_friction=0.1))["edem.csv"]


def test_the_time_step_is_that_of_the_smallest_sphere(clumps, make_card):
    texts = [inputs(card)["in.lammps"] for card in (clumps(), make_card())]
    step, of_sphere = (float(re.search(r"^timestep (\S+)", text, re.MULTILINE).group(1)) for text in texts)
    assert step / of_sphere == pytest.approx(PEAR.smallest_ratio)


# --- the programs ---------------------------------------------------------------------------------------------------

#: One grain thrown down on a plate: mass, moments, and velocity before and after.
LIGGGHTS = """\
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
region box block -1e-3 1e-3 -1e-3 1e-3 -1e-3 3e-3 units box
create_box 2 box
neighbor 2e-5 bin
neigh_modify delay 0
include in.liggghts
{wall}
fix all_sizes all particledistribution/discrete 32452843 1 vs_shape 1.0
region drop block -5e-4 5e-4 -5e-4 5e-4 3e-4 1e-3 units box
fix bodies all multisphere
fix insert all insert/pack seed 49979687 distributiontemplate all_sizes vel constant 0. 0. -0.1 insert_every once &
  overlapcheck yes all_in yes particles_in_region 1 region drop
compute inertia all multisphere property inertia
compute mass all multisphere property masstotal
compute body all reduce max vz
dump moments all local 1000 inertia.txt c_inertia[1] c_inertia[2] c_inertia[3]
dump mass all local 1000 mass.txt c_mass
thermo_style custom step c_body
thermo_modify lost ignore format float %.12g
thermo 1000
run {steps}
"""
LAMMPS = """\
atom_style sphere
atom_modify map array
boundary f f f
newton off
comm_modify vel yes
units si
region box block -1e-3 1e-3 -1e-3 1e-3 -1e-3 3e-3
fix numbers all property/atom mol ghost yes
create_box 2 box
neighbor 2e-5 bin
neigh_modify delay 0 exclude molecule/intra all
include in.lammps
{wall}
region drop cylinder z 0 0 5e-4 1e-3 2e-3
fix bodies all rigid/small molecule mol vs_grain
fix down all gravity 9.81 vector 0 0 -1
fix insert all pour 1 0 4767548 region drop mol vs_grain rigid bodies
compute body all rigid/local bodies mass inertiax inertiay inertiaz
dump body all local 100 body.txt c_body[*]
dump_modify body format line "%.9g %.9g %.9g %.9g"
run 200
"""


@needs_lammps
def test_lammps_pours_grains_of_the_union_s_mass_and_moments(clumps, tmp_path):
    for name, text in inputs(clumps()).items():
        (tmp_path / name).write_text(text)
    run([str(LMP), "-log", "none"], LAMMPS.format(wall=""), tmp_path)
    mass, *moments = map(float, (tmp_path / "body.txt").read_text().splitlines()[-1].split())
    assert mass == pytest.approx(MASS)
    assert sorted(moments) == pytest.approx([MASS * RADIUS**2 * moment for moment in sorted(PEAR.moments)])


@needs_liggghts
def test_liggghts_inserts_grains_of_the_union_s_mass_and_moments(clumps, tmp_path):
    for name, text in inputs(clumps()).items():
        (tmp_path / name).write_text(text)
    run(["liggghts"], LIGGGHTS.format(wall="", steps=1000), tmp_path)
    moments = list(map(float, (tmp_path / "inertia.txt").read_text().splitlines()[-1].split()))
    assert float((tmp_path / "mass.txt").read_text().splitlines()[-1]) == pytest.approx(MASS, rel=1e-5)
    assert sorted(moments) == pytest.approx([MASS * RADIUS**2 * moment for moment in sorted(PEAR.moments)], rel=1e-5)


#: The dimer upright, so that it meets the plate with one sphere below its centre.
UPRIGHT = Clump("upright dimer", tuple((z, y, x, r) for x, y, z, r in DIMER.spheres), DIMER.moments[::-1])


def rebound(output):
    """Velocity after over velocity before the impact at 0.1 m/s."""
    return last_numbers(output, 1)[0] / 0.1


@needs_liggghts
def test_a_dashpot_of_liggghts_takes_the_mass_of_the_grain(clumps, tmp_path):
    text = inputs(clumps(UPRIGHT))["in.liggghts"]
    (tmp_path / "in.liggghts").write_text(text)
    wall = re.search(r"^# Walls:  (.*)$", text, flags=re.MULTILINE).group(1)
    assert rebound(run(["liggghts"], LIGGGHTS.format(wall=wall, steps=20000), tmp_path)) == pytest.approx(0.5, abs=0.01)


@needs_lammps
def test_a_dashpot_of_lammps_takes_the_mass_of_the_grain(clumps, tmp_path):
    for name, text in inputs(clumps(UPRIGHT)).items():
        (tmp_path / name).write_text(text)
    wall = re.search(r"^# Walls:  (.*)$", inputs(clumps(UPRIGHT))["in.lammps"], flags=re.MULTILINE).group(1)
    head = LAMMPS.split("region drop")[0].format(wall=wall)
    thrown = """create_atoms 0 single 0 0 3e-4 mol vs_grain 1234 rotate 0 0 0 1
fix bodies all rigid/small molecule
velocity all set 0 0 -0.1
compute body all reduce max vz
thermo_style custom step c_body
thermo_modify format float %.12g
thermo 1000
run 10000
"""
    assert rebound(run([str(LMP), "-log", "none"], head + thrown, tmp_path)) == pytest.approx(0.5, abs=0.01)
