"""Progress of a running simulation, as lines in its log."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

#: Seconds between two progress lines in a simulation's log.
PROGRESS_S = 5.0


@dataclass(frozen=True)
class Stage:
    """End of a stage of a test, as far as it is known.

    Attributes
    ----------
    done : function of the simulation and the number of samples in this stage that returns the completed fraction (0 to 1); None if
        the stage ends when the grains are at rest. That is usually long before its time limit, so a percentage has no meaning.
    exact : True if the number of samples is known; the fraction is then unknown if a checkpoint resumes within the stage. Otherwise
        the fraction is approximate, and the stage may continue beyond 1.
    then : text of the line when the fraction is 1.
    """

    done: Callable | None = None
    exact: bool = False
    then: str = "until nothing moves, "


class Progress:
    """Print a line every few seconds: stage and its completed fraction, simulated time, steps, speed, time left."""

    def __init__(self, stages: Mapping[str, Stage]):
        self.stages = stages
        self.start = self.last = time.monotonic()
        self.name: str | None = None
        self.first_step: int | None = None

    def __call__(self, simulation, stage: str) -> None:
        """Report one sample of the simulation."""
        now = time.monotonic()
        if self.first_step is None:  # a resumed simulation starts with n_steps > 0
            self.first_step = simulation.n_steps
        if stage != self.name:
            # if a test is resumed within a counted stage, its earlier samples are not counted
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
        """Current stage."""
        return self.stages[self.name or ""]

    def done(self, simulation) -> float | None:
        """Completed fraction of the stage (0 to 1); None if its end is unknown."""
        return self.stage.done(simulation, self.n_looks) if self.stage.done and self.whole else None

    def percent(self, share: float | None) -> str:
        """Completed fraction as text, the beginning of the line."""
        if share is None:
            return "" if self.stage.exact else self.stage.then
        if self.stage.exact:
            return f"{100.0 * share:.0f} %, "
        return f"about {100.0 * share:.0f} %, " if share < 1.0 else self.stage.then

    def left(self, now: float, share: float | None) -> str:
        """Wall time until the end of the stage, extrapolated from its first sample; empty if unknown."""
        begun_s, begun = self.first or (now, None)
        if share is None or begun is None or share >= 1.0 or share <= begun:
            return ""
        seconds = (now - begun_s) * (1.0 - share) / (share - begun)
        return f", {'' if self.stage.exact else 'at least '}{seconds:.0f} s left"
