"""Jobs: what breaks off or is refused, and a run that goes on from its checkpoint."""

import numpy as np
import pytest

from dem import SimulationError
from dem.experiments.state import State
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.resume import Checkpoint
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.tables import read_table
from virtual_soil.errors import InputError
from virtual_soil.wheel import runs
from virtual_soil.wheel.fields import tables_of
from virtual_soil.wheel.runs import (
    PRESS_HISTORY,
    WHEEL_HISTORY,
    bed_of,
    drive_wheel,
    lower_wheel,
    lowered_of,
    prepare_bed,
    press_plate,
    press_row,
    push_cone,
    recorded,
    steer_density,
    store,
    store_bed,
    store_preparation,
    wheel_row,
    with_preparation,
)

ROW = {
    "radius_m": 1e-3, "radius_sd_ratio": 0.05, "density_kg_m3": 2500.0, "poisson_ratio": 0.2, "shear_modulus_pa": 1e6,
    "static_friction": 0.5, "rolling_friction": 0.1, "restitution": 0.3,
}  # fmt: skip
WHEEL = {name: value for name, value in defaults(Study)["wheel"].items() if name not in ("bed", "cases", "slips")}
WHEEL |= {"load_n": 0.1, "speed_m_s": 0.05, "travel_ratio": 0.5}
WHEEL["shape"] |= {"radius_m": 0.010, "width_m": 0.008}
JOB = {
    "soil": {"row": ROW},
    "grains": {},
    "engine": {"time_step_rayleigh_ratio": 0.4},
    "bed": {"length_m": 0.047, "width_m": 0.020, "depth_m": 0.015},
    "wheel": WHEEL,
    "plate": {"depth_m": 0.02, "speed_m_s": 0.1, "static_friction": 0.5},
    "cone": {"base_area_m2": 3e-6, "angle_deg": 60.0, "depth_m": 0.002, "speed_m_s": 0.1, "static_friction": 0.5},
}


class Interrupted(Checkpoint):
    """Ends the job when the wheel has travelled a little."""

    def keep(self, state):
        if state.stage == "travel" and len(state.notes["samples"]) % 60 == 0:
            self.save(state)
            raise SystemExit(143)


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """File of a bed, and its row."""
    folder = tmp_path_factory.mktemp("bed")
    path = str(folder / "bed.npz")
    return path, prepare_bed(JOB, 1, path, Checkpoint(str(folder / "preparation.npz"), 300, {}))


def lowered_on(bed, path, job=JOB):
    """File of the wheel on the bed of a file."""
    lower_wheel(job, bed, path, Checkpoint(f"{path}.kept.npz", 300, {}))
    return path


class Watched(Checkpoint):
    """Remembers stage and number of threads whenever the job could have saved its state."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.seen = []

    def keep(self, state):
        self.seen.append((state.stage, state.simulation._runner.threads))


def test_a_run_that_breaks_off_has_a_reason_and_one_that_is_refused_ends_the_job(prepared, tmp_path):
    def failing(error):
        def run(**_):
            raise error

        return run

    def begin():
        return State(bed_of(prepared[0]).simulation, "lower", 0)

    checkpoint = Checkpoint(str(tmp_path / "run.npz"), 300, {})
    assert recorded(failing(SimulationError("grains fell")), begin, {}, checkpoint) == (None, "grains fell")
    with pytest.raises(CalibrationError, match="wheel, plate or cone: depth_m is 1; allowed: 0.5"):
        recorded(failing(ValueError("depth_m is 1; allowed: 0.5")), begin, {}, checkpoint)


@pytest.mark.parametrize(("schema", "row"), [("wheel", wheel_row), ("press", press_row)])
def test_a_run_that_broke_off_is_stored_with_its_reason(tmp_path, schema, row):
    frictions = ("wheel_static_friction", "wheel_rolling_friction")
    size = dict.fromkeys(("radius_m", "width_m", "applied_load_n", *frictions, "diameter_m", "area_m2"), 1.0)
    size |= {"depth_m": 1.0, "speed_m_s": 1.0, "asked_slip": 0.5, "held": "travel", "rim": "smooth", "wall_time_s": 0.1}
    tables = {"history": {name: [] for name in {"wheel": WHEEL_HISTORY, "press": PRESS_HISTORY}[schema]}}
    tables |= tables_of(None, None, None) if schema == "wheel" else {}
    output = {name: str(tmp_path / f"{name}.parquet") for name in ("run", *tables)}
    store({"case": "sand", "bed_seed": "7"}, row(None, "grains fell") | size, tables, output, schema, {})
    found = read_table(output["run"], f"{schema}_run").iloc[0]
    assert (found["case"], found["seed"], found["status"], found["reason"]) == ("sand", 7, "failed", "grains fell")
    assert all(len(read_table(output[name], f"{schema}_{name}")) == 0 for name in tables)
    assert len(tables) == {"wheel": 4, "press": 1}[schema]


def test_a_file_that_is_no_bed_is_named(tmp_path):
    path = tmp_path / "bed.npz"
    path.write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"bed\.npz: not a bed of this version \(.*\) Delete it and run again"):
        bed_of(path)


def test_a_file_that_is_no_lowered_wheel_is_named(prepared):
    with pytest.raises(InputError, match=r"bed\.npz: not a lowered wheel of this version \(.*\) Delete it and run again"):
        lowered_of(prepared[0])


def test_an_interrupted_wheel_goes_on_with_the_same_numbers_on_more_threads_too(prepared, tmp_path):
    (bed, _), saved = prepared, str(tmp_path / "run.npz")
    lowered = lowered_on(bed, str(tmp_path / "lowered.npz"))
    whole_row, whole = drive_wheel(JOB, "0.5", bed, lowered, Checkpoint(str(tmp_path / "other.npz"), 300, {}))
    with pytest.raises(SystemExit):
        drive_wheel(JOB, "0.5", bed, lowered, Interrupted(saved, 300, {"slip": "0.5"}))
    resumed = Watched(saved, 300, {"slip": "0.5"}, 2)
    row, tables = drive_wheel(JOB, "0.5", bed, lowered, resumed)
    assert set(resumed.seen) == {("travel", 2)}
    assert (row["status"], row["n_steps"]) == ("done", whole_row["n_steps"])
    assert row["motor_work_j"] == whole_row["motor_work_j"]
    assert min(len(next(iter(columns.values()))) for columns in tables.values()) > 30
    for name, columns in tables.items():
        for column, values in columns.items():
            assert np.array_equal(values, whole[name][column], equal_nan=True), (name, column)


def test_a_wheel_that_breaks_off_while_it_is_lowered_has_failed_runs_with_its_reason(prepared, tmp_path, monkeypatch):
    def broken(*_, **__):
        raise SimulationError("grains fell")

    monkeypatch.setattr(runs.wheel, "lower", broken)
    lowered = lowered_on(prepared[0], str(tmp_path / "lowered.npz"))
    row, tables = drive_wheel(JOB, "0.5", prepared[0], lowered, Checkpoint(str(tmp_path / "run.npz"), 300, {}))
    assert (row["status"], row["reason"], row["n_steps"]) == ("failed", "grains fell", 0)
    assert all(len(column) == 0 for columns in tables.values() for column in columns.values())


def test_a_bed_is_stored_with_its_density(prepared, tmp_path):
    _, row = prepared
    store_bed({"case": "sand", "bed_seed": "1"}, row, str(tmp_path / "bed.parquet"), {})
    found = read_table(str(tmp_path / "bed.parquet"), "wheel_bed").iloc[0]
    assert found["solid_fraction"] == pytest.approx(0.57, abs=0.06)
    assert found["bulk_density_kg_m3"] == pytest.approx(2500.0 * found["solid_fraction"])
    assert (found["case"], found["seed"], found["grain_radius_m"]) == ("sand", 1, 1e-3)


def test_a_tool_that_does_not_fit_its_bed_is_refused_in_one_line(prepared, tmp_path):
    checkpoint = Checkpoint(str(tmp_path / "run.npz"), 300, {})
    for run, message in (
        (lambda: press_plate(JOB, 0.008, prepared[0], checkpoint), r"depth_m of the plate is 0\.02; allowed: at most 0\.00"),
        (lambda: press_plate(JOB, 0.018, prepared[0], checkpoint), r"diameter of the plate is 0\.018; allowed: at most 0\.016"),
        (
            lambda: push_cone(JOB, prepared[0], checkpoint),
            r"diameter of the cone is .* m, 0\.977 grain diameters; allowed: at least 3",
        ),
    ):
        with pytest.raises(CalibrationError, match=message) as refusal:
            run()
        assert "\n" not in str(refusal.value)


def test_a_density_that_these_grains_do_not_reach_is_refused_with_what_they_reach():
    message = (
        r"wheel\.bed\.bulk_density_kg_m3 is 1000, with grains of 2500 kg/m3: solid_fraction of the bed is 0\.4; "
        r"allowed: 0\.\d+ to 0\.\d+, as these grains pack with 4 times their friction and with none"
    )
    with pytest.raises(CalibrationError, match=message) as refusal:
        steer_density(JOB, 1, 1000.0)
    assert "\n" not in str(refusal.value)
    row = steer_density(JOB, 1, 1000.0, nearest=True)
    assert row["preparation_friction_ratio"] == 4.0
    assert 0.4 < row["solid_fraction"] < 0.6
    assert row["bulk_density_kg_m3"] == pytest.approx(2500.0 * row["solid_fraction"])
    assert row["asked_bulk_density_kg_m3"] == 1000.0
    assert steer_density(JOB, 1, 2000.0, nearest=True)["preparation_friction_ratio"] == 0.0


def test_a_bed_is_prepared_with_the_ratio_that_was_found(tmp_path):
    path = str(tmp_path / "preparation.parquet")
    row = {"asked_bulk_density_kg_m3": 1400.0, "preparation_friction_ratio": 1.75, "solid_fraction": 0.56}
    store_preparation("sand", row | {"bulk_density_kg_m3": 1401.0}, path, {})
    bed = {"length_m": 1.0, "preparation_friction_ratio": 1.0}
    assert with_preparation(bed, path) == {"length_m": 1.0, "preparation_friction_ratio": 1.75}
    assert with_preparation(bed, None) == bed
