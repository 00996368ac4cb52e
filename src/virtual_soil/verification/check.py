"""One line of the verification page: what was expected, what was obtained, and how far they may lie apart."""

import math
from dataclasses import asdict, dataclass

import pandas as pd


@dataclass(frozen=True, kw_only=True)
class Check:
    """One comparison of the engine with a published or closed-form result.

    Attributes
    ----------
    group : section of the page ("Normal impact"). case : what was run ("Chung & Ooi 2011, test 1: two equal spheres").
    quantity : what was looked at ("largest force"). unit : of expected, obtained and tolerance ("-" where there is none).
    source : publication or "closed form". expected, obtained : numbers. tolerance : largest |obtained - expected|, absolute.
    relation : "equal", or "at least" / "at most" (then expected is the bound, which may be missed by the tolerance).
    note : why it deviates, what it means; one sentence or nothing.
    """

    group: str
    case: str
    quantity: str
    unit: str
    source: str
    expected: float
    obtained: float
    tolerance: float = 0.0
    relation: str = "equal"
    note: str = ""

    @property
    def passed(self) -> bool:
        """Whether the obtained number is where it should be; never with a number that is not finite."""
        if not math.isfinite(self.obtained):
            return False
        beyond = self.obtained - self.expected
        if self.relation == "at least":
            return -beyond <= self.tolerance
        if self.relation == "at most":
            return beyond <= self.tolerance
        return abs(beyond) <= self.tolerance


def table_of(checks: list[Check]) -> pd.DataFrame:
    """One row per check, its fields and whether it passed."""
    return pd.DataFrame([asdict(check) | {"passed": check.passed} for check in checks])
