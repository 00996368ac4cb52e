"""The page of target `check_wheel_soil`; its first lines say which differences exceed their errors and what matters."""

from pathlib import Path

import pandas as pd

from virtual_soil.campaign.experiments.registry import RESPONSES
from virtual_soil.campaign.files import write_text
from virtual_soil.verification.page import markdown
from virtual_soil.wheel.check import AGREES, DIFFERS, NOT_RUN, TESTS, UNDECIDED
from virtual_soil.wheel.check_runs import CHANGES
from virtual_soil.wheel.measured_page import QUANTITIES as OF_WHEEL
from virtual_soil.wheel.page import first_line

#: Unit of a response -> unit of the page, factor to it, decimals.
OF_TESTS = {"deg": ("°", 1.0, 2), "Pa": ("Pa", 1.0, 1), "kg/m3": ("kg/m³", 1.0, 0)}
#: Verdicts as they stand in the table.
LOUD = {DIFFERS: f"🔴 **{DIFFERS}**", AGREES: f"🟢 {AGREES}", UNDECIDED: f"🟡 {UNDECIDED}", NOT_RUN: f"🟡 {NOT_RUN}"}
COLUMN_NAMES = {response.column: name.replace("_", " ") for name, response in RESPONSES.items()}
#: The calibration's value -> word.
FROM = {"runs": "", "simulated": " (simulated)", "predicted": " (predicted)"}


def in_words(row) -> tuple[str, str, float, int]:
    """Name of a row's quantity, unit of the page, factor to it, and decimals."""
    if row["comparison"] == TESTS:
        return COLUMN_NAMES[row["quantity"]], *OF_TESTS[row["unit"]]
    return OF_WHEEL[row["quantity"]]


def compared(row) -> str:
    """Name of a row's comparison."""
    return "tests with the wheel's grains" if row["comparison"] == TESTS else CHANGES[row["comparison"]].words


def difference(row) -> str:
    """A row's difference in words."""
    name, unit, factor, digits = in_words(row)
    d, error, limit = (factor * row[key] for key in ("difference", "difference_error", "limit"))
    end = f" {unit}" if unit else ""
    return f"{compared(row)}, {name} {d:+.{digits}f} ± {error:.{digits}f}{end} (limit {limit:.{digits}f}{end})"


def summary(table: pd.DataFrame) -> str:
    """Which differences are larger than their errors and than what matters, and which are not decided."""
    rows = {word: [row for row in table.to_dict("records") if row["verdict"] == word] for word in LOUD}
    cases = table["case"].nunique() > 1
    named = [f"- {row['case'] + ': ' if cases else ''}{difference(row)}" for row in rows[DIFFERS]]
    n = len(table)
    if named:
        first = f"🔴 **{len(named)} of {n} differences are larger than their errors and than what matters**:"
    elif len(rows[AGREES]) < n:
        first = f"🟡 **Not all is decided**: no difference of {n} is larger than both its error and what matters."
    else:
        first = f"🟢 No difference of {n} is larger than what matters, and all errors are small enough to tell."
    said = [first, "\n".join(named)]
    if rows[UNDECIDED]:
        blunt = "; ".join(f"{compared(row)}, {in_words(row)[0]}" for row in rows[UNDECIDED])
        said.append(f"{len(rows[UNDECIDED])} are **not decided**: their errors are too large to tell ({blunt}).")
    if rows[NOT_RUN]:
        said.append(f"{len(rows[NOT_RUN])} were **not run** to their end: see the reasons in the tables of the runs.")
    small = [row for row in rows[AGREES] if row["significant"]]
    if small:
        said.append("Larger than their errors, but too small to matter: " + "; ".join(map(difference, small)) + ".")
    return "\n\n".join(part for part in said if part)


def errors_said(table: pd.DataFrame) -> str:
    """What the errors of the runs hold."""
    runs = table[table["comparison"] != TESTS]
    if runs.empty:
        return ""
    if runs["pairs_sd"].isna().all():
        return (
            "**One bed each**: the errors of the runs are those of their block averages and hold no scatter of beds; give two "
            "seeds and more in wheel_check.bed_seeds."
        )
    return (
        "Errors of the runs: the larger of that of their block averages and that of the scatter of the paired differences over the "
        "beds, pooled over the changes on beds of their own, and over those on the base's."
    )


def row_of(row) -> tuple[str, ...]:
    """One line of the table."""
    name, unit, factor, digits = in_words(row)
    base, changed = (
        f"{factor * row[key]:.{digits}f} ± {factor * row[f'{key}_error']:.{digits}f} ({row[f'n_{key}']})"
        for key in ("base", "changed")
    )
    d = f"{factor * row['difference']:+.{digits}f} ± {factor * row['difference_error']:.{digits}f}"
    sd = "–" if pd.isna(row["pairs_sd"]) else f"{factor * row['pairs_sd']:.{digits}f}"
    limit = f"{factor * row['limit']:.{digits}f}"
    quantity = f"{name} ({unit})" if unit else name
    return compared(row), quantity, base + FROM[row["base_from"]], changed, d, sd, limit, LOUD[row["verdict"]]


def settings_of(table: pd.DataFrame) -> str:
    """What each comparison changes, and the beds' solid fractions."""
    rows = []
    for row in table.drop_duplicates(["comparison", "base_setting", "changed_setting"]).to_dict("records"):
        fractions = (row["base_solid_fraction"], row["changed_solid_fraction"])
        beds = ("–", "–") if row["comparison"] == TESTS else tuple(f"{value:.3f}" for value in fractions)
        rows.append((compared(row), row["base_setting"], row["changed_setting"], *beds))
    return markdown(("comparison", "base", "changed", "solid fraction of the base's beds", "of the changed ones"), rows)


def write_page(table: pd.DataFrame, verdicts: dict[str, list[str]], name: str, page: Path) -> None:
    """Write the page (Markdown). table : of schema wheel_check. verdicts : see `soil.verdicts_of`. name : of the runs, a slip."""
    head = ("comparison", "quantity", "base (number)", "changed (number)", "difference", "SD over beds", "limit", "verdict")
    parts = [
        summary(table),
        "# Is the soil under the wheel still the calibrated one?",
        first_line(verdicts),
        f"The wheel's grains are larger and softer than the calibrated ones. The wheel at slip {name} with one changed setting "
        "at a time, and the calibration's own tests with the wheel's grains, stiffness, gravity and normal stresses. ± : standard "
        "errors. A difference is larger than its error beyond two of them.",
        errors_said(table),
    ]
    for case in dict.fromkeys(table["case"]):
        here = table[table["case"] == case]
        parts += [f"## {case}", markdown(head, [row_of(row) for row in here.to_dict("records")]), settings_of(here)]
    write_text(page, "\n\n".join(part.strip() for part in parts if part) + "\n")
