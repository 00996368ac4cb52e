"""Input for other programs: the programs themselves load it, and brake rolling grains as hard as virtual-soil does."""

import csv
import json
import math
import re
import shutil
import subprocess

import numpy as np
import pytest
from programs import LAMMPS, LIGGGHTS, LMP, RADIUS, SCENE, last_numbers, needs_lammps, needs_liggghts, run

from virtual_soil.exports import PROGRAMS, converted, inputs

OVERLAP, MU_S, MU_R = 1e-6, 0.4, 0.1


def normal_force(E_star, R_star):
    """Hertz's force in N at the overlap of the tests."""
    return 4 / 3 * E_star * math.sqrt(R_star) * OVERLAP**1.5


E_STAR = 2 * 5e7 * 1.2 / (2 * (1 - 0.2**2))
BETWEEN = normal_force(E_STAR, RADIUS / 2)

WALL = normal_force(E_STAR, RADIUS)


def torques(program, folder, card, wall=False):
    """Largest and least torque about y on grains that roll on each other like gears, or on one that spins on a wall."""
    settings, command = (LIGGGHTS, ["liggghts"]) if program == "LIGGGHTS" else (LAMMPS, [str(LMP), "-log", "none"])
    name = settings["include"]
    (folder / name).write_text(inputs(card)[name])
    words = re.search(r"^# Walls:  (.*)$", inputs(card)[name], flags=re.MULTILINE).group(1)  # the very line that the file shows
    spins = [f"set atom {k} " + settings["spin"].format(spin) for k, spin in ((1, 1000.0), (2, -1000.0))]
    second = {"second": f"create_atoms 1 single {2 * RADIUS - OVERLAP} 0 0{settings['box']}", "spin": "\n".join(spins)}
    alone = {"second": "", "spin": spins[0]}
    plate = words.replace("zplane 0.0", f"zplane {-RADIUS + OVERLAP}") if wall else ""
    text = SCENE.format(**(settings | (alone if wall else second)), wall=plate, diameter=2 * RADIUS)
    return last_numbers(run(command, text, folder), 2)


def test_a_program_is_told_where_its_limit_of_friction_is_another(make_card):
    usual, liggghts = (inputs(make_card(engine={"tangential_model": model})) for model in ("edem", "liggghts"))
    hint, other = "engine.tangential_model: liggghts calibrates", "Calibrated with the limit of friction of LIGGGHTS"
    for name, _ in PROGRAMS.values():
        assert (hint in usual[name]) == (name == "in.liggghts")
        assert other not in usual[name]
        assert (other in liggghts[name]) == (name != "in.liggghts")
        assert hint not in liggghts[name]


@pytest.mark.parametrize("model", ["type_a", "type_c"])
@pytest.mark.parametrize("program", [pytest.param("LIGGGHTS", marks=needs_liggghts), pytest.param("LAMMPS", marks=needs_lammps)])
def test_the_program_brakes_rolling_grains_as_hard_as_virtual_soil(make_card, tmp_path, program, model):
    arm = {"type_a": RADIUS, "type_c": RADIUS / 2}[model]
    largest, least = torques(program, tmp_path, make_card(engine={"rolling_model": model}))
    assert (largest, least) == pytest.approx((MU_R * BETWEEN * arm, -MU_R * BETWEEN * arm), rel=1e-6)


@pytest.mark.parametrize("program", [pytest.param("LIGGGHTS", marks=needs_liggghts), pytest.param("LAMMPS", marks=needs_lammps)])
def test_the_program_brakes_a_grain_on_a_wall_as_hard_as_virtual_soil(make_card, tmp_path, program):
    card = make_card(repose={"wall_static_friction": 0.25, "wall_rolling_friction": 0.3})
    _, least = torques(program, tmp_path, card, wall=True)
    assert least == pytest.approx(
        -(0.25 * (RADIUS - OVERLAP) + 0.3 * RADIUS) * WALL, rel=0.02
    )  # sliding and rolling, arms r and r - d


@needs_liggghts
@pytest.mark.parametrize("shear_modulus_pa", [1e6, 1e10])
def test_liggghts_takes_very_soft_and_very_hard_grains(make_card, tmp_path, shear_modulus_pa):
    largest, _ = torques("LIGGGHTS", tmp_path, make_card(material={"shear_modulus_pa": shear_modulus_pa}))
    assert largest == pytest.approx(MU_R * BETWEEN * RADIUS * shear_modulus_pa / 5e7, rel=1e-6)


@needs_lammps
def test_lammps_dashpot_is_virtual_soils(make_card, tmp_path):
    """Force on two grains that approach each other, and on two that slide along each other, before any spring is wound up."""
    card = make_card()
    (tmp_path / "in.lammps").write_text(inputs(card)["in.lammps"])
    scene = SCENE.split("{wall}")[0].format(
        **LAMMPS, second=f"create_atoms 1 single {2 * RADIUS - OVERLAP} 0 0", diameter=2 * RADIUS
    )
    ask = "variable x equal fx[1]\nvariable y equal fy[1]\nthermo_style custom step v_x v_y\nthermo_modify format float %.12g\n"
    x, y = last_numbers(run([str(LMP), "-log", "none"], scene + "set atom 1 vx 0.01 vy 1e-4\n" + ask + "run 0\n", tmp_path), 2)
    mass = 3000.0 * 4 / 3 * np.pi * RADIUS**3
    beta = math.log(2) / math.hypot(math.log(2), math.pi)
    contact = math.sqrt(RADIUS / 2 * OVERLAP)
    normal, tangential = (
        2 * math.sqrt(5 / 6) * beta * math.sqrt(S * mass / 2) for S in (2 * E_STAR * contact, 8 * 5e7 / 3.6 * contact)
    )
    assert x == pytest.approx(-BETWEEN - normal * 0.01, rel=1e-6)
    assert y == pytest.approx(-tangential * 1e-4, rel=1e-6)


#: The same in YADE, and two grains that hit each other with 0.1 m/s in small steps; prints a line of JSON.
YADE_SCENE = """\
import json

exec(open("yade_material.py").read())


def grain(x, z, velocity_m_s=0.0, spin_rad_s=0.0):
    body = O.bodies[O.bodies.append(sphere((x, 0, z), RADIUS_M, material=grains))]
    body.state.vel, body.state.angVel = (velocity_m_s, 0, 0), (0, spin_rad_s, 0)
    if spin_rad_s:
        body.state.blockedDOFs = "xyzXYZ"
    return body


gears = grain(0, 0, spin_rad_s=1000.0), grain(2 * RADIUS_M - OVERLAP, 0, spin_rad_s=-1000.0)
O.bodies.append(wall(1, axis=2, material=walls))
spun = grain(0, 1 + RADIUS_M - OVERLAP, spin_rad_s=1000.0)
hit = grain(0, 0.5, velocity_m_s=0.05), grain(2.001 * RADIUS_M, 0.5, velocity_m_s=-0.05)
bounds = [Bo1_Sphere_Aabb(), Bo1_Facet_Aabb(), Bo1_Wall_Aabb()]
O.engines = [ForceResetter(), InsertionSortCollider(bounds), interaction_loop, NewtonIntegrator(damping=0)]
O.dt /= 20
O.run(10000, True)
print(json.dumps({
    "gears": [O.forces.t(body.id)[1] for body in gears],
    "force": O.forces.f(gears[1].id)[0],
    "wall torque": O.forces.t(spun.id)[1],
    "wall force": O.forces.f(spun.id)[2],
    "speeds": [body.state.vel[0] for body in hit],
}))
"""


@pytest.mark.skipif(shutil.which("yade") is None, reason="YADE is not on the path (apt-get install yade)")
def test_yade_presses_brakes_and_rebounds_grains_as_virtual_soil(make_card, tmp_path):
    card = make_card(repose={"wall_static_friction": 0.25})
    (tmp_path / "yade_material.py").write_text(inputs(card)["yade_material.py"])
    (tmp_path / "scene.py").write_text(YADE_SCENE.replace("OVERLAP", str(OVERLAP)))
    result = subprocess.run(
        ["yade", "-n", "-x", "scene.py"], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout.splitlines()[-1])
    assert found["force"] == pytest.approx(BETWEEN)
    assert found["gears"] == pytest.approx((-MU_R * BETWEEN * RADIUS, MU_R * BETWEEN * RADIUS))
    # to YADE a wall is a grain of the same size: R* = r/2; sliding acts on the arm r - d, rolling on r
    assert found["wall force"] == pytest.approx(BETWEEN)
    assert found["wall torque"] == pytest.approx(-(0.25 * (RADIUS - OVERLAP) + MU_R * RADIUS) * BETWEEN, rel=1e-3)
    assert found["speeds"] == pytest.approx((-0.025, 0.025), rel=1e-3)  # restitution 0.5


@pytest.mark.parametrize(
    ("model", "program", "between", "against"),
    [
        ("type_a", "EDEM", 1, 1), ("type_a", "LIGGGHTS", 2, 1), ("type_a", "LAMMPS", 2, 1), ("type_a", "YADE", 1, 1),
        ("type_a", "MercuryDPM", 1, 0.5), ("type_c", "LIGGGHTS", 1, 1), ("type_c", "EDEM", 0.5, 1),
        ("type_c", "MercuryDPM", 0.5, 0.5),
    ],
)  # fmt: skip
def test_coefficients_of_rolling_friction_are_converted(model, program, between, against):
    assert converted(0.1, model, program) == pytest.approx((0.1 * between, 0.1 * against))


def test_every_file_says_what_it_is_how_it_was_converted_and_that_the_heap_must_be_checked(make_card):
    texts = inputs(make_card(repose={"wall_rolling_friction": 0.3}))
    assert set(texts) == {name for name, _ in PROGRAMS.values()}
    for program, (name, comment) in PROGRAMS.items():
        head = [line for line in texts[name].splitlines() if line.startswith(comment.strip())]
        assert f"Material sand (soil barco, study default) for {program}" in head[0]
        assert "prediction contradicted: angle_of_repose; wanted properties: misses: angle_of_repose" in head[1]
        assert any("each grain feels the torque mu_r F_n R_i against its own spin" in line for line in head)
        assert any("THE HEAP MUST BE SIMULATED AGAIN" in line for line in head)
        between, against = converted(1.0, "type_a", program)
        assert any(f"mu = {'' if between == 1 else f'{between:g} '}mu_r" in line for line in head)


def test_each_file_holds_the_values_in_the_programs_own_definitions(make_card):
    texts = inputs(make_card(repose={"wall_rolling_friction": 0.3}))
    rows = list(csv.reader(line for line in texts["edem.csv"].splitlines() if not line.startswith("#")))
    assert {len(row) for row in rows} == {4}
    table = {(section, name): value for section, name, value, _ in rows}
    assert table["interaction grain-grain", "coefficient of rolling friction"] == "0.1"
    assert table["interaction grain-wall", "coefficient of rolling friction"] == "0.3"
    assert table["bulk material", "shear modulus"] == "50000000"
    yade = texts["yade_material.py"]
    compile(yade, "yade_material.py", "exec")
    assert float(re.search(r"frictionAngle=([\d.]+)", yade).group(1)) == pytest.approx(math.atan(MU_S))
    assert float(re.search(r"krot=([-\de.]+)", yade).group(1)) == pytest.approx(
        8 * 5e7 / 3.6 * math.sqrt(RADIUS / 2 * 1e-3 * RADIUS) * (RADIUS / 2) ** 2
    )
    assert "eta=0.1," in yade
    mercury = texts["mercurydpm_species.h"]
    assert float(re.search(r"RestitutionCoefficient\(([\d.]+), 0.5\)", mercury).group(1)) == pytest.approx(E_STAR)
    assert float(re.search(r"setEffectiveShearModulus\(([\d.]+)\)", mercury).group(1)) == pytest.approx(5e7 / 3.6)
    assert "s.setRollingFrictionCoefficient(0.1);" in mercury
    assert "mixed->setRollingFrictionCoefficient(0.15);" in mercury
    step = 0.2 * math.pi * RADIUS * math.sqrt(3000 / 5e7) / (0.1631 * 0.2 + 0.8766)
    for text in (texts["in.liggghts"], texts["in.lammps"]):
        assert float(re.search(r"^timestep (\S+)", text, flags=re.MULTILINE).group(1)) == pytest.approx(step)


def test_a_distribution_of_radii_is_mentioned(make_card):
    assert "radii scatter" not in inputs(make_card())["in.lammps"]
    assert "radii scatter by 0.1 of their mean" in inputs(make_card(material={"radius_sd_ratio": 0.1}))["in.lammps"]
