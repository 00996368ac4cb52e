"""One line of the verification page: expected value, obtained value and tolerance."""

import math
from dataclasses import asdict, dataclass

import pandas as pd


@dataclass(frozen=True, kw_only=True)
class Check:
    """One comparison of the engine with a published or closed-form result.

    Attributes
    ----------
    group : section of the page ("Normal impact"). case : simulated case ("Chung & Ooi 2011, test 1: two equal spheres").
    quantity : compared quantity ("largest force"). unit : of expected, obtained and tolerance ("-" if dimensionless).
    source : publication or "closed form". expected, obtained : numbers. tolerance : largest |obtained - expected|, absolute.
    relation : "equal", or "at least" / "at most" (expected is then a bound, which may be exceeded by the tolerance).
    note : explanation of a deviation; one sentence, may be empty.
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
        """True if the obtained value is finite and within the tolerance."""
        if not math.isfinite(self.obtained):
            return False
        beyond = self.obtained - self.expected
        if self.relation == "at least":
            return -beyond <= self.tolerance
        if self.relation == "at most":
            return beyond <= self.tolerance
        return abs(beyond) <= self.tolerance


def table_of(checks: list[Check]) -> pd.DataFrame:
    """Return a table with one row per check: its fields and `passed`."""
    return pd.DataFrame([asdict(check) | {"passed": check.passed} for check in checks])
