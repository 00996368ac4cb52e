"""Jobs: prepare a bed, lower and drive a wheel, press a plate or a cone; resumed from checkpoints, with progress in the log."""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from dem import CheckpointError, SimulationError
from dem.experiments import penetration, soil_bed, wheel
from dem.experiments.density import preparation_for
from dem.experiments.penetration import Pressed
from dem.experiments.soil_bed import Setup, SoilBed
from dem.experiments.state import State, load_state, save_state
from dem.experiments.wheel import WheelRun
from virtual_soil.campaign.files import writing
from virtual_soil.campaign.progress import Progress, Stage
from virtual_soil.campaign.resume import Checkpoint
from virtual_soil.campaign.simulate import one_row
from virtual_soil.campaign.tables import read_table, write_table
from virtual_soil.errors import InputError
from virtual_soil.wheel.fields import tables_of
from virtual_soil.wheel.setups import (
    BETWEEN_WARNINGS,
    lowering_of,
    press_test,
    refused,
    shape_of,
    slip_named,
    soil_and_engine,
    test_of,
)

#: Stages of the tests, for the progress line.
BED_STAGES = {"settle": Stage(), "rest": Stage()}
WHEEL_STAGES = {
    "lower": Stage(then="until the soil carries the wheel, "),
    "travel": Stage(done=lambda _, n_looks: n_looks / wheel.N_SAMPLES, exact=True),
}
PRESS_STAGES = {"press": Stage(done=lambda _, n_looks: n_looks / penetration.N_SAMPLES, exact=True)}
#: Stage of a lowered wheel whose simulation broke off.
BROKE_OFF = "broke_off"
#: Columns of the stored time series.
WHEEL_HISTORY = (
    "time_s", "x_m", "sinkage_m", "drawbar_pull_n", "side_force_n", "vertical_force_n", "torque_n_m", "rim_rate_rad_s", "speed_m_s",
    "vertical_speed_m_s", "load_n", "kinetic_energy_j", "overlap_ratio",
)  # fmt: skip
PRESS_HISTORY = ("time_s", "depth_m", "force_n", "pressure_pa", "kinetic_energy_j", "overlap_ratio")


def recorded(run: Callable, begin: Callable[[], State], stages: dict[str, Stage], checkpoint: Checkpoint) -> tuple[Any, str]:
    """Run a test, resuming its checkpoint if there is one; returns (result, ""), or (None, reason) if the simulation broke off.

    begin() : the test at its beginning, without a checkpoint. Raises CalibrationError if the engine refuses the test. Ends the
    job after a signal.
    """
    try:
        with checkpoint.on_signals(), refused("wheel, plate or cone"):
            state = (checkpoint.state() or begin()).with_threads(checkpoint.threads)
            return run(each=Progress(stages), state=state, keep=checkpoint.keep), ""
    except (SimulationError, FloatingPointError) as error:
        print(f"broke off: {error}")
        return None, str(error)


def prepare_bed(job: dict, seed: int, path: str, checkpoint: Checkpoint) -> dict:
    """Prepare a bed and write it to a file; returns its row.

    job : `soil`, `grains`, `engine`, `bed`. Raises InputError if the simulation breaks off: nothing can be measured without a bed.
    """
    soil, engine = soil_and_engine(job)
    setup = Setup(**job["bed"])
    of_bed = (soil, setup, engine, seed)
    bed, reason = recorded(partial(soil_bed.prepare, *of_bed), partial(soil_bed.start, *of_bed), BED_STAGES, checkpoint)
    if bed is None:
        raise InputError(f"The bed of seed {seed} broke off: {reason}")
    with writing(path):
        soil_bed.save_bed(bed, path)
    return bed_row(bed, checkpoint.spent_s, soil.radius_m)


def steer_density(job: dict, seed: int, bulk_density_kg_m3: float, nearest: bool = False) -> dict:
    """Row of the preparation that gives beds a bulk density; job : `soil`, `grains`, `engine`, `bed`. Repeated if interrupted.

    nearest : take what comes nearest if these grains do not pack so loosely or so densely; else CalibrationError.
    """
    soil, engine = soil_and_engine(job)
    fraction = bulk_density_kg_m3 / soil.density_kg_m3
    said = f"wheel.bed.bulk_density_kg_m3 is {bulk_density_kg_m3:g}, with grains of {soil.density_kg_m3:g} kg/m3"
    with refused(said):
        ratio, found = preparation_for(soil, Setup(**job["bed"]), engine, seed, fraction, nearest=nearest)
    return {
        "asked_bulk_density_kg_m3": float(bulk_density_kg_m3),
        "preparation_friction_ratio": float(ratio),
        "solid_fraction": float(found),
        "bulk_density_kg_m3": float(found * soil.density_kg_m3),
    }


def store_preparation(case: str, row: dict, path: str, source: dict) -> None:
    """Write the row of a preparation."""
    write_table(one_row({"case": case} | row), path, "wheel_preparation", source)


def found_ratio(path: str) -> float:
    """Friction ratio in the table of a preparation."""
    return float(read_table(path, "wheel_preparation")["preparation_friction_ratio"].iloc[0])


def with_preparation(bed: dict, path: str | None) -> dict:
    """Arguments of a bed's `Setup` with the friction ratio of a preparation that was found; path : its table, or None."""
    return bed if path is None else bed | {"preparation_friction_ratio": found_ratio(path)}


def bed_row(bed: SoilBed, wall_time_s: float, radius_m: float) -> dict:
    """Row of a bed, without case and seed."""
    names = ("status", "n_particles", "level_m", "solid_fraction", "bulk_density_kg_m3", "max_overlap_ratio")
    return {
        **{name: getattr(bed, name) for name in names},
        "grain_radius_m": radius_m,
        "preparation_friction_ratio": float(bed.setup.preparation_friction_ratio),
        "wall_time_s": wall_time_s,
    }


def bed_of(path: str | Path) -> SoilBed:
    """The bed of a file; raises InputError if it is damaged, or was written by other source code."""
    try:
        return soil_bed.load_bed(path)
    except (CheckpointError, ValueError, OSError) as error:
        raise InputError(f"{path}: not a bed of this version ({error}) Delete it and run again.") from None


def lower_wheel(job: dict, bed_path: str, path: str, checkpoint: Checkpoint) -> None:
    """Lower the wheel on the bed of a file and write its state to a file, from which all runs on this bed go on.

    job : `soil`, `grains`, `wheel` (of `lowering_settings`). If the simulation breaks off, the state says so.
    """
    soil, _ = soil_and_engine(job)
    bed, shape, test = bed_of(bed_path), shape_of(job["wheel"]), lowering_of(job["wheel"])
    of_wheel = (bed, soil, shape, test)
    state, reason = recorded(partial(wheel.lower, *of_wheel), partial(wheel.start, *of_wheel), WHEEL_STAGES, checkpoint)
    if state is None:
        state = wheel.start(bed, soil, shape, test)
        state.begin(BROKE_OFF, 0)
        state.notes["reason"] = reason
    with writing(path):
        save_state(state, path)


def lowered_of(path: str | Path) -> State:
    """The lowered wheel of a file; raises InputError if it is damaged, or was written by other source code."""
    try:
        return load_state(path)
    except (CheckpointError, OSError) as error:
        raise InputError(f"{path}: not a lowered wheel of this version ({error}) Delete it and run again.") from None


def drive_wheel(job: dict, name: str, bed_path: str, lowered_path: str, checkpoint: Checkpoint) -> tuple[dict, dict[str, dict]]:
    """Drive the wheel that was lowered on a bed; returns (row of the run, name -> columns of its tables, empty if it broke off).

    job : `soil`, `grains`, `engine`, `wheel` (of `wheel_settings`). name : of the run, see `run_names`.
    """
    soil, _ = soil_and_engine(job)
    bed, shape, test, lowered = bed_of(bed_path), shape_of(job["wheel"]), test_of(job["wheel"], name), lowered_of(lowered_path)
    if lowered.stage == BROKE_OFF:
        run, reason = None, lowered.notes["reason"]
    else:
        run, reason = recorded(partial(wheel.drive, bed, soil, shape, test), lambda: lowered, WHEEL_STAGES, checkpoint)
    slip = slip_named(name)
    asked = {"held": test.held, "asked_slip": math.nan if slip is None else slip, "radius_m": shape.radius_m}
    rolling = soil.rolling_friction if test.wheel_rolling_friction is None else test.wheel_rolling_friction
    asked |= {
        "width_m": shape.width_m,
        "rim": shape.rim,
        "applied_load_n": test.load_n,
        "wheel_static_friction": float(test.wheel_static_friction),
        "wheel_rolling_friction": float(rolling),
    }
    row = {**wheel_row(run, reason), **asked, "wall_time_s": checkpoint.spent_s}
    history = {column: [] if run is None else run.history[column] for column in WHEEL_HISTORY}
    return row, {"history": history, **tables_of(run, bed, soil)}


def wheel_row(run: WheelRun | None, reason: str) -> dict:
    """What a run was and whether it balances; numbers are missing if it broke off (None)."""
    if run is None:
        numbers = ("max_overlap_ratio", "momentum_residual_ratio", "motor_work_j", "axle_work_j", "load_work_j", "start_work_j")
        missing = dict.fromkeys((*numbers, "dissipated_j", "simulated_time_s"), math.nan)
        return {"status": "failed", "reason": reason, "warnings": "", "n_particles": 0, "n_steps": 0, **missing}
    return {
        "status": run.status,
        "reason": reason,
        "warnings": BETWEEN_WARNINGS.join(run.warnings),
        "n_particles": run.n_particles,
        "n_steps": run.n_steps,
        "max_overlap_ratio": run.max_overlap_ratio,
        "momentum_residual_ratio": run.momentum_residual_ratio,
        **{f"{name}_work_j": run.work_j[name] for name in ("motor", "axle", "load", "start")},
        "dissipated_j": run.dissipated_j,
        "simulated_time_s": run.simulated_time_s,
    }


def press_plate(job: dict, diameter_m: float, path: str, checkpoint: Checkpoint) -> tuple[dict, dict[str, dict]]:
    """Press a plate into the bed of a file; as `drive_wheel`. job : `soil`, `grains`, `engine`, `plate`."""
    soil, _ = soil_and_engine(job)
    test = press_test(job["plate"])
    return pressed(penetration.disc(diameter_m, test, soil), test, soil, path, checkpoint)


def push_cone(job: dict, path: str, checkpoint: Checkpoint) -> tuple[dict, dict[str, dict]]:
    """Push the cone into the bed of a file; as `drive_wheel`. job : `soil`, `grains`, `engine`, `cone`."""
    soil, _ = soil_and_engine(job)
    section = job["cone"]
    test = press_test(section)
    return pressed(penetration.cone(section["base_area_m2"], section["angle_deg"], test, soil), test, soil, path, checkpoint)


def pressed(tool, test, soil, path: str, checkpoint: Checkpoint) -> tuple[dict, dict[str, dict]]:
    """Press a tool into the bed of a file."""
    bed = bed_of(path)
    of_tool = (bed, soil, tool, test)
    run, reason = recorded(partial(penetration.press, *of_tool), partial(penetration.start, *of_tool), PRESS_STAGES, checkpoint)
    size = {
        "diameter_m": tool.diameter_m,
        "area_m2": tool.area_m2,
        "depth_m": float(test.depth_m),
        "speed_m_s": float(test.speed_m_s),
    }
    row = {**press_row(run, reason), **size, "wall_time_s": checkpoint.spent_s}
    return row, {"history": {column: [] if run is None else run.history[column] for column in PRESS_HISTORY}}


def press_row(run: Pressed | None, reason: str) -> dict:
    """What a test was; numbers are missing if it broke off (None)."""
    if run is None:
        missing = dict.fromkeys(("max_overlap_ratio", "simulated_time_s"), math.nan)
        return {"status": "failed", "reason": reason, "warnings": "", "n_particles": 0, "n_steps": 0, **missing}
    names = ("status", "n_particles", "n_steps", "max_overlap_ratio", "simulated_time_s")
    return {**{name: getattr(run, name) for name in names}, "reason": reason, "warnings": BETWEEN_WARNINGS.join(run.warnings)}


def store(wildcards: dict, row: dict, tables: dict[str, dict], output: dict[str, str], schema: str, source: dict) -> None:
    """Write a run and its tables; schema : "wheel" or "press". wildcards : of the rule, for the columns case and seed."""
    bed = {"case": wildcards["case"], "seed": int(wildcards["bed_seed"])}
    for name, columns in tables.items():
        write_table(columns, output[name], f"{schema}_{name}", source)
    write_table(one_row(bed | row), output["run"], f"{schema}_run", source)


def store_bed(wildcards: dict, row: dict, path: str, source: dict) -> None:
    """Write the row of a bed."""
    bed = {"case": wildcards["case"], "seed": int(wildcards["bed_seed"])}
    write_table(one_row(bed | row), path, "wheel_bed", source)
