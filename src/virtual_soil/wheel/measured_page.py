"""Sections of the page about measurements and the handbook's wheel: criteria, a verdict for each point, and their sum."""

from collections.abc import Sequence

import pandas as pd

from virtual_soil.verification.page import markdown
from virtual_soil.wheel import beside

#: Quantity -> words, unit, factor and decimals of its values.
QUANTITIES = {
    "sinkage_m": ("sinkage", "mm", 1e3, 1),
    "drawbar_ratio": ("F_DP/W", "", 1.0, 3),
    "drawbar_sign": ("sign of F_DP/W", "", 1.0, 3),
    "traction_coefficient": ("T/(W R)", "", 1.0, 3),
    "pressure_pa": ("pressure", "kPa", 1e-3, 2),
    "pressure_growth": ("pressure over that of the next smaller plate", "", 1.0, 2),
}
#: Quantity -> what agrees.
CRITERIA = {
    "sinkage_m": f"within {100 * beside.SINKAGE_SHARE:g} % of the measured one",
    "drawbar_ratio": f"within {beside.DRAWBAR_DIFFERENCE:g}",
    "drawbar_sign": f"the same sign, where both are {beside.SIGN_DEVIATIONS:g} deviations from zero",
    "pressure_pa": f"within {100 * beside.PRESSURE_SHARE:g} % of the measured one",
    "pressure_growth": "above 1 where the measured one is",
}
#: Verdicts that stand out.
LOUD = {beside.MISSES: f"🔴 **{beside.MISSES}**", beside.AGREES: f"🟢 {beside.AGREES}"}


def measured_section(table: pd.DataFrame, sources: Sequence[str]) -> str:
    """Section about the measurements; table : of schema wheel_measured."""
    text = (
        "Predicted: mean over the beds ± its standard error (of one bed, that of its run). Measured: mean ± standard deviation of "
        "repeated tests, or as the file says; – if not known. The criteria were stated before the runs. They do not count the "
        "errors, but for signs. The sinkage of a plate counts from the bed's level here; a laboratory's zero may be elsewhere."
    )
    parts = ["## Beside measurements", first(table), "\n".join(f"- {source}" for source in dict.fromkeys(sources)), text]
    return "\n\n".join([*parts, summary(table), points(table)])


def first(table: pd.DataFrame) -> str:
    """How many points agree, and whether any misses."""
    n = {
        verdict: int((table["verdict"] == verdict).sum())
        for verdict in (beside.AGREES, beside.MISSES, beside.UNDECIDED, beside.NOT_RUN)
    }
    decided = n[beside.AGREES] + n[beside.MISSES]
    if not decided:
        return "**No measured point has a verdict.**"
    said = f"{n[beside.AGREES]} of {decided} verdicts agree"
    others = ", ".join(f"{n[verdict]} {verdict}" for verdict in (beside.UNDECIDED, beside.NOT_RUN) if n[verdict])
    end = f"; {others}." if others else "."
    return f"🔴 **{said}, {n[beside.MISSES]} miss**{end}" if n[beside.MISSES] else f"🟢 {said}{end}"


def summary(table: pd.DataFrame) -> str:
    """One line per case and criterion."""
    rows = []
    for case in dict.fromkeys(table["case"]):
        for quantity, allowed in CRITERIA.items():
            here = table[(table["case"] == case) & (table["quantity"] == quantity)]["verdict"]
            counts = [int((here == verdict).sum()) for verdict in (beside.AGREES, beside.MISSES, beside.UNDECIDED, beside.NOT_RUN)]
            if sum(counts):
                rows.append((case, QUANTITIES[quantity][0], allowed, *counts))
    return markdown(("case", "quantity", "agrees if", "agree", "miss", "not decided", "not run"), rows)


def points(table: pd.DataFrame) -> str:
    """One line per measured point and quantity."""
    rows = []
    for row in table.to_dict("records"):
        words, unit, factor, digits = QUANTITIES[row["quantity"]]
        where = (
            f"s = {row['slip']:g}"
            if row["tool"] == "wheel"
            else f"{1e3 * row['diameter_m']:.3g} mm plate, {1e3 * row['at_m']:.3g} mm"
        )
        values = (spread(factor * row[name], factor * row[error], digits) for name, error in PAIRS)
        difference, allowed = (number(factor * row[name], digits) for name in ("difference", "allowed"))
        name = f"{words} ({unit})" if unit else words
        rows.append(
            (row["case"], name, where, *values, row["n_beds"], difference, allowed, LOUD.get(row["verdict"], row["verdict"]))
        )
    return markdown(("case", "quantity", "at", "predicted", "measured", "beds", "difference", "allowed", "verdict"), rows)


PAIRS = (("predicted", "predicted_error"), ("measured", "measured_sd"))


def number(value: float, digits: int) -> str:
    """A number; – if it is missing."""
    return "–" if pd.isna(value) else f"{value:.{digits}f}"


def spread(value: float, deviation: float, digits: int) -> str:
    """A value with its deviation, if that is known."""
    return number(value, digits) + ("" if pd.isna(deviation) else f" ± {deviation:.{digits}f}")


def handbook_section(table: pd.DataFrame) -> str:
    """Section about the handbook's wheel; table : of schema wheel_handbook."""
    lines = ["## Handbook", ""]
    if table.empty:
        return "\n".join([*lines, "No plate gave a law p = k zⁿ."])
    for case, rows in table.groupby("case", sort=False):
        row = rows.iloc[0]
        lines.append(
            f"- Rigid wheel after Wong & Reece 1967 (`virtual_soil.wheel.handbook`), with k = {row['k_pa_m_n']:.3g} Pa/mⁿ and "
            f"n = {row['n']:.2f} of the {'simulated' if case else 'measured'} plate of {1e3 * row['diameter_m']:.3g} mm"
            f"{f' on {case}' if case else ''}; stated: φ = {row['internal_friction_angle_deg']:g}°, c = {row.cohesion_pa:g} Pa, "
            f"K = {1e3 * row['shear_displacement_m']:g} mm. Dashed in the figure."
        )
        if rows["sinkage_m"].isna().any():
            lines.append("  Its line ends where the wheel would sink to its axle.")
    return "\n".join(lines)
