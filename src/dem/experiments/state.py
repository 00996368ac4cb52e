"""A test in progress: the part that is saved, so that it continues as if never interrupted."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from dem import CheckpointError, Grains, Simulation, SimulationError, load_with_notes, packed, save, unpacked

#: Steps between two looks, unless a test has its own rhythm.
LOOK_STEPS = 500
#: Key of stage and last step among the notes of a stored state.
PLACE = "state"


@dataclass
class State:
    """All that the rest of a test depends on: the simulation, the stage, the step at which the stage ends at the latest.

    notes: data of the stages so far; arrays, and plain values that JSON can hold (see `dem.save`).
    """

    simulation: Simulation
    stage: str
    end_step: int
    notes: dict = field(default_factory=dict)

    def begin(self, stage: str, n_steps: int) -> None:
        """Begin a stage of at most n_steps."""
        self.stage, self.end_step = stage, self.simulation.n_steps + n_steps

    def go_on(self, look: Callable[["State"], bool], keep: Callable[["State"], None] | None, every_steps: int = LOOK_STEPS) -> bool:
        """Run the rest of the stage; returns True if `look(state)`, called every `every_steps` steps, ended it.

        `keep(state)` is called when the stage goes on after a look: only then may the state be saved.
        """
        while self.simulation.n_steps < self.end_step:
            self.simulation.advance(min(every_steps, self.end_step - self.simulation.n_steps))
            if look(self):
                return True
            if keep is not None:
                keep(self)
        return False

    def with_threads(self, threads: int) -> "State":
        """The same test on another number of threads; results do not depend on it."""
        return replace(self, simulation=unpacked(packed(self.simulation), threads))

    def note_grains(self, name: str, grains: Grains) -> None:
        """Remember grains under a name."""
        self.notes |= {f"{name}.{key}": values for key, values in asdict(grains).items()}

    def noted_grains(self, name: str) -> Grains:
        """The grains that were remembered under a name."""
        return Grains(**{key: np.asarray(self.notes[f"{name}.{key}"]) for key in Grains.__dataclass_fields__})


def save_state(state: State, path: str | Path) -> None:
    """Write a state to a file (`dem.save`), for `load_state`."""
    save(state.simulation, path, state.notes | {PLACE: {"stage": state.stage, "end_step": state.end_step}})


def load_state(path: str | Path) -> State:
    """The state of a file of `save_state`.

    Raises dem.CheckpointError if the file is damaged, holds no state, or was written by other source code.
    """
    simulation, notes = load_with_notes(path)
    if PLACE not in notes:
        raise CheckpointError(f"{path} holds no test in progress; delete it to begin anew.")
    return State(simulation, **notes.pop(PLACE), notes=notes)


def looks(each: Callable[[Simulation, str], None] | None, lost: str = ""):
    """Function that makes a look for `State.go_on` of `ended(state)`, which says if the stage is over.

    The look first notes the largest overlap of all looks, `max_overlap_ratio`, and calls `each(simulation, stage)`. lost : what
    grains below the floor have done, where none may be: the look then raises dem.SimulationError.
    """

    def look(ended: Callable[[State], bool]) -> Callable[[State], bool]:
        def call(state: State) -> bool:
            simulation, notes = state.simulation, state.notes
            notes["max_overlap_ratio"] = max(notes["max_overlap_ratio"], simulation.largest_overlap_ratio())
            if each is not None:
                each(simulation, state.stage)
            if lost and simulation.n_left:
                raise SimulationError(f"{simulation.n_wholes_left} grains {lost}")
            return ended(state)

        return call

    return look


def steps_in(duration_s: float, simulation: Simulation) -> int:
    """Steps that a duration takes, as `Simulation.run` counts them."""
    return math.ceil(duration_s / simulation.time_step_s - 1e-9)
