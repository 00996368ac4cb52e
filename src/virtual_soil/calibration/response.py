"""A response: one number that a virtual test measures of a soil, and that the real soil has too (then it is a target).

Experiments declare theirs; every function of this package takes the responses that it works on.
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Response:
    """Description of a response, for the inference.

    Attributes
    ----------
    name : the noun from soil file to report; also the key of weights and surrogates.
    column : name with its unit, as in tables and soil files. unit, symbol : as printed.
    table : the campaign's table that holds it, one row per run or per point.
    error_column : column of its standard error in that table, where each row is a regression with n_runs and relative_scatter;
        None where each row is a run, whose error is the scatter over seeds.
    bound_column : column of the upper bound of a value that the test cannot tell from zero (a heap without a slope), where each row
        is a run; missing elsewhere. The response of such a run is the middle of the interval from 0 to the bound.
    maximum : upper bound of a target, which must lie below it; the lower bound is 0, excluded unless `signed`.
    usual : lowest and highest target that nobody need insist on, in `unit`; others are most often in another unit.
    signed : True for an intercept: a regression through noisy tests may put it below zero.
    smallest_scale : errors relative to the target are taken relative to at least this, in `unit`.
    of_consequence, decisive_error : smallest difference that matters to a user, and the standard error that a simulated mean needs
        to decide whether it meets a target, in `unit`; defaults of the settings.
    optional : True if it is measured only where a case of the study has a weight for it.
    sweep_form : default form of g, "quadratic" or "log" (see `calibration.surrogate`).
    scaling_error : standard error, in `unit`, that is added where a campaign's values are used for other grains, gravities or lift
        speeds (see `calibration.scaling`); None: not known, so they are not.
    slow_error : standard error, in `unit`, of the slowest lift of a campaign in place of a slower one; 0: no matter of the lift.
    """

    name: str
    column: str
    unit: str
    symbol: str
    table: str
    error_column: str | None = None
    bound_column: str | None = None
    maximum: float = float("inf")
    usual: tuple[float, float] = (float("-inf"), float("inf"))
    signed: bool = False
    smallest_scale: float = 0.0
    of_consequence: float = 1.0
    decisive_error: float = 1.0
    optional: bool = False
    sweep_form: str = "quadratic"
    scaling_error: float | None = None
    slow_error: float = 0.0

    @property
    def suffix(self) -> str:
        """The unit as the last word of column names: `deg` in `..._deg`."""
        return self.column.removeprefix(f"{self.name}_")

    @property
    def words(self) -> str:
        """The name as words."""
        return self.name.replace("_", " ")


#: Responses by name, in the order of their tables.
Responses = Mapping[str, Response]
