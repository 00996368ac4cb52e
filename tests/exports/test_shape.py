"""Clumps on the card and in the files: the programs' grains have virtual-soil's spheres, mass and moments."""

import copy
import csv
import math
import re
from types import SimpleNamespace

import jsonschema
import numpy as np
import pytest
from programs import LMP, RADIUS, last_numbers, needs_lammps, needs_liggghts, run

from dem import Clump, Mix
from virtual_soil.exports import PROGRAMS, check_card, inputs, shape_files

PEAR = Clump.of_spheres([(0.0, 0.0, 0.0, 1.0), (0.9, 0.0, 0.0, 0.7), (0.5, 0.8, 0.0, 0.5)], name="pear")
DIMER = Clump.preset("dimer")
MIX = Mix((Clump.preset("sphere"), DIMER, PEAR), (0.5, 0.3, 0.2))
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
    assert set(shape_files(1)) < set(texts)
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


# --- mixes ----------------------------------------------------------------------------------------------------------


def spheres_of(shape):
    return [[sphere[key] for key in ("x_m", "y_m", "z_m", "radius_m")] for sphere in shape["spheres"]]


def test_the_card_of_a_mix_has_every_shape_with_its_share(clumps):
    card = clumps(MIX, aspect_ratio=1.5)
    assert (card["format_version"], "shape" in card) == (5, False)
    assert [shape["share"] for shape in card["shapes"]] == pytest.approx([0.5, 0.3, 0.2])
    for found, shape in zip(card["shapes"], MIX.shapes, strict=True):
        assert found["name"] == shape.name
        assert found["mass_kg"] == pytest.approx(MASS)
        assert found["moments_kg_m2"] == pytest.approx([MASS * RADIUS**2 * moment for moment in shape.moments])
        assert spheres_of(found) == pytest.approx(RADIUS * np.array(shape.spheres))
    assert card["parameters"]["aspect_ratio"]["value"] == 1.5


def test_adhesion_of_a_mix_is_that_of_two_of_its_spheres(clumps):
    card = clumps(MIX, adhesive_stress_pa=200.0)
    radii = [(share, r) for share, shape in zip((0.5, 0.3, 0.2), MIX.shapes, strict=True) for *_, r in shape.spheres]
    mean = RADIUS * sum(share * r for share, r in radii) / sum(share for share, _ in radii)
    assert 2 * math.pi * card["adhesion"]["work_of_adhesion_j_m2"] * mean / 2 == pytest.approx(200.0 * (2 * RADIUS) ** 2)
    gamma = float(re.search(r"gamma=([\d.e-]+),", inputs(card)["yade_material.py"]).group(1))
    assert 4 * math.pi * gamma * mean / 2 == pytest.approx(8e-6)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda card: card.update(format_version=4),
        lambda card: card.update(format_version=2),
        lambda card: card.pop("shapes"),
        lambda card: card["shapes"][0].pop("share"),
        lambda card: card["shapes"].__delitem__(slice(1, None)),
        lambda card: card["shapes"][2].update(share=0.0),
    ],
)
def test_a_card_that_hides_a_shape_of_a_mix_is_refused(clumps, spoil):
    card = copy.deepcopy(clumps(MIX))
    spoil(card)
    with pytest.raises(jsonschema.ValidationError):
        check_card(card)


def test_every_file_has_all_shapes_with_their_shares_or_says_that_it_has_not(clumps, tmp_path):
    texts = inputs(clumps(MIX))
    wanted = [RADIUS * np.array(shape.spheres) for shape in MIX.shapes]
    assert set(texts) == {name for name, _ in PROGRAMS.values()} | set(shape_files(3))
    for number, shape in enumerate(MIX.shapes, 1):
        (tmp_path / "clump.txt").write_text(texts[f"clump_{number}.txt"])
        assert np.array(Clump.read(tmp_path / "clump.txt").spheres) == pytest.approx(np.array(shape.spheres), abs=2e-4)
        assert f"{shape.n_spheres} atoms" in texts[f"lammps_grain_{number}.mol"]
    liggghts = texts["in.liggghts"]
    values = re.findall(r"nspheres \d+ ntry 1000000 spheres (.*) type [12] mass", liggghts)
    assert [np.array(text.split(), float).reshape(-1, 4) for text in values] == [pytest.approx(rows) for rows in wanted[1:]]
    assert re.search(r"vs_shape_1 vs_spheres particletemplate/sphere .* radius constant 0.0001$", liggghts, re.MULTILINE)
    assert "numberbased 32452843 3 vs_shape_1 0.5 vs_shape_2 0.3 vs_shape_3 0.2\n" in liggghts
    assert "molecule vs_grain lammps_grain_1.mol lammps_grain_2.mol lammps_grain_3.mol " in texts["in.lammps"]
    assert 'variable vs_shares string "0.5 0.3 0.2"' in texts["in.lammps"]
    rows = [row for row in csv.reader(texts["edem.csv"].splitlines()) if row[0].startswith("particle ")]
    assert [float(row[2]) for row in rows if row[1] == "share of the number of grains"] == pytest.approx([0.5, 0.3, 0.2])
    for number, spheres in enumerate(wanted, 1):
        found = [float(row[2]) for row in rows if row[0].startswith(f"particle {number} sphere")]
        assert found == pytest.approx(spheres.ravel())
    assert "THE SHAPE IS NOT CARRIED" in texts["mercurydpm_species.h"]
    assert all("0.5 sphere, 0.3 dimer, 0.2 pear, as shares of the number" in texts[name] for name, _ in PROGRAMS.values())


def test_the_file_for_yade_makes_grains_of_every_kind(clumps):
    """Run with stand-ins for what it imports."""
    made = []
    text = inputs(clumps(MIX))["yade_material.py"].split("RADIUS_M")[1].split("interaction_loop")[0]
    bodies = SimpleNamespace(append=lambda body: made.append([body]) or 7, appendClumped=lambda parts, **_: made.append(parts))
    names = {
        "Vector3": lambda *values: np.array(values),
        "Quaternion": SimpleNamespace(Identity=1.0),
        "sphere": lambda centre, radius, **_: [*centre, radius],
        "O": SimpleNamespace(bodies=bodies),
    }
    exec("RADIUS_M" + text, names)  # noqa: S102 (the file is this package's own)
    assert names["SHARES"] == pytest.approx([0.5, 0.3, 0.2])
    assert names["add_grain"](np.zeros(3), 0) == (7, [7])
    for kind in (1, 2):
        names["add_grain"](np.zeros(3), kind)
    assert made == [pytest.approx(RADIUS * np.array(shape.spheres)) for shape in MIX.shapes]


def test_fine_grains_are_no_smaller_than_liggghts_accepts(make_card):
    fine, coarse = (inputs(make_card({"radius_m": radius}, MIX))["in.liggghts"] for radius in (5e-5, 1e-4))
    assert len(re.findall(r"volume_limit (\S+) density", fine)) == 3
    assert "volume_limit" not in coarse


def many(text, *changes):
    """A program's input with other words."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


MANY_LIGGGHTS = many(
    LIGGGHTS,
    ("fix all_sizes all particledistribution/discrete 32452843 1 vs_shape 1.0\n", ""),
    ("all_sizes", "vs_mix"),
    ("particles_in_region 1 ", "particles_in_region 100 "),
    ("-5e-4 5e-4 -5e-4 5e-4 3e-4 1e-3", "-9e-4 9e-4 -9e-4 9e-4 -9e-4 2.9e-3"),
    ("fix bodies all multisphere\n", "fix bodies all multisphere\nfix spheres vs_spheres nve/sphere\n"),
    ("run {steps}", "dump grains all custom 1000 grains.txt radius vz\nrun {steps}"),
)


@needs_liggghts
@pytest.mark.parametrize("radius_m", [RADIUS, 5e-5])
def test_liggghts_inserts_a_mix_with_its_shares_by_number(make_card, tmp_path, radius_m):
    for name, text in inputs(make_card({"rolling_friction": 0.0, "radius_m": radius_m}, MIX)).items():
        (tmp_path / name).write_text(text)
    run(["liggghts"], MANY_LIGGGHTS.format(wall="", steps=1000), tmp_path)
    last = (tmp_path / "grains.txt").read_text().rpartition("ITEM: ATOMS")[2].splitlines()[1:]
    radii, speeds = np.array([line.split() for line in last], float).T
    members = [np.isclose(radii, radius_m * r, rtol=1e-4, atol=0.0).sum() for r in (1.0, DIMER.smallest_ratio, PEAR.smallest_ratio)]
    assert members == [50, 60, 20]
    assert speeds == pytest.approx(-0.1, rel=1e-3)  # all are integrated, none stands still or falls apart


MANY_LAMMPS = many(
    LAMMPS,
    ("pour 1 0", "pour 100 0"),
    ("mol vs_grain rigid", "mol vs_grain molfrac ${{vs_shares}} rigid"),
    ("cylinder z 0 0 5e-4 1e-3 2e-3", "cylinder z 0 0 9e-4 -5e-4 2.9e-3"),
)


@needs_lammps
def test_lammps_pours_a_mix_of_grains_of_the_union_s_moments(clumps, tmp_path):
    for name, text in inputs(clumps(MIX)).items():
        (tmp_path / name).write_text(text)
    run([str(LMP), "-log", "none"], MANY_LAMMPS.format(wall=""), tmp_path)
    last = (tmp_path / "body.txt").read_text().rpartition("ITEM: ENTRIES")[2].splitlines()[1:]
    bodies = np.array([line.split() for line in last], float)
    assert bodies[:, 0] == pytest.approx(MASS)
    moments = np.sort(bodies[:, 1:], axis=1)
    wanted = [MASS * RADIUS**2 * np.sort(shape.moments) for shape in MIX.shapes]
    numbers = [int(np.isclose(moments, own, rtol=1e-5, atol=0.0).all(axis=1).sum()) for own in wanted]
    assert sum(numbers) == len(bodies) > 20
    assert min(numbers) > 0
