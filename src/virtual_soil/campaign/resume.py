"""Checkpoint of a simulation: saved at intervals, resumed by the next attempt, removed when the tables are written."""

import contextlib
import json
import os
import signal
import time
from dataclasses import replace
from pathlib import Path

from dem import CheckpointError
from dem.experiments.state import State, load_state, save_state

#: Signals on which a job saves its state and ends: the first is sent by schedulers before SIGKILL, the second by Ctrl-C.
SIGNALS = (signal.SIGTERM, signal.SIGINT)

#: Key of the job's own data among the notes of a checkpoint.
JOB = "job"


class Checkpoint:
    """Checkpoint of one simulation: path, saving interval, and the identity that must agree to resume.

    Parameters
    ----------
    path : the file; its folder is created. interval_s : seconds between two saves. identity : JSON-like, everything on which the
        result depends; a file with another identity is not resumed. threads : of the simulation; its result is the same on any.
    """

    def __init__(self, path: str, interval_s: float, identity: dict, threads: int = 1):
        self.path, self.interval_s, self.threads = Path(path), interval_s, threads
        self.identity = json.dumps(identity, sort_keys=True)
        self.earlier_s = 0.0
        self.begun = self.saved = time.monotonic()
        self.signal: int | None = None
        self.parent = os.getppid()

    @property
    def spent_s(self) -> float:
        """Wall time in s spent on the simulation, in this job and in the previous attempts that it resumes."""
        return self.earlier_s + time.monotonic() - self.begun

    def state(self) -> State | None:
        """Return the state to resume; None to start from the beginning. An unusable file is reported in the log."""
        if not self.path.exists():
            return None
        try:
            state = load_state(self.path)
        except (CheckpointError, OSError) as error:
            print(f"begins anew: {error}")
            return None
        job = state.notes.pop(JOB, None)
        if not isinstance(job, dict) or job.get("identity") != self.identity:
            print(f"begins anew: {self.path} is a checkpoint of another simulation, or of other settings.")
            return None
        self.earlier_s = job["spent_s"]
        print(f"goes on from {self.path}: {state.stage}, step {state.simulation.n_steps}, after {self.earlier_s:.1f} s")
        return state

    def keep(self, state: State) -> None:
        """Save the state at the saving interval. After a signal, or if Snakemake was killed, save at once and end the job."""
        if self.asked() is None and time.monotonic() - self.saved < self.interval_s:
            return
        self.save(state)
        self.saved = time.monotonic()
        self.end_if_asked(f"at step {state.simulation.n_steps}, to go on from {self.path}")

    def asked(self) -> int | None:
        """Signal that asks the job to end; SIGHUP if Snakemake has ended: the job must not overlap with the next attempt."""
        if os.getppid() != self.parent:
            self.signal = signal.SIGHUP
        return self.signal

    def end_if_asked(self, where: str) -> None:
        """End the job if it is asked to; where : what it has done, for the log."""
        if (number := self.asked()) is not None:
            print(f"{signal.Signals(number).name}: ends {where}")
            raise SystemExit(128 + number)

    def save(self, state: State) -> None:
        """Save the state; if that fails, the simulation continues and the log reports it."""
        job = {"identity": self.identity, "spent_s": self.spent_s}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            save_state(replace(state, notes=state.notes | {JOB: job}), self.path)
        except OSError as error:
            print(f"no checkpoint at step {state.simulation.n_steps}: {error}")

    @contextlib.contextmanager
    def on_signals(self):
        """Context manager: record signals; `keep` handles them."""
        before = {number: signal.signal(number, self.note) for number in SIGNALS}
        try:
            yield self
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def note(self, number: int, _) -> None:
        """Record a signal. It may arrive at any point of the code, so nothing else is done here."""
        self.signal = number

    def remove(self) -> None:
        """Delete the checkpoint of a finished simulation."""
        for path in self.path.parent.glob(f"{self.path.name}*"):  # including incomplete files of killed jobs
            path.unlink(missing_ok=True)
