"""Progress of a study, from its files alone: `make status`, or `.venv/bin/python -m virtual_soil.campaign.status --study default`.

Reads only results/<study> and logs/<study>, so it works from any terminal, during a campaign or after it. A simulation with all
files is done. It is outdated, and will be rerun, if its engine version differs from that of the newest result. Reruns due to a
changed configuration are shown only by `snakemake -n all`.
"""

import argparse
import json
import re
import signal
import time
from collections import Counter
from pathlib import Path

import pyarrow.parquet as pq

from virtual_soil.campaign.batches import stage_of
from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.cost import expected_s
from virtual_soil.campaign.experiments.registry import EXPERIMENTS
from virtual_soil.campaign.tables import METADATA_KEY, UNREADABLE, one_line

NAMES = {experiment.NAME: experiment.NOUNS[1] for experiment in reversed(EXPERIMENTS)}
STATES = ("done", "outdated", "running", "failed", "stopped", "waiting")
#: Pattern of the beginning of a simulation's lines in the log of its job.
HEADING = re.compile(r"^simulation ([0-9a-f]{10}): \d+ of \d+$\n?", flags=re.MULTILINE)
#: Time in s without log output after which a simulation counts as stopped; a running one writes to its log every few seconds.
SILENT_S = 120.0
#: Width of the bar, in characters.
BAR = 30
#: Maximum number of failures that are listed.
SHOWN = 5


def read_rows(path: Path, columns: list[str]) -> list[dict]:
    """Read the rows of a table; exits with one line naming the file if it is not a table with these columns."""
    try:
        return pq.ParquetFile(path).read(columns=columns).select(columns).to_pylist()
    except UNREADABLE as error:
        raise SystemExit(f"{path}: not a readable table with {', '.join(columns)} ({one_line(error)}).") from None


def numbered(results: Path, folder: str, word: str) -> dict[str, Path]:
    """Return step -> design table of the numbered stages in a folder, in their order."""
    paths = sorted(results.glob(f"{folder}/*/design.parquet"), key=lambda path: int(path.parent.name))
    return {f"{word} {path.parent.name}": path for path in paths}


def planned(results: Path) -> dict[str, dict]:
    """Return simulation_id -> experiment, fidelity and step of every planned simulation; duplicates belong to their first step."""
    steps = {"campaign": results / "design.parquet", **numbered(results, "rounds", "round")}
    steps |= {"verification": results / "verification" / "design.parquet", **numbered(results, "verification", "more seeds")}
    rows: dict[str, dict] = {}
    for step, path in steps.items():
        if path.is_file():
            for row in read_rows(path, ["simulation_id", "experiment", "fidelity"]):
                rows.setdefault(row["simulation_id"], row | {"step": step})
    return rows


def results_in(results: Path) -> dict[str, dict]:
    """Return simulation_id -> state, note and wall time in s of every result, including those of unfinished batches.

    If a simulation has several results, because its batch has changed, the newest counts.
    """
    paths = [path for folder in ("checkpoints/*", "sims/*/*") for path in results.glob(f"{folder}/run.parquet")]
    found = {}
    for path in sorted(paths, key=lambda path: path.stat().st_mtime):
        folder = path.parent
        try:
            seconds = json.loads((folder / "timing.json").read_text())["wall_time_s"]
            file = pq.ParquetFile(path)
            runs = file.read(columns=["simulation_id", "status", "reason"]).to_pylist()
            provenance = json.loads(file.schema_arrow.metadata[METADATA_KEY])
            made = {"engine": provenance["engine"], "made": path.stat().st_mtime}
            for run in runs:
                state, name = "failed" if run["status"] == "failed" else "done", run["simulation_id"]
                found[name] = {"state": state, "note": run["reason"], "wall_time_s": seconds[name], **made}
                found[name]["expected_s"] = expected_s(*provenance["simulations"][name].values())
        except FileNotFoundError:  # the timing file is missing: the result is being written
            pass
        except UNREADABLE as error:
            found[folder.name] = {"state": "failed", "note": f"{folder}: unreadable result ({type(error).__name__})"}
    return found


def logged_in(logs: Path, now: float) -> dict[str, dict]:
    """Return simulation_id -> state and note, of the last simulation in every log and of those that crashed before.

    A log without simulations belongs to a job that has not started its first one; the key is then the batch.
    """
    found = {}
    for log in (path for experiment in NAMES for path in (logs / experiment).glob("*.log")):
        before, *sections = HEADING.split(log.read_text(errors="replace"))
        parts = list(zip(sections[::2], sections[1::2], strict=True)) or [(log.stem, before)]
        for name, text in parts:
            state = in_log(log, text.splitlines(), now)
            if name == parts[-1][0] or state["state"] == "failed":
                found[name] = state
    return found


def mark_outdated(rows: dict[str, dict]) -> None:
    """Mark results as outdated if their engine differs from that of the newest result."""
    made = [row for row in rows.values() if "engine" in row]
    newest = max(made, key=lambda row: row["made"], default={})
    for row in made:
        if row["engine"] != newest["engine"]:
            row["state"] = "outdated"


def in_log(log: Path, lines: list[str], now: float) -> dict:
    """State of a simulation or job without result, from its log lines: failed (traceback), stopped (no recent output), running."""
    last = lines[-1] if lines else ""
    if any(line.startswith(("Traceback", "error: ")) for line in lines):
        return {"state": "failed", "note": f"{log}: {last}"}
    return {"state": "running" if now - log.stat().st_mtime < SILENT_S else "stopped", "note": last}


def mean_times(rows: dict[str, dict]) -> dict[tuple, float]:
    """Mean wall time in s of the finished simulations, by experiment and fidelity, and by experiment alone."""
    times: dict[tuple, list[float]] = {}
    for row in rows.values():
        if row["state"] in ("done", "outdated"):
            for kind in ((row["experiment"], row["fidelity"]), (row["experiment"],)):
                times.setdefault(kind, []).append(row["wall_time_s"])
    return {kind: sum(values) / len(values) for kind, values in times.items()}


def work_left(rows: dict[str, dict]) -> tuple[float, int]:
    """Return the total time in s of the unfinished simulations and the number of simulations without a time estimate.

    No estimate exists for a kind without a finished simulation. Running simulations count half, the mean remaining time. The
    start-up of a job (one or two seconds) is neglected.
    """
    means, seconds, unknown = mean_times(rows), 0.0, 0
    for row in rows.values():
        if row["state"] in ("waiting", "outdated", "stopped", "running"):
            mean = means.get((row["experiment"], row["fidelity"]), means.get((row["experiment"],)))
            unknown += mean is None
            seconds += (mean or 0.0) * (0.5 if row["state"] == "running" else 1.0)
    return seconds, unknown


def model_errors(rows: dict[str, dict]) -> list[str]:
    """Errors of the cost model (used for batches and requested times), from the wall times of finished simulations."""
    ratios: dict[str, list[float]] = {}
    for row in rows.values():
        if row["state"] == "done" and row["wall_time_s"]:
            ratios.setdefault(row["experiment"], []).append(row["expected_s"] / row["wall_time_s"])
    parts = []
    for experiment, values in ratios.items():
        low, median, high = (sorted(values)[round(share * (len(values) - 1))] for share in (0.1, 0.5, 0.9))
        parts.append(f"{NAMES[experiment]} {median:.2f} ({low:.2f} to {high:.2f})")
    return [f"Expected over measured time, median (8 of 10 lie within): {'; '.join(parts)}."] if parts else []


def crashed_rules(logs: Path) -> list[str]:
    """Return the last log line of every other rule that ended with a traceback."""
    lines = []
    parts = ("*.log", "rounds/*/*.log", "verification/*.log", "verification/*/*.log", "export/*.log")
    for log in sorted(path for part in parts for path in logs.glob(part)):
        found = in_log(log, log.read_text(errors="replace").splitlines(), 0.0)
        if found["state"] == "failed":
            lines.append(found["note"])
    return lines


def duration(seconds: float) -> str:
    """Format a time in s, min or h."""
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.1f} {unit}"
    return f"{seconds:.0f} s"


def report(study: str, root: Path, now: float) -> str:
    """Return the complete report as text; exits with one line if the study does not exist or a design cannot be read."""
    results, logs = root / "results" / study, root / "logs" / study
    if not results.is_dir() and not logs.is_dir():
        known = sorted(path.parent.name for path in root.glob("results/*/design.parquet"))
        raise SystemExit(f"study: there is no results/{study}; started studies: {', '.join(known) or 'none'}.")
    rows = planned(results)
    made, logged = results_in(results), logged_in(logs, now)
    for name, row in rows.items():
        row |= made.get(name) or logged.get(name) or {"state": "waiting", "note": ""}
    mark_outdated(rows)
    batches = [state["note"] for name, state in logged.items() if stage_of(name) is not None and state["state"] == "failed"]
    crashed = [f"failed: {line}" for line in (*crashed_rules(logs), *batches)]
    if not rows:
        return "\n".join([f"{study}: no simulation is planned yet.", *crashed])
    named = [line for state in ("running", "stopped", "failed") for line in one_by_one(rows, state)]
    blocks = [[bar(study, rows)], table(rows), [*named, *crashed], outlook(rows, results), model_errors(rows)]
    return "\n\n".join("\n".join(block) for block in blocks if block)


def bar(study: str, rows: dict[str, dict]) -> str:
    """Bar with the number of simulations that are finished: done, or failed with a recorded reason."""
    n_over = sum("wall_time_s" in row and row["state"] != "outdated" for row in rows.values())
    filled, share = BAR * n_over // len(rows), 100 * n_over // len(rows)
    return f"{study} [{'#' * filled}{'.' * (BAR - filled)}] {n_over} of {len(rows)} planned simulations ({share} %)"


def table(rows: dict[str, dict]) -> list[str]:
    """Return a line per step and experiment: number of simulations in each state and mean wall time."""
    lines = [f"{'step':<26}" + "".join(f"{state:>9}" for state in STATES) + f"{'mean time':>12}"]
    for step, experiment in dict.fromkeys((row["step"], row["experiment"]) for row in rows.values()):
        here = [row for row in rows.values() if (row["step"], row["experiment"]) == (step, experiment)]
        count, times = Counter(row["state"] for row in here), [row["wall_time_s"] for row in here if row["state"] == "done"]
        mean = duration(sum(times) / len(times)) if times else "-"
        lines.append(f"{step + ', ' + NAMES[experiment]:<26}" + "".join(f"{count[state]:>9}" for state in STATES) + f"{mean:>12}")
    return lines


def one_by_one(rows: dict[str, dict], state: str) -> list[str]:
    """List the first few simulations in a state, with the note from their log or result."""
    found = [
        f"{state}: {row['experiment']} {name}: {row['note'] or 'started'}" for name, row in rows.items() if row["state"] == state
    ]
    return [*found[:SHOWN], f"... and {len(found) - SHOWN} more {state}"] if len(found) > SHOWN else found


def outlook(rows: dict[str, dict], results: Path) -> list[str]:
    """Estimate of the remaining time."""
    seconds, unknown = work_left(rows)
    n_running = sum(row["state"] == "running" for row in rows.values())
    n_crashed = sum(row["state"] == "failed" and "wall_time_s" not in row for row in rows.values())
    if n_crashed:
        return [f"{n_crashed} simulations crashed and have no result: the campaign cannot end before they are run again."]
    if (results / "report.html").is_file() and not seconds and not unknown:
        return [f"Finished: {results / 'report.html'}"]
    lines = []
    if seconds:
        at_once = f", {duration(seconds / n_running)} at {n_running} at once as now" if n_running else ""
        lines.append(
            f"Left of the planned simulations: about {duration(seconds)} one after another{at_once}, by the finished ones' times."
        )
    if unknown:
        lines.append(f"{unknown} simulations are of a kind of which none has finished: no time can be said for them.")
    if not lines:
        lines.append("All planned simulations are done; the report is not written yet.")
    return [*lines, "Later steps plan simulations when the earlier ones are done."]


def main(arguments: list[str] | None = None) -> None:
    """Print the progress of a study."""
    parser = argparse.ArgumentParser(description="How far a study is, from its files alone.")
    parser.add_argument("--study", default="default", help="folder below results/ (default: default)")
    parser.add_argument("--directory", type=Path, default=ROOT, help="folder of results/ and logs/ (default: the checkout)")
    given = parser.parse_args(arguments)
    print(report(given.study, given.directory, time.time()))


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)  # the reader, e.g. `head`, has closed the pipe: not an error
    main()
