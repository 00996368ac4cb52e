"""A simulation's checkpoint: saved every so often, found again by the job's next attempt, removed when its tables are written."""

import contextlib
import json
import os
import signal
import time
from pathlib import Path

import dem
from dem.checkpoint import load_with_notes
from dem.experiments.state import State

#: Signals on which a job saves its state and ends: schedulers send the first before they kill, a person the second.
SIGNALS = (signal.SIGTERM, signal.SIGINT)

#: Name among the notes of what belongs to the job, not to the test.
JOB = "job"


class Checkpoint:
    """Where one simulation is saved, how often, and what must agree for it to go on from there.

    Parameters
    ----------
    path : the file; its folder is made. interval_s : seconds between two saves. identity : JSON-like, all that the result depends
        on; a file with another identity is not gone on from.
    """

    def __init__(self, path: str, interval_s: float, identity: dict):
        self.path, self.interval_s = Path(path), interval_s
        self.identity = json.dumps(identity, sort_keys=True)
        self.earlier_s = 0.0
        self.begun = self.saved = time.monotonic()
        self.signal: int | None = None
        self.parent = os.getppid()

    @property
    def spent_s(self) -> float:
        """Wall time in s spent on the simulation, in this job and in those before that it goes on from."""
        return self.earlier_s + time.monotonic() - self.begun

    def state(self) -> State | None:
        """The state to go on from; None, and a line in the log where there is a file of no use, to begin anew."""
        if not self.path.exists():
            return None
        try:
            simulation, notes = load_with_notes(self.path)
        except (dem.CheckpointError, OSError) as error:
            print(f"begins anew: {error}")
            return None
        job = notes.pop(JOB, None)
        if not isinstance(job, dict) or job.get("identity") != self.identity:
            print(f"begins anew: {self.path} is a checkpoint of another simulation, or of other settings.")
            return None
        self.earlier_s = job["spent_s"]
        print(f"goes on from {self.path}: {job['stage']}, step {simulation.n_steps}, after {self.earlier_s:.1f} s")
        return State(simulation, job["stage"], job["end_step"], notes)

    def keep(self, state: State) -> None:
        """Save the state when it is time to; after a signal, or when Snakemake was killed, at once, and end the job."""
        if os.getppid() != self.parent:  # nobody waits for the result any more; the next attempt is not to meet this one
            self.signal = signal.SIGHUP
        if self.signal is None and time.monotonic() - self.saved < self.interval_s:
            return
        self.save(state)
        self.saved = time.monotonic()
        if self.signal is not None:
            print(f"{signal.Signals(self.signal).name}: ends at step {state.simulation.n_steps}, to go on from {self.path}")
            raise SystemExit(128 + self.signal)

    def save(self, state: State) -> None:
        """Save the state; where that fails, the simulation goes on and the log says so."""
        job = {"identity": self.identity, "stage": state.stage, "end_step": state.end_step, "spent_s": self.spent_s}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            dem.save(state.simulation, self.path, state.notes | {JOB: job})
        except OSError as error:
            print(f"no checkpoint at step {state.simulation.n_steps}: {error}")

    @contextlib.contextmanager
    def on_signals(self):
        """While inside, a signal is only noted, for `keep` to act on."""
        before = {number: signal.signal(number, self.note) for number in SIGNALS}
        try:
            yield self
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def note(self, number: int, _) -> None:
        """Note a signal; nothing more, because it may come in the midst of anything."""
        self.signal = number

    def remove(self) -> None:
        """The simulation is finished: its checkpoint is of no more use."""
        for path in self.path.parent.glob(f"{self.path.name}*"):  # with what a killed job left half written
            path.unlink(missing_ok=True)
