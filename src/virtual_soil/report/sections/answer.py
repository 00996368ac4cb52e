"""The report's tables and remarks on the calibration: the answer, its uncertainty, its verification, its refinement."""

import numpy as np
import pandas as pd

from virtual_soil.calibration.surrogate import RESPONSES
from virtual_soil.report.text import interval, number, spoken, with_error

SYMBOLS = {"radius_m": "r", "static_friction": "µs", "rolling_friction": "µr"}
#: Left-out errors beyond this many of the noise say that a surrogate misses something.
POOR_SCORE = 3.0


def answer_table(calibration: pd.DataFrame) -> pd.DataFrame:
    """Our optima with the intervals of their variables, and what simulating them said."""
    ours = calibration[calibration["surrogate"] == "ours"]
    rows = []
    for _, row in ours.iterrows():
        cells = [row["case"]]
        for name, digits, scale in (("radius_m", 0, 1e6), ("static_friction", 2, 1.0), ("rolling_friction", 3, 1.0)):
            cells += [number(row[name], digits, scale), interval(row, name, digits, scale)]
        rows.append((*cells, row["verified"]))
    return pd.DataFrame(rows, columns=["case", "r (µm)", "95 %", "µs", "95 %", "µr", "95 %", "simulation"])


def answer_cards(calibration: pd.DataFrame) -> list[dict]:
    """Our optima as cards: case, each variable with its interval, and in words whether simulating it confirms it."""
    cards = []
    for _, row in calibration[calibration["surrogate"] == "ours"].iterrows():
        values = [
            (SYMBOLS[name], number(row[name], digits, scale) + unit, interval(row, name, digits, scale))
            for name, digits, scale, unit in (
                ("radius_m", 0, 1e6, " µm"), ("static_friction", 2, 1.0, ""), ("rolling_friction", 3, 1.0, ""),
            )
        ]  # fmt: skip
        agrees = row["verified"] == "agrees"
        verdict = "verified by DEM" if agrees else f"not verified by DEM: {spoken(row['verified'])}"
        missed = ", ".join(spoken(name) for name in row["missed"].split(",")) if row["missed"] else ""
        cards.append({"case": spoken(row["case"]), "values": values, "agrees": agrees, "verdict": verdict, "missed": missed})
    return cards


def properties_table(verification: pd.DataFrame) -> pd.DataFrame:
    """Of every property at the optimum the target, what the surrogates predict and what the simulations give."""
    cases, columns, names = list(dict.fromkeys(verification["case"])), [], ["case"]
    for response, label in (("cohesion", "c (Pa)"), ("friction_angle", "φ (°)"), ("angle_of_repose", "A (°)")):
        rows = verification[verification["response"] == response].set_index("case").loc[cases]
        columns.append([number(v) for v in rows["target"]])
        columns.append([with_error(v, e) for v, e in zip(rows["predicted"], rows["predicted_se"], strict=True)])
        columns.append([with_error(v, e) for v, e in zip(rows["simulated"], rows["simulated_se"], strict=True)])
        names += [label, "predicted", "simulated"]
    return pd.DataFrame(list(zip(cases, *columns, strict=True)), columns=names)


def answer_remarks(tables) -> list[str]:
    """What a reader must know before using the parameters: one paragraph per case."""
    return [" ".join(caveats(row, tables)) for _, row in tables["calibration"].query("surrogate == 'ours'").iterrows()]


def caveats(optimum, tables) -> list[str]:
    """Sentences on one optimum."""
    case = optimum["case"]
    sentences = [f"{case}:"]
    if optimum["missed"]:
        names = ", ".join(spoken(name) for name in optimum["missed"].split(","))
        sentences.append(
            f"No virtual soil of this design has all three properties; this one misses {names}, by up to "
            f"{optimum['deviation_sd']:.0f} standard deviations. The intervals are those of the nearest soils, not of the real one."
        )
    if optimum["extrapolated"]:
        names = ", ".join(spoken(name) for name in optimum["extrapolated"].split(","))
        sentences.append(f"It lies outside the simulated points; extrapolated: {names}.")
    sentences += beyond_simulated(optimum, tables["reachability"])
    if optimum["at_bound"]:
        names = ", ".join(SYMBOLS.get(name, name) for name in optimum["at_bound"].split(","))
        sentences.append(f"It lies at the edge of the design ({names}).")
    if optimum["verified"] != "agrees":
        sentences.append(f"Simulating it does not confirm what was predicted ({optimum['verified'].replace('_', ' ')}).")
    if optimum["n_distinct"] > 1:
        sentences.append(f"{optimum['n_distinct']} distinct minima were found; the cheapest is shown.")
    free = tables["identifiability"].query("case == @case and not determined")
    if len(free):
        named = "; ".join(combination(direction) for _, direction in free.iterrows())
        sentences.append(f"The tests do not determine {named} there: equivalents.parquet lists sets that serve as well.")
    return sentences if len(sentences) > 1 else [f"{case}: nothing to add."]


def beyond_simulated(optimum, reachability: pd.DataFrame) -> list[str]:
    """Predictions at an optimum that lie beyond everything that was simulated in the campaign."""
    sentences = []
    for name, (column, unit) in RESPONSES.items():
        simulated = reachability.query("response == @name").iloc[0]
        low, high = simulated["lowest_simulated"], simulated["highest_simulated"]
        if not low <= optimum[column] <= high:
            sentences.append(
                f"The predicted {spoken(name)}, {optimum[column]:.1f} {unit}, lies beyond all that the campaign simulated "
                f"({low:.1f} to {high:.1f})."
            )
    return sentences


def combination(direction) -> str:
    """A direction of the design variables in words, components below a tenth left out."""
    parts = []
    for name, symbol in SYMBOLS.items():
        value = direction.get(f"component_{name}", 0.0)
        if abs(value) >= 0.1:
            parts.append(f"{value:+.2f} {symbol}")
    return " ".join(parts)


def reachability_table(table: pd.DataFrame) -> pd.DataFrame:
    """Targets and the ranges of simulations and surrogates."""
    return pd.DataFrame(
        {
            "soil": table["soil"],
            "property": table["response"].map(spoken),
            "target": [number(v) for v in table["target"]],
            "simulated": ranges(table, "simulated"),
            "surrogate over the design": ranges(table, "predicted"),
            "reachable": np.where(table["reachable"], "yes", "no"),
        }
    )


def ranges(table: pd.DataFrame, kind: str) -> list[str]:
    """Lowest to highest."""
    return [f"{number(a)} to {number(b)}" for a, b in zip(table[f"lowest_{kind}"], table[f"highest_{kind}"], strict=True)]


def reach_remarks(table: pd.DataFrame) -> list[str]:
    """One sentence per target out of reach."""
    out = table[~table["reachable"]]
    why = ["Grains without adhesion have no cohesion: a soil's own can only be met with a contact law that has one."]
    return [
        f"The {spoken(row['response'])} of {row['soil']}, {row['target']:g}, is out of reach: the design gives "
        f"{number(row['lowest_predicted'])} to {number(row['highest_predicted'])}. Nearest: {number(row['nearest_reachable'])}; "
        f"beyond it the response would go on with {symbols(row['grows_with'])}."
        for _, row in out.iterrows()
    ] + (why if "cohesion" in set(out["response"]) else [])


def symbols(changes: str) -> str:
    """Signed names of variables as signed symbols."""
    return ", ".join(change[0] + SYMBOLS.get(change[1:], change[1:]) for change in changes.split(", ") if change)


def verification_table(verification: pd.DataFrame) -> pd.DataFrame:
    """Predicted and simulated at every optimum."""
    return pd.DataFrame(
        {
            "case": verification["case"],
            "property": [f"{spoken(r)} ({u})" for r, u in zip(verification["response"], verification["unit"], strict=True)],
            "target": [number(v) for v in verification["target"]],
            "predicted": [with_error(v, e) for v, e in zip(verification["predicted"], verification["predicted_se"], strict=True)],
            "simulated": [with_error(v, e) for v, e in zip(verification["simulated"], verification["simulated_se"], strict=True)],
            "scatter over seeds": [number(v) for v in verification["simulated_sd"]],
            "seeds": verification["n_seeds"],
            "gap": [with_error(v, e) for v, e in zip(verification["gap"], verification["gap_se"], strict=True)],
            "agrees": np.where(verification["agrees"], "yes", "no"),
        }
    )


def gap_table(rounds: list[pd.DataFrame], verification: pd.DataFrame) -> pd.DataFrame:
    """Gap between predicted and simulated at the optimum of each round; the last one is the verification's."""
    rows = []
    for k, comparison in enumerate([*rounds, verification]):
        for _, row in comparison.iterrows():
            where = (
                f"{number(row['radius_m'], 0, 1e6)} µm, {number(row['static_friction'], 3)}, {number(row['rolling_friction'], 4)}"
            )
            gap = with_error(row["gap"], row["gap_se"])
            rows.append((row["case"], spoken(row["response"]), k, where, number(row["predicted_se"]), gap))
    columns = ["case", "property", "round", "optimum (r, µs, µr)", "predicted error", "simulated − predicted"]
    return pd.DataFrame(rows, columns=columns).sort_values(["case", "property", "round"], ignore_index=True)


def minima_table(minima: pd.DataFrame) -> pd.DataFrame:
    """Every distinct minimum of our surrogates."""
    ours = minima[minima["surrogate"] == "ours"]
    return pd.DataFrame(
        {
            "case": ours["case"],
            "r (µm)": [number(v, 1, 1e6) for v in ours["radius_m"]],
            "µs": [number(v, 3) for v in ours["static_friction"]],
            "µr": [number(v, 4) for v in ours["rolling_friction"]],
            "c (Pa)": [number(v) for v in ours["cohesion_pa"]],
            "φ (°)": [number(v) for v in ours["friction_angle_deg"]],
            "A (°)": [number(v) for v in ours["angle_of_repose_deg"]],
            "cost": [number(v, 5) for v in ours["cost"]],
            "at an edge": ours["at_bound"].str.replace(",", ", "),
            "condition": [f"{v:.2g}" for v in ours["condition_number"]],
        }
    )


def identifiability_table(table: pd.DataFrame) -> pd.DataFrame:
    """Which combinations of the variables are determined."""
    return pd.DataFrame(
        {
            "case": table["case"],
            "combination": [combination(row) for _, row in table.iterrows()],
            "singular value": [f"{v:.2g}" for v in table["singular_value"]],
            "standard deviation (extents)": [f"{v:.2g}" for v in table["standard_deviation"]],
            "determined": np.where(table["determined"], "yes", "no"),
        }
    )


def quality_table(models: dict) -> pd.DataFrame:
    """Errors of both kinds of surrogate: {kind: {response: model}}."""
    rows = []
    for kind, surrogates in models.items():
        for s in surrogates.values():
            squared = number(getattr(s, "r_squared", None), 3)
            calibration = number(getattr(s, "cv_calibration", None), 2)
            rows.append(
                (
                    spoken(s.response),
                    spoken(kind),
                    s.n_points,
                    squared,
                    f"{number(s.cv_rmse, 2)} {s.unit}",
                    number(s.cv_score, 2),
                    calibration,
                )
            )
    columns = [
        "response",
        "surrogate",
        "points",
        "R² of f",
        "error, left out",
        "in units of the noise",
        "in units of its own error",
    ]
    return pd.DataFrame(rows, columns=columns).sort_values("response", kind="stable", ignore_index=True)


def fit_remarks(tables, chosen: dict) -> list[str]:
    """What limits the surrogates."""
    strength = tables["strength"].query("fidelity == 'campaign'")
    noise, spread = strength["cohesion_se_pa"].median(), strength["cohesion_pa"].std()
    remarks = [
        f"Cohesion of a point is known to ± {noise:.0f} Pa (median standard error), beside a spread of {spread:.0f} Pa "
        "over the design: grains without adhesion have almost none, and what the regression finds is mostly noise."
    ]
    used = "; ".join(f"{spoken(response)}: {spoken(model.model)}" for response, model in chosen.items())
    remarks.append(f"The optimiser uses, for {used}.")
    for response, model in chosen.items():
        if model.cv_score > POOR_SCORE:
            remarks.append(
                f"The surrogate of the {spoken(response)} misses left-out points by {model.cv_score:.1f} times their noise."
            )
    return remarks


def sensitivity_table(table: pd.DataFrame) -> pd.DataFrame:
    """Sobol indices."""
    return pd.DataFrame(
        {
            "response": table["response"].map(spoken),
            "variable": [SYMBOLS.get(name, name) for name in table["variable"]],
            "alone": [with_error(v, e, 2) for v, e in zip(table["first_order"], table["first_order_ci95"], strict=True)],
            "alone and with others": [with_error(v, e, 2) for v, e in zip(table["total"], table["total_ci95"], strict=True)],
            "response's spread over the design": [number(v) for v in table["response_sd"]],
        }
    )


def coverage_sentence(coverage: pd.DataFrame) -> str:
    """How often the stated region holds the truth."""
    n, held = len(coverage), int(coverage["inside_95"].sum())
    return (
        "Every simulated point, taken as an unknown soil and calibrated without its own simulations: the 95 % region holds the "
        f"true parameters of {held} of {n} ({held / n:.0%})."
    )


def twin_table(twins: pd.DataFrame | None) -> pd.DataFrame | None:
    """Hidden soils found again; None if there are none."""
    if twins is None or twins.empty:
        return None
    scale = [1e6 if name == "radius_m" else 1.0 for name in twins["variable"]]
    return pd.DataFrame(
        {
            "twin": twins["twin"],
            "variable": [f"{SYMBOLS.get(n, n)}{' (µm)' if n == 'radius_m' else ''}" for n in twins["variable"]],
            "truth": [number(v, 3, k) for v, k in zip(twins["truth"], scale, strict=True)],
            "optimum": [number(v, 3, k) for v, k in zip(twins["optimum"], scale, strict=True)],
            "95 % interval": [
                f"{number(a, 3, k)} to {number(b, 3, k)}" for a, b, k in zip(twins["low_95"], twins["high_95"], scale, strict=True)
            ],
            "truth inside the 95 % region": np.where(twins["inside_95"], "yes", "no"),
        }
    )
