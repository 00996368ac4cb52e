"""Progress of a running simulation, as lines of its log."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

#: Seconds between two progress lines in a simulation's log.
PROGRESS_S = 5.0


@dataclass(frozen=True)
class Stage:
    """What is known of the end of a stage of a test.

    Attributes
    ----------
    done : share (0 to 1) that is done, of the simulation and the number of looks in this stage; None where the stage ends when
        nothing moves, as a rule long before its time limit, of which a percentage would mean nothing.
    exact : the share is of a known number of looks, and unknown where a saved test goes on within the stage; otherwise it is
        approximate, and the stage may go on when all is done.
    then : what a line says when all is done.
    """

    done: Callable | None = None
    exact: bool = False
    then: str = "until nothing moves, "


class Progress:
    """Prints a line every few seconds: stage and share of it that is done, simulated time, steps, speed, time left."""

    def __init__(self, stages: Mapping[str, Stage]):
        self.stages = stages
        self.start = self.last = time.monotonic()
        self.name: str | None = None
        self.first_step: int | None = None

    def __call__(self, simulation, stage: str) -> None:
        """Report one look at the simulation."""
        now = time.monotonic()
        if self.first_step is None:  # a resumed simulation has made steps before
            self.first_step = simulation.n_steps
        if stage != self.name:
            # a test that is resumed within a counted stage has had looks that nobody counted
            self.whole = self.name is not None or stage == next(iter(self.stages)) or not self.stages[stage].exact
            self.name, self.n_looks, self.first = stage, 0, None
        self.n_looks += 1
        if now - self.last >= PROGRESS_S or self.first is None:
            share = self.done(simulation)
            self.first = self.first or (now, share)
        if now - self.last >= PROGRESS_S:
            self.last = now
            speed = (simulation.n_steps - self.first_step) * simulation.n_grains / (now - self.start) / 1e6
            print(
                f"{stage}: {self.percent(share)}t = {simulation.time_s:.4f} s, step {simulation.n_steps}, "
                f"{speed:.1f} M grain-steps/s{self.left(now, share)}"
            )

    @property
    def stage(self) -> Stage:
        """The present stage."""
        return self.stages[self.name or ""]

    def done(self, simulation) -> float | None:
        """Share of the stage that is done (0 to 1); None where its end is not known."""
        return self.stage.done(simulation, self.n_looks) if self.stage.done and self.whole else None

    def percent(self, share: float | None) -> str:
        """The share in words, ready to be put before the rest of the line."""
        if share is None:
            return "" if self.stage.exact else self.stage.then
        if self.stage.exact:
            return f"{100.0 * share:.0f} %, "
        return f"about {100.0 * share:.0f} %, " if share < 1.0 else self.stage.then

    def left(self, now: float, share: float | None) -> str:
        """Wall time until the stage ends, at the pace since its first look; empty where that cannot be said."""
        begun_s, begun = self.first or (now, None)
        if share is None or begun is None or share >= 1.0 or share <= begun:
            return ""
        seconds = (now - begun_s) * (1.0 - share) / (share - begun)
        return f", {'' if self.stage.exact else 'at least '}{seconds:.0f} s left"
