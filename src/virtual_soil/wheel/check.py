"""Comparisons of target `check_wheel_soil`: two values, their difference, its standard error, and a verdict.

A difference is significant beyond NOISE_LIMIT standard errors, and it matters beyond a stated limit. It "differs" if both, and
"agrees" if it does not matter and an error as large as the limit would have shown. Otherwise the test is too blunt: "not decided".

Runs of the wheel are paired by the seed of their bed. The standard error of the mean difference is the larger of two: that of the
block averages of the runs, and, with two beds and more, that of the scatter of the differences over the beds. Two differences know
their scatter badly, so it is pooled over the changes of a case: apart for those on beds of their own and those on the base's.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from dem.measure.wheel import error_name
from virtual_soil.calibration.noise import NOISE_LIMIT, pooled_sd, student
from virtual_soil.campaign.experiments.registry import BY_RESPONSE, RESPONSES
from virtual_soil.wheel.check_runs import BASE, CHANGES
from virtual_soil.wheel.check_tests import found_in

AGREES, DIFFERS, UNDECIDED, NOT_RUN = "agrees", "differs", "not decided", "not run"
#: Quantity of the wheel -> its unit.
OF_WHEEL = {"drawbar_ratio": "1", "traction_coefficient": "1", "sinkage_m": "m"}
#: Name of the comparison of the calibration's own tests.
TESTS = "wheel_grains"


@dataclass(frozen=True)
class Pairs:
    """One quantity of the runs of one change beside those of the base, bed by bed; (n,) each, of the pairs that are done."""

    base: np.ndarray
    base_errors: np.ndarray
    changed: np.ndarray
    changed_errors: np.ndarray

    @property
    def differences(self) -> np.ndarray:
        """Changed less base (n,)."""
        return self.changed - self.base

    @property
    def block_error(self) -> float:
        """Standard error of the mean difference from the block averages of the runs."""
        return math.hypot(mean_error(self.base_errors), mean_error(self.changed_errors))


def mean_error(errors: np.ndarray) -> float:
    """Standard error of the mean of values with these errors (n,); nan without any."""
    return float(np.sqrt((errors**2).sum()) / len(errors)) if len(errors) else math.nan


def mean(values: np.ndarray) -> float:
    """Mean of values (n,); nan without any."""
    return float(values.mean()) if len(values) else math.nan


def verdict(difference: float, error: float, limit: float) -> tuple[bool, str]:
    """True if a difference is significant, and the verdict on it. error : its standard error; unknown (nan), nothing is decided."""
    if math.isnan(difference):
        return False, NOT_RUN
    significant = abs(difference) > NOISE_LIMIT * error
    if significant and abs(difference) > limit:
        return True, DIFFERS
    return significant, AGREES if abs(difference) <= limit and NOISE_LIMIT * error <= limit else UNDECIDED


def paired(base: pd.DataFrame, changed: pd.DataFrame, quantity: str) -> Pairs:
    """Pairs of runs on beds of the same seed, both done; base, changed : of schema wheel, one case each."""
    columns = ["seed", quantity, error_name(quantity)]
    both = base[columns].merge(changed[columns], on="seed", suffixes=("_base", "_changed"), validate="one_to_one").dropna()
    values = (both[f"{name}_{side}"].to_numpy(float) for side in ("base", "changed") for name in columns[1:])
    return Pairs(*values)


def bed_scatter(pairs: Mapping[str, Pairs]) -> dict[bool, tuple[float, int]]:
    """Own bed or not -> standard deviation of differences over the beds, pooled over such changes, and its degrees of freedom."""
    found = {}
    for own_bed in (True, False):
        groups = [pair.differences for name, pair in pairs.items() if CHANGES[name].own_bed == own_bed]
        found[own_bed] = pooled_sd(groups), sum(max(len(group) - 1, 0) for group in groups)
    return found


def difference_error(pair: Pairs, scatter: float, freedom: int) -> float:
    """Standard error of the mean difference; scatter : of the differences over beds, with its degrees of freedom, 0 if unknown."""
    if not freedom:
        return pair.block_error
    return max(pair.block_error, float(student(freedom)) * scatter / math.sqrt(len(pair.base))) if len(pair.base) else math.nan


def limit_of(quantity: str, base: float, check: Mapping[str, float]) -> float:
    """Difference of a quantity of the wheel that matters; check : section `wheel_check`."""
    return check["sinkage_limit_ratio"] * abs(base) if quantity == "sinkage_m" else check[f"{quantity}_limit"]


def run_rows(case: str, tables: Mapping[str, pd.DataFrame], check: Mapping, said: Mapping[str, tuple[str, str]]) -> list[dict]:
    """Rows of the runs of a case; tables : BASE and changes -> runs of schema wheel. said : change -> setting before and after."""
    runs = {name: table[table["case"] == case] for name, table in tables.items()}
    changes, rows = [name for name in runs if name != BASE], []
    for quantity, unit in OF_WHEEL.items():
        pairs = {name: paired(runs[BASE], runs[name], quantity) for name in changes}
        scatter = bed_scatter(pairs)
        for name, pair in pairs.items():
            base, changed = mean(pair.base), mean(pair.changed)
            error = difference_error(pair, *scatter[CHANGES[name].own_bed])
            row = {"base": base, "base_error": mean_error(pair.base_errors), "n_base": len(pair.base), "base_from": "runs"}
            row |= {"changed": changed, "changed_error": mean_error(pair.changed_errors), "n_changed": len(pair.changed)}
            sd = float(pair.differences.std(ddof=1)) if len(pair.base) > 1 else math.nan
            row |= {"pairs_sd": sd, "block_error": pair.block_error}
            densities = {
                f"{side}_solid_fraction": runs[of]["solid_fraction"].mean() for side, of in (("base", BASE), ("changed", name))
            }
            what = {"case": case, "comparison": name, "quantity": quantity, "unit": unit}
            rows.append(judged(what | row | densities, error, limit_of(quantity, base, check), said[name]))
    return sorted(rows, key=lambda row: changes.index(row["comparison"]))


def test_row(case: str, reference: Mapping, found: tuple[float, float, int], said: tuple[str, str]) -> dict:
    """Row of a response of the calibration's own tests; reference, found : of `reference_of`, `found_in` (`check_tests`)."""
    mean_, error, n = found
    row = {"base": reference["value"], "base_error": reference["error"], "n_base": reference["n"], "base_from": reference["known"]}
    row |= {"changed": mean_, "changed_error": error, "n_changed": n}
    row |= dict.fromkeys(("pairs_sd", "block_error", "base_solid_fraction", "changed_solid_fraction"), math.nan)
    what = {"case": case, "comparison": TESTS, "quantity": reference["column"], "unit": reference["unit"]}
    return judged(what | row, math.hypot(reference["error"], error), reference["limit"], said)


def judged(row: dict, error: float, limit: float, said: tuple[str, str]) -> dict:
    """A row with difference, error, limit and verdict."""
    difference = row["changed"] - row["base"]
    significant, word = verdict(difference, error, limit)
    row |= {"difference": difference, "difference_error": error, "limit": limit, "significant": significant, "verdict": word}
    return row | {"base_setting": said[0], "changed_setting": said[1]}


def test_rows(
    case: str, tables: dict[str, pd.DataFrame], references: list[dict], said: Mapping[str, tuple[str, str]], settings: dict
) -> list[dict]:
    """Rows of the calibration's own tests of a case.

    tables : experiment -> measured tests. said : experiment -> grains in words.
    """
    if not references:
        return []
    responses = {reference["response"]: RESPONSES[reference["response"]] for reference in references}
    found = found_in(responses, tables, settings)
    names = [reference["response"] for reference in references]
    return [
        test_row(case, reference, found[name], said[BY_RESPONSE[name].NAME])
        for name, reference in zip(names, references, strict=True)
    ]


def check_table(
    runs: Mapping[str, pd.DataFrame],
    tests: Mapping[str, dict[str, pd.DataFrame]],
    references: Mapping[str, list[dict]],
    said: Mapping[str, Mapping[str, tuple[str, str]]],
    settings: dict,
    check: Mapping,
) -> pd.DataFrame:
    """All comparisons, a table of schema wheel_check.

    Parameters
    ----------
    runs : BASE and changes -> runs of all cases, of schema wheel. tests : case -> experiment -> its measured tests.
    references : case -> what the calibration says (`check_tests.reference_of`).
    said : "runs" -> change -> its setting before and after in words; case -> experiment -> the same of its tests.
    settings : sections of the experiments. check : limits of section `wheel_check`.
    """
    rows = []
    for case, known in references.items():
        rows += run_rows(case, runs, check, said["runs"])
        rows += test_rows(case, tests.get(case, {}), known, said[case], settings)
    return pd.DataFrame(rows)
