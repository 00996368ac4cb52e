"""Small bulk benchmarks: a ball into a bed, a drum, a silo, in our code and, where it is installed, in LIGGGHTS."""

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import dem
from dem.contact.laws import hertz, mindlin
from virtual_soil.bulk import compare, cost, drum, impact, peer, silo
from virtual_soil.bulk.materials import STEEL, interactions, materials
from virtual_soil.bulk.packings import Packing, of_table, packing_file, to_table
from virtual_soil.bulk.run import steps_per_sample
from virtual_soil.bulk.variants import CODES, LIGGGHTS, OURS, packing_name, variants
from virtual_soil.campaign.cost import HEADROOM, requested_min, simulated_s
from virtual_soil.errors import InputError
from virtual_soil.verification.peers import liggghts

RADIUS_M = 1e-3
IMPACT = impact.Setup(
    half_x_m=12e-3, half_y_m=12e-3, bottom_m=0.0, ball_radius_m=4e-3, ball_z_m=0.04, ball_speed_m_s=1.0, softening=100.0,
    time_step_s=1.25e-6, sample_s=2.5e-4, duration_s=15e-3, clearance_m=2e-3,
)  # fmt: skip
DRUM = drum.Setup(radius_m=0.03, half_length_m=6e-3, turn_rate_rad_s=4.0, duration_s=0.5)
SILO = silo.Setup(
    orifice_radius_m=12e-3, bottom_m=-23e-3, cone_top_m=0.0, top_m=0.15, cylinder_radius_m=35e-3, n_grains=2500, duration_s=0.6
)  # fmt: skip
needs_liggghts = pytest.mark.skipif(not liggghts.installed(), reason="LIGGGHTS is not installed")


def lattice(low, high, spacing):
    axes = [np.arange(a, b, spacing) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.fixture(scope="module")
def bed():
    """Poured bed of the impact's box."""
    simulation = dem.Simulation(
        materials=materials(impact.NAMES, IMPACT.softening), interactions=interactions(impact.NAMES),
        smallest_radius_m={"M1": RADIUS_M}, time_step_s=1e-5, walls=impact.walls(IMPACT),
    )  # fmt: skip
    region = dem.BoxRegion(low_m=(-12e-3, -12e-3), high_m=(12e-3, 12e-3), bottom_m=0.0)
    simulation.add_factory(
        dem.Factory(n_grains=1000, region=region, sizes=dem.Sizes(mean_m=RADIUS_M), material="M1", seed=1)
    )  # fmt: skip
    assert simulation.run(1.0, until=lambda now: now.is_static(1e-6))
    grains = simulation.grains
    return Packing(positions_m=grains.positions_m, radii_m=grains.radii_m, materials=np.full(len(grains), "M1"))


@pytest.fixture(scope="module")
def charge():
    """Loose charge in the lower half of the drum: large grains below small ones."""
    positions, radii, names = [], [], []
    for name, radius, low, high in (("M1", 1e-3, -14e-3, 0.0), ("M2", 2e-3, -0.03, -16e-3)):
        margin = 1.05 * radius
        end = DRUM.half_length_m - margin
        places = lattice((-0.03, -end, low + margin), (0.03, end + 1e-9, high), 2.1 * radius)
        places = places[np.hypot(places[:, 0], places[:, 2]) < DRUM.radius_m - margin]
        positions.append(places)
        radii.append(np.full(len(places), radius))
        names.append(np.full(len(places), name))
    return Packing(positions_m=np.concatenate(positions), radii_m=np.concatenate(radii), materials=np.concatenate(names))


@pytest.fixture(scope="module")
def filling():
    return silo.fill(SILO, seed=1)


# --- impact ----------------------------------------------------------------------------------------------------------


def falls_freely_then_stops(run, packing):
    start = impact.late_start(packing, IMPACT)
    heights, speeds = run.values["ball_z_m"], run.values["ball_speed_m_s"]
    falling = run.times_s < IMPACT.clearance_m / (1.01 * start.speed_m_s)
    assert falling.sum() >= 4
    assert heights[falling] == pytest.approx(impact.free_fall_m(run.times_s[falling], start), abs=1e-7)
    assert heights[-1] < impact.first_touch_m(packing, IMPACT) - 0.5e-3
    assert heights.min() > IMPACT.bottom_m + IMPACT.ball_radius_m
    assert abs(speeds[-1]) < 0.3 * start.speed_m_s
    assert (run.values["grains"] == len(packing) + 1).all()


@pytest.fixture(scope="module")
def struck(bed):
    return impact.ours(bed, IMPACT)


def test_a_ball_falls_freely_until_the_bed_stops_it(bed, struck):
    falls_freely_then_stops(struck, bed)


def test_the_first_touch_is_that_of_two_spheres():
    grain = Packing(positions_m=np.array([[3e-3, 0.0, 1e-3]]), radii_m=np.array([RADIUS_M]), materials=np.array(["M1"]))
    assert impact.first_touch_m(grain, IMPACT) == pytest.approx(1e-3 + 4e-3)  # 3, 4, 5
    start = impact.late_start(grain, IMPACT)
    assert start.z_m == pytest.approx(1e-3 + 4e-3 + IMPACT.clearance_m)
    fallen = IMPACT.ball_speed_m_s * start.time_s + 0.5 * 9.8 * start.time_s**2
    assert IMPACT.ball_z_m - fallen == pytest.approx(start.z_m)


@pytest.mark.parametrize("change", [{"ball_z_m": 0.001}, {"shift_m": (1.0, 0.0)}])
def test_a_ball_that_is_in_the_bed_or_misses_it_is_refused(bed, change):
    with pytest.raises(ValueError, match="ball_z_m is"):
        impact.late_start(bed, replace(IMPACT, **change))


@needs_liggghts
def test_liggghts_has_the_same_impact(bed, struck, tmp_path):
    theirs = impact.of_liggghts(bed, IMPACT, tmp_path)
    falls_freely_then_stops(theirs, bed)
    assert np.allclose(theirs.times_s, struck.times_s, rtol=0.0, atol=1e-9)
    both = [run.values["ball_z_m"] for run in (struck, theirs)]
    assert np.abs(both[0] - both[1]).max() < 0.3e-3


# --- drum ------------------------------------------------------------------------------------------------------------


def turns_to_positive_x(run, packing):
    end = {name: values[-5:].mean() for name, values in run.values.items()}
    first = {name: values[0] for name, values in run.values.items()}
    assert min(end["x_M1"], end["x_M2"]) > 0.1 * DRUM.radius_m
    in_zones = [[sum(counts[f"{zone}_{name}"] for name in drum.GRAINS) for counts in (first, end)] for zone in drum.ZONES]
    assert in_zones[0][0] == 0
    assert in_zones[0][1] > 10
    assert in_zones[1][1] < 0.7 * in_zones[1][0]
    assert (run.values["grains"] == len(packing)).all()


def test_a_drum_carries_its_grains_to_the_side_where_it_rises(charge):
    assert (charge.materials == "M2").sum() > 20
    turns_to_positive_x(drum.ours(charge, DRUM), charge)


def test_a_drum_that_turns_the_other_way_carries_them_to_the_other_side(charge):
    run = drum.ours(charge, replace(DRUM, turn_rate_rad_s=-4.0))
    assert run.values["x_M1"][-5:].mean() < -0.1 * DRUM.radius_m


def test_starts_of_the_drum_differ_by_a_micrometre_in_every_place(charge):
    first, *others = (drum.started(charge, replace(DRUM, start=start)).positions_m for start in range(3))
    assert np.array_equal(first, charge.positions_m)
    for other in others:
        assert 0.0 < np.abs(other - first).min() < np.abs(other - first).max() <= drum.SHIFT_M
    assert not np.array_equal(*others)
    assert [setup.start for setup in drum.SETUPS.values()] == [0, 1, 2, 0, 1, 2, 0]


def test_shell_and_plates_turn_together_in_both_codes(charge, tmp_path, monkeypatch):
    assert [wall.angular_velocity_rad_s for wall in drum.walls(DRUM)] == 3 * [(0.0, 0.0, -4.0)]
    seen = []
    monkeypatch.setattr(peer, "sampled", lambda folder, lines, *rest: seen.extend(lines))
    drum.of_liggghts(charge, DRUM, tmp_path)
    assert [line.split()[1] for line in seen if line.endswith("axis 0. 0. 1. omega -4")] == ["front", "back"]
    assert "fix walls all wall/gran model hertz tangential history mesh n_meshes 2 meshes front back" in seen
    assert [line.split()[2] for line in seen if "zcylinder 0.03 0.0 0.0 shear x" in line] == ["M1", "M2"]


def test_zones_are_counted_by_the_signs_of_x_and_z():
    positions = np.array([[1.0, 0.0, 1.0], [-1.0, 0.0, -1.0], [-2.0, 0.0, -3.0], [1.0, 0.0, -1.0], [-1.0, 5.0, 1.0]])
    is_of = {"M1": np.array([True, True, True, True, False]), "M2": np.array([False, False, False, False, True])}
    found = drum.counted(positions, is_of)
    assert [found[name] for name in ("zone_1_M1", "zone_2_M1", "zone_1_M2", "zone_2_M2")] == [1, 2, 0, 0]
    assert (found["x_M1"], found["z_M1"], found["x_M2"]) == (-0.25, -1.0, -1.0)


@needs_liggghts
def test_liggghts_shell_drags_each_grain_at_the_speed_of_its_surface(tmp_path):
    """The first step against grains at the lowest line: the dashpot's force at the speed w R, here beyond Coulomb's limit."""
    radii, overlap, dt = np.array([1e-3, 2e-3]), 1e-5, 1e-9
    places = np.column_stack([radii - overlap - DRUM.radius_m, np.zeros(2), [-4e-3, 4e-3]])
    pair, wide = Packing(positions_m=places, radii_m=radii, materials=np.array(drum.GRAINS)), 1.2 * DRUM.radius_m
    lines = [
        *peer.grains_lines(tmp_path, pair, [(-wide, wide)] * 3, drum.NAMES),
        *peer.material_lines(drum.NAMES, 500.0),
        *drum.shell_lines(pair, DRUM),
        f"timestep {dt}",
    ]
    values = {name: f"fcm({name},y)" for name in drum.GRAINS} | {"grains": "count(all)"}
    run = peer.sampled(tmp_path, lines, values, 2, peer.Clock(dt, dt, dt))
    solids, touches = materials(drum.NAMES, 500.0), interactions(drum.NAMES)
    for r, name in zip(radii, drum.GRAINS, strict=True):
        G_star, _ = mindlin.column_values(solids[name], solids[STEEL], touches[name, STEEL])
        mass_kg, beta = solids[name].density_kg_m3 * 4.0 / 3.0 * np.pi * r**3, hertz.damping_ratio(touches[name, STEEL].restitution)
        damping = mindlin.damping_constant(G_star, r, mass_kg, beta) * overlap**0.25
        assert run.values[name][-1] == pytest.approx(damping * DRUM.turn_rate_rad_s * DRUM.radius_m, rel=1e-3)


@needs_liggghts
def test_liggghts_drum_turns_the_same_way(charge, tmp_path):
    turns_to_positive_x(drum.of_liggghts(charge, DRUM, tmp_path), charge)


# --- silo ------------------------------------------------------------------------------------------------------------


def flows_steadily(run, packing):
    """Within a fifth of Beverloo's law, which is for flat bottoms; and constant within what departures by chance would show."""
    above = run.values["above"]
    chosen = silo.steady(run.times_s, above, silo.in_cone(packing, SILO))
    outflow, change = silo.outflow_per_s(run.times_s[chosen], above[chosen])
    assert outflow == pytest.approx(silo.beverloo_per_s(SILO), rel=0.2)
    n_left = above[chosen][0] - above[chosen][-1]
    assert abs(change) < 2.0 * np.sqrt(12.0 / n_left)  # two standard deviations of the trend of independent departures
    assert (np.diff(above) <= 0).all()
    falling = run.values["grains"] - above
    assert (falling >= 0).all()
    assert falling.max() > 5  # between the orifice and where they leave
    return outflow


def test_a_silo_fills_to_rest_above_its_orifice(filling):
    assert len(filling) == SILO.n_grains
    x, y, z = filling.positions_m.T
    assert z.min() > SILO.bottom_m
    assert z.max() < SILO.top_m
    wide = SILO.orifice_radius_m + np.clip(z - SILO.bottom_m, 0.0, SILO.cylinder_radius_m - SILO.orifice_radius_m)
    assert (np.hypot(x, y) < wide).all()
    assert 0 < silo.in_cone(filling, SILO) < len(filling)


def test_a_silo_runs_out_steadily_as_beverloo_says(filling):
    flows_steadily(silo.ours(filling, SILO), filling)


@pytest.mark.parametrize(("setup", "expected"), [("small", 6900.0), ("large", 21_700.0)])
def test_the_benchmarks_outflows_are_beverloos(setup, expected):
    assert silo.beverloo_per_s(silo.SETUPS[setup]) == pytest.approx(expected, rel=0.01)


def test_outflow_and_its_change_are_those_of_a_parabola():
    times = np.linspace(0.1, 0.5, 41)
    outflow, change = silo.outflow_per_s(times, 1000.0 - 200.0 * times - 50.0 * (times - 0.3) ** 2)
    assert outflow == pytest.approx(200.0)
    assert change == pytest.approx(100.0 * 0.4 / 200.0)
    with pytest.raises(ValueError, match="samples of the steady outflow are 4"):
        silo.outflow_per_s(times[:4], times[:4])


def test_more_grains_than_the_silo_holds_are_refused():
    with pytest.raises(ValueError, match="n_grains is 20000"):
        silo.fill(replace(SILO, n_grains=20_000), seed=1)


@needs_liggghts
def test_liggghts_runs_out_as_fast(filling, tmp_path):
    short = replace(SILO, duration_s=0.2)
    above = [run.values["above"] for run in (silo.ours(filling, short), silo.of_liggghts(filling, short, tmp_path))]
    assert above[0][0] == above[1][0] == len(filling)
    assert above[0][-1] < 0.95 * len(filling)
    assert np.abs(above[0] - above[1]).max() < 0.03 * len(filling)


# --- shared ----------------------------------------------------------------------------------------------------------


def test_steel_keeps_its_stiffness_in_both_codes():
    lines = "\n".join(peer.material_lines(drum.NAMES, 500.0))
    assert "youngsModulus peratomtype 2000000 1000000 2.1e+11" in lines
    assert "coefficientFriction peratomtypepair 3 0.3 0.2 0.2 0.2 0.4 0.2 0.2 0.2 0.5" in lines
    ours = materials(drum.NAMES, 500.0)
    assert [2.4 * ours[name].shear_modulus_pa for name in drum.NAMES] == pytest.approx([2e6, 1e6, 210e9])
    assert interactions(drum.NAMES)["M1", "M2"].restitution == 0.45


@pytest.mark.parametrize("sample_s", [2.6e-6, 1e-6])
def test_samples_between_steps_are_refused(bed, sample_s):
    with pytest.raises(ValueError, match=f"sample_s is {sample_s}"):
        impact.ours(bed, replace(IMPACT, sample_s=sample_s))


@pytest.mark.parametrize("setup", [impact.Setup(), *drum.SETUPS.values(), *silo.SETUPS.values()])
def test_the_benchmarks_samples_fall_on_steps(setup):
    steps = steps_per_sample(setup.sample_s, setup.time_step_s)
    assert round(setup.duration_s / setup.sample_s) * steps * setup.time_step_s == pytest.approx(setup.duration_s)


def test_a_run_that_was_ended_early_is_refused():
    text = "# samples\n# TimeStep v_a v_b\n0 1 2\n10 3 4\n"
    steps, columns = peer.read_samples(text, ["a", "b"], 10)
    assert (steps.tolist(), columns["b"].tolist()) == ([0.0, 10.0], [2.0, 4.0])
    with pytest.raises(liggghts.PeerError, match="last sample is of step 10, not of 20"):
        peer.read_samples(text, ["a", "b"], 20)
    with pytest.raises(liggghts.PeerError, match="of step none"):
        peer.read_samples("# samples\n", ["a", "b"], 20)


def test_a_packing_that_is_not_there_is_named_with_its_setting(tmp_path):
    with pytest.raises(InputError, match=re.escape(f"bulk.packings is {tmp_path}, which has no drum_38000.parquet")) as refusal:
        packing_file(tmp_path, "drum_38000")
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda table: table.drop(columns="z_m"), "has no column z_m"),
        (lambda table: table.assign(radius_m=0.0), "has 2 grains; needed"),
        (lambda table: table.assign(x_m=np.nan), "has 2 grains; needed"),
        (lambda table: table[:0], "has 0 grains; needed"),
    ],
)
def test_a_table_that_is_no_packing_is_refused(change, message):
    table = pd.DataFrame({"radius_m": 1e-3, "x_m": [0.0, 1.0], "y_m": 0.0, "z_m": 0.0, "material": ["M2", "M1"]})
    with pytest.raises(InputError, match=message):
        of_table(change(table), "file")
    grouped = to_table(of_table(table, "file"))
    assert grouped[["x_m", "material"]].to_numpy().tolist() == [[1.0, "M1"], [0.0, "M2"]]


def test_the_scatter_between_starts_stands_beside_the_difference():
    def starts(*values):
        return [pd.DataFrame({"ball_z_m": [value, 2.0 * value]}, index=[0.0, 1.0]) for value in values]

    found = compare.apart(starts(1.0, 3.0), starts(1.0, 2.0), "ball_z_m")
    assert found.difference == pytest.approx([0.5, 1.0])
    assert found.sd_ours == pytest.approx([np.sqrt(2.0), np.sqrt(8.0)])
    with pytest.raises(ValueError, match="starts are 1"):
        compare.apart(starts(1.0), starts(1.0, 2.0), "ball_z_m")
    late = [run.set_axis([0.0, 2.0]) for run in starts(1.0, 2.0)]
    with pytest.raises(ValueError, match="different times"):
        compare.apart(starts(1.0, 2.0), late, "ball_z_m")


def test_settings_choose_the_runs():
    settings = {"impact_grains": [25_000, 50_000], "drum": "hard", "silo": "full"}
    found = variants(settings)
    assert found["impact"] == [f"{n}_{k}" for n in (25_000, 50_000) for k in range(6)]
    assert (found["drum"], found["silo"]) == (["hard_0", "hard_1", "hard_2", "hard_beginning"], ["small_full", "large_full"])
    assert [packing_name(case, names[-1]) for case, names in found.items()] == [
        "penetration_50000", "drum_38000", "silo_large_full",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("case", "variant", "grains", "steps", "processor_s"),
    [
        ("impact", "25000_0", 25_000, 24_000, {OURS: 18.0, LIGGGHTS: 158.0}),
        ("drum", "soft_0", 38_000, 32_000, {OURS: 242.0, LIGGGHTS: 461.0}),
        ("silo", "small", 30_000, 15_000, {OURS: 47.0, LIGGGHTS: 127.0}),
    ],
)
def test_the_published_runs_are_expected_to_take_what_they_took(case, variant, grains, steps, processor_s):
    """Numbers of docs/bulk-benchmarks.md; an expectation is that of the slowest run, so others take less, but none much more."""
    for code in CODES:
        n, model_steps = cost.of_run(case, code, variant)
        assert n == grains
        assert model_steps == pytest.approx(cost.FACTORS[code] * steps)
        expected_s = simulated_s(n, model_steps, clumps=False)
        assert processor_s[code] < 1.5 * expected_s < HEADROOM * expected_s < 60.0 * requested_min(expected_s, 1)
        assert expected_s < 10.0 * processor_s[code]


def test_a_full_silo_gets_hours_and_a_filling_the_time_of_its_limit():
    hours = {
        name: requested_min(simulated_s(*cost.of_run("silo", OURS, name), clumps=False), 1) / 60.0
        for name in ("small", "small_full")
    }
    assert hours["small"] < 1.0 < 24.0 < hours["small_full"]
    n, steps = cost.of_filling("large")
    assert (n, steps) == (30_000, pytest.approx(cost.FACTORS[OURS] * silo.REST_TIME_S / 4e-5))
