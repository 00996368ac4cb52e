"""What the report's interactive views are given: stored grains found again, packed, counted, chosen and labelled."""

import base64
import gzip
import json
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from dem import Grains, Tube
from virtual_soil.campaign.experiments.repose.recording import frame_table
from virtual_soil.campaign.stored import stored
from virtual_soil.campaign.tables import stack_tables, write_table
from virtual_soil.report import pack, views
from virtual_soil.report.experiments import repose
from virtual_soil.report.study import before_and_after

MATERIAL = {
    "radius_m": 5e-5, "static_friction": 0.3, "rolling_friction": 0.1, "density_kg_m3": 3000.0, "poisson_ratio": 0.2,
    "shear_modulus_pa": 5e7, "restitution": 0.5,
}  # fmt: skip


def grains(places, radii=1e-3):
    places = np.array(places, float)
    columns = dict(zip(("x_m", "y_m", "z_m"), places.T, strict=True))
    return pd.DataFrame({**columns, "radius_m": np.broadcast_to(radii, len(places)).copy(), "speed_m_s": 0.0})


def unpacked(header):
    """What views.js makes of packed grains: places in mm and scalars, in the stored order."""
    n = header["n"]
    planes = np.frombuffer(gzip.decompress(base64.b64decode(header["data"])), np.uint8).reshape(-1, n).astype(np.uint32)
    steps = [planes[k] + 256 * planes[k + 1] for k in (0, 2, 4)]
    steps[0] = np.cumsum(steps[0]) % 65536
    places = np.array(header["low_mm"]) + header["step_mm"] * np.array(steps).T
    scalars = {
        name: low + (high - low) * planes[6 + k] / header["levels"]
        for k, (name, (low, high)) in enumerate(header["scalars"].items())
    }
    return places, scalars


def test_packed_grains_keep_their_places_and_colours():
    random = np.random.default_rng(3)
    table = grains(random.normal(0.0, 0.02, (500, 3)))
    touching, way = random.integers(0, 13, 500), random.exponential(1.0, 500)
    places, scalars = unpacked(pack.packed_grains(table, {"coordination": touching, "displacement": way}))
    order = np.argsort(table["x_m"], kind="stable")
    assert np.abs(places - 1e3 * table[["x_m", "y_m", "z_m"]].to_numpy()[order]).max() <= 0.5001 / pack.STEPS_PER_RADIUS
    assert scalars["coordination"].tolist() == touching[order].tolist()
    shown = np.minimum(way[order], np.quantile(way, pack.COLOUR_QUANTILE))
    assert np.abs(scalars["displacement"] - shown).max() <= 0.51 * np.ptp(shown) / pack.LEVELS


def test_grains_of_several_sizes_keep_them():
    radii = np.linspace(1e-3, 2e-3, 50)
    _, scalars = unpacked(pack.packed_grains(grains(np.random.default_rng(1).random((50, 3)), radii), {}))
    assert sorted(scalars["radius"]) == pytest.approx(1e3 * radii, abs=0.01)
    assert "radius" not in pack.packed_grains(grains(np.eye(3)), {})["scalars"]


def test_grains_far_apart_still_fit_in_the_steps():
    places, _ = unpacked(pack.packed_grains(grains([[0, 0, 0], [90.0, 0, 0]], 1e-4), {}))
    assert places[:, 0] == pytest.approx([0.0, 90e3], rel=1e-4)


def test_packed_json_has_no_nan():
    text = gzip.decompress(base64.b64decode(pack.packed_json({"a": np.array([1.23456, np.nan]), "b": [np.inf, 2]})))
    assert json.loads(text) == {"a": [1.235, None], "b": [None, 2]}


def test_grains_of_a_cubic_lattice_touch_their_neighbours():
    """Six inside, three in a corner; across the period two more."""
    side = 0.00199 * np.arange(4)
    lattice = grains(np.array(np.meshgrid(side, side, side)).reshape(3, -1).T)
    counts = views.coordination(lattice)
    assert (counts.min(), counts.max(), counts.sum()) == (3, 6, 2 * 3 * 48)
    shifted = lattice.assign(y_m=lattice["y_m"] - 0.003)
    assert views.coordination(shifted, periodic_m=4 * 0.00199).sum() == 2 * (3 * 48 + 16)


def test_grains_that_do_not_quite_touch_are_no_contact():
    assert views.coordination(grains([[0, 0, 0], [0.00201, 0, 0]])).tolist() == [0, 0]
    assert views.coordination(grains([[0, 0, 0], [0.00201, 0, 0]], [1e-3, 1.02e-3])).tolist() == [1, 1]
    assert views.coordination(grains(np.zeros((0, 3)))).tolist() == []


def test_spheres_of_one_clump_are_no_contact_and_a_clump_has_those_of_all_its_spheres():
    """Three dimers in a row: each overlaps itself, and touches the next."""
    row = grains([[0.00149 * k, 0, 0] for k in range(6)], 1e-3).assign(x_m=[0, 0.001, 0.0029, 0.0039, 0.0058, 0.0068])
    assert views.coordination(row.assign(clump=[0, 0, 1, 1, 2, 2])).tolist() == [1, 1, 2, 2, 1, 1]
    assert views.coordination(row).tolist() == [1, 2, 2, 2, 2, 1]


def test_the_heap_s_picture_and_its_table_count_clumps():
    spheres = grains([[0.001 * k, 0, 1e-3] for k in range(6)], 1e-3)
    dimers = spheres.assign(clump=[0, 0, 1, 1, 2, 2], clump_radius_m=1.19e-3)
    for state, words in ((spheres, "6 grains of 1 mm"), (dimers, "3 grains of 1.19 mm")):
        left, _ = repose.heap(state, state, 0.0, 5e-3).axes
        assert words in left.get_title()
    assert {"clump", "clump_radius_m"} < set(before_and_after(dimers, dimers))
    assert "clump" not in before_and_after(spheres, spheres)


def test_the_way_of_grains_is_unknown_where_some_were_lost():
    before = grains([[0, 0, 0], [0, 0, 1e-3]])
    assert views.moved(before, grains([[0, 3e-3, 4e-3], [0, 0, 1e-3]])).tolist() == pytest.approx([5.0, 0.0])
    assert views.moved(before, grains([[0, 0, 0]])) is None
    assert "displacement" not in views.snapshot(before, grains([[0, 0, 0]]))["scalars"]


def test_stored_grains_are_found_by_simulation(tmp_path):
    tables = {"aaa": grains([[0, 0, 1]]), "bbb": grains([[0, 0, 2], [0, 0, 3]]), "ccc": grains(np.zeros((0, 3)))}
    paths = {name: str(tmp_path / f"{name}.parquet") for name in tables}
    for name, table in tables.items():
        write_table(table.assign(simulation=name), paths[name], "grains", {})
    batch = str(tmp_path / "batch.parquet")
    stack_tables({name: paths[name] for name in ("bbb", "ccc")}, batch, {})
    found = stored([paths["aaa"], batch, batch], "grains")
    assert {name: table["z_m"].tolist() for name, table in found.items()} == {"aaa": [1.0], "bbb": [2.0, 3.0]}
    assert all(list(table) == list(tables["aaa"]) for table in found.values())


def test_a_surrogate_that_the_optimiser_uses_is_not_offered_again():
    power, process = SimpleNamespace(model="quadratic"), SimpleNamespace(model="gaussian_process")
    found = views.others({"cohesion": power, "friction_angle": power}, {"cohesion": process, "friction_angle": power})
    assert found == {"cohesion": power}


def rows(*points):
    """Design rows of heaps that differ from the base set as given."""
    return pd.DataFrame(
        [
            {**MATERIAL, **point, "point_id": f"p{k}", "simulation_id": f"s{k}", "experiment": "repose", "fidelity": "campaign",
             "normal_stress_pa": np.nan, "seed": 1}
            for k, point in enumerate(points)
        ]
    )  # fmt: skip


CALIBRATION = pd.DataFrame(
    [{"case": "moon_dust", "surrogate": "ours", "radius_m": 7e-5, "static_friction": 0.9, "rolling_friction": 0.2}]
)


def test_points_are_named_and_the_answer_comes_first():
    optimum = {"radius_m": 7.0001e-5, "static_friction": 0.9, "rolling_friction": 0.2}
    table = views.labelled(rows({"density_kg_m3": 4000.0}, {}, optimum), MATERIAL, CALIBRATION)
    assert table["label"].tolist() == [
        "µs 0.9, µr 0.2, r 70 µm (optimum of moon dust)",
        "µs 0.3, µr 0.1, r 50 µm (base set)",
        "µs 0.3, µr 0.1, r 50 µm, ρ 4000 kg/m³",
    ]


def test_the_first_case_comes_first_and_of_its_tests_the_heap_then_the_largest_stress():
    optimum = {"radius_m": 7e-5, "static_friction": 0.9, "rolling_friction": 0.2}
    first = {"case": "zeta", "surrogate": "ours", "radius_m": 2e-4, "static_friction": 0.5, "rolling_friction": 0.1}
    other = {name: first[name] for name in ("radius_m", "static_friction", "rolling_friction")}
    table = rows(optimum, other, other, other).assign(
        point_id=["p0", "p1", "p1", "p1"], normal_stress_pa=[np.nan, 100.0, np.nan, 900.0]
    )
    shown = views.labelled(table, MATERIAL, pd.concat([pd.DataFrame([first]), CALIBRATION]))
    assert shown["label"].str.extract("optimum of (.*)\\)")[0].tolist() == ["zeta"] * 3 + ["moon dust"]
    assert shown["normal_stress_pa"].fillna(0.0).tolist() == [0.0, 900.0, 100.0, 0.0]


def test_a_large_study_keeps_optima_and_base_set_and_says_what_it_leaves_out():
    optimum = {"radius_m": 7e-5, "static_friction": 0.9, "rolling_friction": 0.2}
    table = views.labelled(rows(optimum, {}, *({"static_friction": s} for s in np.linspace(1, 2, 40))), MATERIAL, CALIBRATION)
    counts = dict.fromkeys(table["simulation_id"], 100)
    kept = views.selected(table, counts, most=1200)
    assert {"s0", "s1"} <= set(kept["simulation_id"])
    assert len(kept) == 12
    others = kept.loc[kept["rank"] == 2, "static_friction"]
    assert (others.min(), others.max()) == (1.0, 2.0)
    assert np.diff(others).max() < 0.2
    assert len(views.selected(table, counts, most=4200)) == 42
    assert len(views.selected(table, counts | {"s5": 0}, most=4200)) == 41


def test_the_grain_view_tells_what_is_missing():
    table = views.labelled(rows({}, {"static_friction": 0.5}), MATERIAL, CALIBRATION)
    heap, nothing = grains([[0, 0, 1e-3]]), grains(np.zeros((0, 3)))
    view, note = views.grain_view(table, {"s0": (heap, heap), "s1": (nothing, nothing)}, {}, {"s0": "A 30°"})
    ((label, runs),) = view["repose"].items()
    assert (label, runs[0]["id"], runs[0]["grains"]["n"]) == ("µs 0.3, µr 0.1, r 50 µm (base set)", "s0", 1)
    assert runs[0]["label"] == "seed 1: A 30°"
    assert note.startswith("1 simulations can be looked at. 1 are left out")


def test_recorded_moments_know_their_grains_and_the_tube():
    def moment(time_s, places, numbers, bottom_m):
        places = np.array(places, float)
        state = Grains(places, np.full_like(places, 2.0), np.zeros_like(places), np.full(len(places), 1e-3))
        tube = Tube(name="tube", material="m", radius_m=3e-3, bottom_m=bottom_m, top_m=1.0)
        return SimpleNamespace(time_s=time_s, grains=state, numbers=np.array(numbers), walls={"tube": tube})

    table = pd.DataFrame(
        frame_table([moment(5.0, [[0, 0, 1e-3], [0, 0, 3e-3]], [0, 1], 0.0), moment(5.5, [[0, 0, 2e-3]], [1], 4e-3)], "s0")
    )
    assert table["time_s"].tolist() == [0.0, 0.0, 0.5]
    assert table["speed_m_s"].tolist() == pytest.approx([12**0.5] * 3)
    first, second = repose.lift_view(table)
    assert second["tube"] == {"radius_mm": 3.0, "bottom_mm": 4.0, "top_mm": 3.0}
    _, scalars = unpacked(second["grains"])
    # the grain that is left began at 3 mm and came down by 1 mm
    assert (scalars["height at the start"].tolist(), scalars["displacement"].tolist()) == ([3.0], [pytest.approx(1.0)])
    assert first["grains"]["n"] == 2
