"""The comparison with LIGGGHTS, as far as it goes without LIGGGHTS: input files, parsing, refusals, and what the checks say."""

import math
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

from dem import Grains
from dem.experiments import angle_of_repose, direct_shear
from dem.experiments.specimen import lid
from virtual_soil.verification.peers import compare, contact, heap, liggghts, shear

RADIUS = compare.SOIL.radius_m


def numbers(line):
    return [float(word) for word in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", line)]


def line_with(lines, word):
    found = [line for line in lines if word in line]
    assert len(found) == 1, found
    return found[0]


def a_few_grains(n=4):
    positions = np.column_stack([np.linspace(-2, 2, n), np.zeros(n), 1.0 + np.arange(n)]) * RADIUS
    return Grains(positions, np.zeros((n, 3)), np.zeros((n, 3)), np.full(n, RADIUS))


def specimen(n_side=5):
    """A tall column of grains that touch floor and lid."""
    z = RADIUS * (1 + 2 * np.arange(8))
    x = RADIUS * (1 + 2 * np.arange(n_side))
    x, z = (a.ravel() for a in np.meshgrid(x, z))
    positions = np.column_stack([x, np.full(len(x), -0.5 * RADIUS), z])
    grains = Grains(positions, np.zeros_like(positions), np.zeros_like(positions), np.full(len(x), RADIUS))
    top = 16 * RADIUS
    solid = 4 / 3 * math.pi * len(x) * RADIUS**3 / (compare.SHEAR.area_m2 * top)
    made = direct_shear.Shear(
        history={}, before=grains, after=grains, n_particles=len(x), n_steps=0, simulated_time_s=0.0, solid_fraction=solid,
        lid_slip_ratio=0.0, max_overlap_ratio=0.0,
    )  # fmt: skip
    return shear.Specimen(made, compare.SHEAR)


# --- the program and its text ---------------------------------------------------------------------------------------


def test_a_missing_program_is_named_with_how_to_install_it(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(liggghts.PeerError, match=r"LIGGGHTS is not installed; .*apt-get install liggghts\.$"):
        liggghts.require_installed()


def test_the_command_refuses_in_one_sentence_where_the_program_is_missing(tmp_path):
    environment = os.environ | {"PATH": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    ended = subprocess.run(
        [sys.executable, "-m", "virtual_soil.verification.peers"], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert ended.returncode == 2
    assert ended.stderr.strip() == "LIGGGHTS is not installed; on Debian and Ubuntu: apt-get install liggghts."
    assert not (tmp_path / "results").exists()


def test_grains_softer_than_liggghts_allows_are_refused():
    with pytest.raises(liggghts.PeerError, match="Young's modulus is 2.4e"):
        liggghts.material_lines(1e6, 0.2, 0.5, [[0.3]], [[0.1]])


def test_material_lines_give_young_modulus_and_every_pair_of_types():
    lines = liggghts.material_lines(5e6, 0.25, 0.5, [[0.3, 0.2], [0.2, 0.1]], [[0.1, 0.0], [0.0, 0.0]])
    assert line_with(lines, "youngsModulus").split()[-2:] == ["12500000", "12500000"]
    assert line_with(lines, "coefficientFriction").split()[-5:] == ["2", "0.3", "0.2", "0.2", "0.1"]
    assert line_with(lines, "coefficientRollingFriction").split()[-5:] == ["2", "0.1", "0", "0", "0"]
    assert f"pair_style gran {liggghts.MODEL}" in lines


def test_data_file_keeps_positions_to_the_last_digit_and_gives_diameters():
    positions = np.array([[1 / 3, -2 / 7, 1e-5], [0.1, 0.2, 0.3]])
    spins = np.array([[0.0, 5.0, 0.0], [0.0, 0.0, 0.0]])
    text = liggghts.data_text("two", [(-1, 1)] * 3, 1, positions, np.array([0.01, 0.02]), 3000.0, spins_rad_s=spins)
    atoms, velocities = (part.strip().splitlines() for part in text.split("Atoms")[1].split("Velocities"))
    row = np.array(atoms[1].split(), float)
    np.testing.assert_array_equal(row, [2, 1, 0.04, 3000.0, 0.1, 0.2, 0.3])
    np.testing.assert_array_equal(np.array(atoms[0].split(), float)[4:], positions[0])
    np.testing.assert_array_equal(np.array(velocities[0].split(), float), [1, 0, 0, 0, 0, 5, 0])
    assert "-1 1 xlo xhi" in text
    lammps = liggghts.data_text("two", [(-1, 1)] * 3, 1, positions, np.array([0.01, 0.02]), 3000.0, note="  # sphere")
    assert "\nAtoms  # sphere\n" in lammps


def test_the_tube_mesh_is_closed_around_and_never_inside_the_round_tube():
    triangles = liggghts.tube(2.0, 0.5, 3.0, n_facets=12)
    assert triangles.shape == (24, 3, 3)
    assert set(triangles[..., 2].ravel()) == {0.5, 3.5}
    middles = 0.5 * (triangles[:, [0, 1, 2], :2] + triangles[:, [1, 2, 0], :2])
    assert np.hypot(*np.moveaxis(middles, -1, 0)).min() >= 2.0 - 1e-12
    area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(3.0 * 12 * 2 * 2.0 * math.tan(math.pi / 12))


def test_a_mesh_file_has_every_corner():
    text = liggghts.mesh_text(liggghts.rectangle((0, 0, 0), (2, 0, 0), (0, 3, 0)))
    assert text.count("facet normal") == 2
    corners = {tuple(numbers(line)) for line in text.splitlines() if line.startswith("vertex")}
    assert corners == {(0, 0, 0), (2, 0, 0), (2, 3, 0), (0, 3, 0)}


def test_the_last_thermo_row_is_read():
    printed = [
        "Step Atoms KinEng top\n",
        "0 3 9.0 1\n",
        "WARNING: something\n",
        "  500  2  1.5e-12  0.25 \n",
        "Loop time of 1 on 1 procs\n",
    ]
    assert liggghts.last_thermo(printed) == {"Step": 500, "Atoms": 2, "KinEng": 1.5e-12, "top": 0.25}


def test_output_without_a_thermo_table_is_refused_and_shown():
    with pytest.raises(liggghts.PeerError, match="ERROR: Unknown command"):
        liggghts.last_thermo(["ERROR: Unknown command\n"])


def test_a_dump_is_sorted_by_grain_and_its_last_frame_counts():
    frame = "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS\n0 1\n0 1\n0 1\nITEM: ATOMS id x\n{}"
    text = frame.format(0, "1 7.0\n2 8.0\n") + frame.format(9, "2 4.5\n1 3.5\n")
    np.testing.assert_array_equal(liggghts.read_dump(text), [[1, 3.5], [2, 4.5]])


# --- heap -----------------------------------------------------------------------------------------------------------


def test_heap_input_has_our_soil_step_plate_and_tube(tmp_path):
    setup, engine = compare.HEAP, compare.HEAP_ENGINE
    lines = heap.input_lines(tmp_path, compare.SOIL, setup, engine, a_few_grains(), 1.5e-6)
    assert "timestep 1.5e-06" in lines
    assert float(line_with(lines, "youngsModulus").split()[-1]) == pytest.approx(2 * 2.5e6 * 1.2)
    assert line_with(lines, "coefficientFriction").split()[-4:] == ["0.5"] * 4
    assert line_with(lines, "coefficientRollingFriction").split()[-4:] == ["0.15"] * 4
    plate = np.array([numbers(line) for line in (tmp_path / "plate.stl").read_text().splitlines() if "vertex" in line])
    np.testing.assert_allclose([plate.min(axis=0), plate.max(axis=0)], [[-3e-3, -3e-3, 0], [3e-3, 3e-3, 0]], atol=1e-12)
    tube = np.array([numbers(line) for line in (tmp_path / "tube.stl").read_text().splitlines() if "vertex" in line])
    assert np.hypot(tube[:, 0], tube[:, 1]).min() == pytest.approx(10 * RADIUS, rel=2e-3)
    assert tube[:, 2].min() == 0.0


def test_the_heap_box_holds_the_lifted_tube_and_lets_grains_fall_below_the_plate(tmp_path):
    heap.input_lines(tmp_path, compare.SOIL, compare.HEAP, compare.HEAP_ENGINE, a_few_grains(), 1.5e-6)
    low, high = numbers(line_with((tmp_path / "grains.data").read_text().splitlines(), "zlo"))
    tube = np.array([numbers(line)[2] for line in (tmp_path / "tube.stl").read_text().splitlines() if "vertex" in line])
    assert low == -2 * RADIUS
    assert high > tube.max() + compare.HEAP.lift_speed_m_s * compare.HEAP.max_time_s


def test_own_wall_friction_reaches_plate_and_tube_only(tmp_path):
    setup = angle_of_repose.Setup(**(vars(compare.HEAP) | {"wall_static_friction": 0.0, "wall_rolling_friction": 0.7}))
    lines = heap.input_lines(tmp_path, compare.SOIL, setup, compare.HEAP_ENGINE, a_few_grains(), 1.5e-6)
    assert line_with(lines, "coefficientFriction").split()[-4:] == ["0.5", "0", "0", "0"]
    assert line_with(lines, "coefficientRollingFriction").split()[-4:] == ["0.15", "0.7", "0.7", "0.7"]


# --- shear ----------------------------------------------------------------------------------------------------------


def test_a_specimen_lists_floor_then_lid_then_free_grains_and_folds_them_into_the_period():
    made = specimen()
    assert made.top_m == pytest.approx(16 * RADIUS)
    assert (made.n_floor, made.n_lid) == (5, 5)
    np.testing.assert_allclose(made.positions_m[:5, 2], RADIUS)
    np.testing.assert_allclose(made.positions_m[5:10, 2], 15 * RADIUS)
    assert (made.positions_m[:, 1] >= 0).all()


def test_the_frames_meet_at_mid_height_and_their_flanges_close_the_gap():
    made, setup = specimen(), compare.SHEAR
    walls = shear.meshes(made, setup, (-1e-3, 5e-3))
    mid = 0.5 * made.top_m
    assert walls["lower"][..., 2].max() == walls["upper"][..., 2].min() == mid
    assert walls["lower"][..., 0].min() == -1e-3
    assert walls["upper"][..., 0].max() == 5e-3
    for mesh in walls.values():
        assert (mesh[..., 1].min(), mesh[..., 1].max()) == (0.0, setup.width_m)


def test_shear_input_has_our_lid_and_smooth_frames(tmp_path):
    made, setup, engine = specimen(), compare.SHEAR, compare.SHEAR_ENGINE
    lines = shear.input_lines(tmp_path, compare.SOIL, setup, engine, made, 1e-6)
    load = setup.normal_stress_pa * setup.area_m2
    assert line_with(lines, "coefficientFriction").split()[-4:] == ["0.5", "0", "0", "0"]
    rows = (tmp_path / "grains.data").read_text().split("Atoms")[1].split("Velocities")[0].strip().splitlines()
    densities = np.array([row.split()[3] for row in rows], float)
    drive = lid(compare.SOIL, setup, len(rows), made.top_m).drive
    push = f"(f_lid[3]-{load:.9g}-{drive.damping_kg_s:.9g}*v_lid_speed)/5"
    assert line_with(lines, "variable push") == f"variable push equal {push}"
    lid_kg = 4 / 3 * math.pi * RADIUS**3 * densities[5:10].sum()
    assert lid_kg == pytest.approx(drive.mass_kg)
    assert (densities[10:] == compare.SOIL.density_kg_m3).all()


def test_samples_are_read_and_become_stresses_on_the_shear_plane():
    made, setup = specimen(), compare.SHEAR
    forces = {name: 0.0 for name in shear.COLUMNS} | {"floor_grains_x": -3e-4, "floor_x": 1e-4, "lower_x": -2e-4}
    forces |= {"lid_grains_z": 1e-4, "lid_z": 3e-4, "upper_z": 1e-4}
    text = "# Time-averaged data\n# TimeStep ...\n92 " + " ".join(str(value) for value in forces.values()) + "\n"
    samples = shear.read_samples(text)
    assert samples["step"] == [92]
    stresses = shear.history(samples, setup, made, compare.SOIL, compare.SHEAR_ENGINE)
    upper_kg = 20 * 4 / 3 * math.pi * RADIUS**3 * compare.SOIL.density_kg_m3
    assert stresses["shear_stress_pa"] == pytest.approx([4e-4 / setup.area_m2])
    assert stresses["plane_normal_stress_pa"] == pytest.approx([(5e-4 + upper_kg * 9.81) / setup.area_m2])


# --- one contact ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("model", "sense", "radius"),
    [("type_a", "opposite", 1), ("type_a", "same", 1), ("type_c", "opposite", 0.5), ("type_c", "same", 0)],
)
def test_the_radius_in_the_rolling_torque_is_that_of_the_law(model, sense, radius):
    assert contact.ours(model, contact.SENSES[sense]) == pytest.approx(radius, abs=1e-3)


# --- what the checks say --------------------------------------------------------------------------------------------


def runs_with(means, sd=1.0):
    """Runs of every kind, whose heap angles have these means by (model, rolling friction); the rest agrees."""
    low, high = compare.ROLLING_FRICTIONS
    rows = []
    for quantity, test in (("filled height", "heap"), ("angle of repose", "heap"), ("shear strength", "shear")):
        for model in (compare.PEER, "type_c", "type_a"):
            for mu_r in (low, high):
                mean = means[model, mu_r] if quantity != "filled height" else 10.0
                for seed, off in enumerate((-1, 0, 0, 1)):
                    value = mean + off * sd * math.sqrt(1.5)
                    rows.append(
                        {"test": test, "model": model, "rolling_friction": mu_r, "seed": seed, "quantity": quantity, "value": value}
                    )
    exact = {(compare.PEER, "opposite"): 0.5, ("type_a", "same"): 1.0}
    for (model, sense), value in exact.items():
        rows.append(
            {
                "test": "contact",
                "model": model,
                "quantity": "radius in the rolling torque",
                "value": value,
                "status": sense,
                "unit": "r",
            }
        )
    return pd.DataFrame(rows)


def agreeing(**changes):
    low, high = compare.ROLLING_FRICTIONS
    means = {
        ("liggghts", low): 20,
        ("type_c", low): 20,
        ("liggghts", high): 30,
        ("type_c", high): 30,
        ("type_a", low): 33,
        ("type_a", high): 40,
    }
    return means | changes


def failed(means, sd=1.0):
    return [(check.case, check.quantity) for check in compare.checks(runs_with(means, sd)) if not check.passed]


def test_equal_means_and_the_explained_difference_pass():
    assert failed(agreeing()) == []


def test_a_mean_that_is_off_by_more_than_two_standard_errors_fails():
    low, _ = compare.ROLLING_FRICTIONS
    error = math.sqrt(1 / 4 + 1 / 4)
    assert failed(agreeing() | {("type_c", low): 20 + 1.9 * error}) == []
    assert {quantity for _, quantity in failed(agreeing() | {("type_c", low): 20 + 2.1 * error})} == {
        "angle of repose",
        "shear strength",
    }


def test_type_a_no_stronger_than_epsd2_fails():
    low, _ = compare.ROLLING_FRICTIONS
    assert any(quantity.endswith("minus epsd2") for _, quantity in failed(agreeing() | {("type_a", low): 20}))


def test_a_gap_that_doubling_does_not_close_fails():
    _, high = compare.ROLLING_FRICTIONS
    assert any(quantity.endswith("size") for _, quantity in failed(agreeing() | {("liggghts", high): 20, ("type_c", high): 20}))


def test_a_wrong_radius_in_one_contact_fails():
    runs = runs_with(agreeing())
    runs.loc[(runs.test == "contact") & (runs.model == compare.PEER), "value"] = 1.0
    assert [check.passed for check in compare.contact_checks(runs)] == [False, True]


def test_every_kind_of_run_is_made_for_every_seed():
    made = compare.jobs([1, 2, 3])
    assert len(made) == len(set(made)) == 2 * 3 * 2 * 3 + 3 * 2
