"""The simulations of a batch as a job: run or resumed, failures recorded, results written atomically.

Every experiment stores the same files: `before` and `after` (grains), `history` (a time series, without rows if the test has
none), `run` (one row per simulation) and `timing`.
"""

import json
import shutil
import traceback
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from dem import SimulationError
from virtual_soil.calibration.points import own_seed
from virtual_soil.campaign.batches import may_hold, stage_of
from virtual_soil.campaign.experiments import module_of
from virtual_soil.campaign.experiments.common import engine_of, soil_of
from virtual_soil.campaign.files import FileError, write_text, writing
from virtual_soil.campaign.grains import empty_columns, empty_grains, grain_table, of_simulation
from virtual_soil.campaign.progress import Progress
from virtual_soil.campaign.provenance import versions
from virtual_soil.campaign.resume import Checkpoint
from virtual_soil.campaign.tables import TableError, read_provenance, stack_tables, write_table

#: Exceptions caused by a simulation's parameters; any other exception is a program error and stops the job.
FAILURES = (SimulationError, ValueError, FloatingPointError)


def provenance(members: list, engine: str) -> dict:
    """Provenance of results, identical for repeated runs. members : pairs of design row and settings."""
    simulations = {row["simulation_id"]: {"design": row, "settings": settings} for row, settings in members}
    return {"simulations": simulations, "engine": engine, "versions": versions()}


def one_row(values: dict) -> dict[str, list]:
    """Convert a row to a table of one row."""
    return {name: [value] for name, value in values.items()}


def simulate(row: dict, settings: dict, checkpoint: Checkpoint) -> tuple[dict, float]:
    """Run one simulation, resuming its checkpoint if there is one; returns {output: (schema, columns)} and the wall time in s."""
    experiment, name = row["experiment"], row["simulation_id"]
    job = import_module(module_of(experiment, "simulate"))
    result, reason, seconds = recorded(job, row, settings, checkpoint)
    run = {"simulation_id": name, "reason": reason or "", **job.row_of(result, settings)}
    before = after = empty_grains(clumps="shape" in settings)
    history = empty_columns(job.HISTORY)
    if result is not None:
        soil = soil_of(row, settings)
        before, after = (grain_table(getattr(result, moment), name, soil) for moment in job.MOMENTS)
        history = of_simulation(name, result.history) if job.HISTORY else history
    tables = {"before": ("grains", before), "after": ("grains", after), "history": (f"{experiment}_history", history)}
    return {**tables, "run": (f"{experiment}_run", one_row(run))}, seconds


def recorded(job, row: dict, settings: dict, checkpoint: Checkpoint):
    """Run an experiment, resuming its checkpoint if there is one; job : its `simulate` module.

    Returns (result, None, seconds), or (None, reason, seconds) if the simulation fails because of its parameters. Ends the job
    after a signal.
    """
    state, each = checkpoint.state(), Progress(job.STAGES)
    try:
        with checkpoint.on_signals():
            soil, engine = soil_of(row, settings), engine_of(settings)
            result = job.run(soil, settings["setup"], engine, own_seed(row), each=each, state=state, keep=checkpoint.keep)
        reason = None
    except FAILURES as error:
        traceback.print_exc()
        result, reason = None, str(error)
    return result, reason, checkpoint.spent_s


class Finished:
    """Finished simulations of the same identity, from an earlier attempt, an own job or another batch; they are not run again."""

    def __init__(self, files: dict[str, str], kept: Path, sims: Path):
        self.files, self.kept, self.sims = files, kept, sims
        self.batches = [path for path in sorted(sims.glob("*")) if stage_of(path.name) is not None]
        self.known: dict[Path, dict] = {}

    def folder(self, row: dict, settings: dict, engine: str) -> Path | None:
        """Folder that contains a simulation's files, possibly with those of others; None if there is none."""
        name, wanted = row["simulation_id"], provenance([(row, settings)], engine)
        others = [path for path in self.batches if may_hold(path.name, name)]
        for folder in (self.kept / name, self.sims / name, *others):
            found = self.holds(folder)
            if name in found.get("simulations", {}) and found | {"simulations": {name: found["simulations"][name]}} == wanted:
                return folder
        return None

    def holds(self, folder: Path) -> dict:
        """Common provenance of all files in a folder; empty if a file is missing, damaged or from another run."""
        if folder not in self.known:
            paths = [folder / file for name, file in self.files.items() if name != "timing"]
            try:
                first, *rest = [read_provenance(path) for path in paths]
                json.loads((folder / self.files["timing"]).read_text())  # written last
                self.known[folder] = first if all(other == first for other in rest) else {}
            except (TableError, OSError, ValueError):
                self.known[folder] = {}
        return self.known[folder]


def run_batch(
    members: list, engine: str, output: dict[str, str], checkpoints: str, interval_s: float, simulate: Callable = simulate
) -> None:
    """Simulate the members of a batch one after another and write each output as one file, in the order of the members.

    Every finished simulation is kept in <checkpoints>/<id>/ until all files are written, so that no result is lost if the job ends
    early. After a program error in one simulation the others are still run; then the job fails, and its next attempt repeats only
    the failed one. A signal ends the job, at the latest when its simulation is finished.

    Parameters
    ----------
    members : pairs of design row and settings. output : name -> path. simulate : function of row, settings and Checkpoint that
        returns {name of output: (schema, columns)} and the wall time in s.
    """
    files, kept = {name: Path(path).name for name, path in output.items()}, Path(checkpoints)
    finished, broken = Finished(files, kept, Path(output["run"]).parents[1]), []
    folders: dict[str, Path] = {}
    for number, (row, settings) in enumerate(members, 1):
        name, source = row["simulation_id"], provenance([(row, settings)], engine)
        print(f"simulation {name}: {number} of {len(members)}")
        folder = finished.folder(row, settings, engine)
        if folder is not None:
            print(f"finished before, in {folder}")
            folders[name] = folder
            continue
        checkpoint = Checkpoint(str(kept / f"{name}.npz"), interval_s, source)
        try:
            tables, seconds = simulate(row, settings, checkpoint)
            folders[name] = keep(kept / name, tables, {name: seconds}, files, source)
        except FileError:  # the results of the others could not be written either
            raise
        except Exception:  # any program error: the other simulations are independent of it
            traceback.print_exc()
            broken.append(name)
        else:
            checkpoint.remove()
        checkpoint.end_if_asked(f"after simulation {name}")  # by a signal that came after its last look
    if broken:
        raise RuntimeError(f"{len(broken)} of {len(members)} simulations broke off: {', '.join(broken)}; the others are kept.")
    for name in output.keys() - {"timing"}:
        paths = {simulation: folder / files[name] for simulation, folder in folders.items()}
        stack_tables(paths, output[name], provenance(members, engine))
    timings = [json.loads((folder / files["timing"]).read_text())["wall_time_s"] for folder in folders.values()]
    write_timing(output["timing"], {name: timing[name] for name, timing in zip(folders, timings, strict=True)})
    for name in folders:
        shutil.rmtree(kept / name, ignore_errors=True)
        Checkpoint(str(kept / f"{name}.npz"), interval_s, {}).remove()  # of a job killed after its last step


def keep(folder: Path, tables: dict, seconds: dict[str, float], files: dict[str, str], source: dict) -> Path:
    """Write the files of one simulation into a folder atomically; returns the folder."""
    part = folder.with_name(f"{folder.name}.part")
    with writing(folder):
        for left in (part, folder):
            shutil.rmtree(left, ignore_errors=True)
        part.mkdir(parents=True)
        for name, (schema, columns) in tables.items():
            write_table(columns, str(part / files[name]), schema, source)
        write_timing(str(part / files["timing"]), seconds)
        part.rename(folder)
    return folder


def write_timing(path: str, seconds: dict[str, float]) -> None:
    """Write the wall time of each simulation, the only output that differs between repeated runs."""
    write_text(path, json.dumps({"wall_time_s": seconds}))
