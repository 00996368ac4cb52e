"""The answer: calibrated parameters with their intervals, the properties at the optima, and what a user must know."""

import re
from collections.abc import Mapping

import pandas as pd

from virtual_soil.calibration.optimise import LARGE_GRAINS
from virtual_soil.calibration.response import Responses
from virtual_soil.calibration.verify import QUESTIONS, UNASKED, UNSIMULATED
from virtual_soil.campaign.experiments.common import LARGEST_OVERLAP_RATIO
from virtual_soil.campaign.experiments.registry import RESPONSES
from virtual_soil.report.experiments import of_study
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.quantities import header, printed_unit, shown_in, symbol, symbols, value_with_interval, variables_in_words
from virtual_soil.report.study import Study, runs_at
from virtual_soil.report.text import number, spoken, with_error

NAME, TITLE, HEADING = "answer", "The answer", "The answer"
LINKS = {"answer": "The answer"}
#: Answers of `calibration.verify` that a simulation contradicts.
BEYOND = re.compile("|".join(beyond for beyond, _ in QUESTIONS.values()))
#: The setting `optimise.errors` in words.
ERRORS = {"relative": "relative to the targets, as in the paper", "combined": "in units of the combined standard uncertainties"}
FIGURES: dict[str, Entry] = {}
TABLES = {"answer": "Calibrated grain parameters", "properties": "Properties at the optima", "packing": "How dense the soils are"}


def figures(_study: Study) -> dict[str, Item]:
    """No figures."""
    return {}


def tables(study: Study) -> dict[str, pd.DataFrame]:
    """Parameters and properties."""
    return {
        "answer": answer_table(study.tables["calibration"]),
        "properties": properties_table(study.tables["verification"], study.responses),
        "packing": packing_table(study),
    }


def words(study: Study) -> dict:
    """Cards and remarks."""
    return {
        "cards": answer_cards(study.tables["calibration"], study.tables["verification"]),
        "errors": ERRORS[study.config["optimise"]["errors"]],
        "preference": " and prefers large grains" if prefers_large(study.config["optimise"]["cases"]) else "",
        "targets": ", ".join(response.symbol for response in study.wanted.values()),
        "remarks": answer_remarks(study),
    }


def prefers_large(cases: list[dict]) -> bool:
    """True if a case has a weight for large grains."""
    return any(case["weights"].get(LARGE_GRAINS, 0) > 0 for case in cases)


def answer_table(calibration: pd.DataFrame) -> pd.DataFrame:
    """Our optima with the intervals of their variables, and whether their simulated soils match the targets."""
    rows = []
    shown = shown_in(calibration)
    for _, row in calibration[calibration["surrogate"] == "ours"].iterrows():
        cells = [cell for name in shown for cell in value_with_interval(row, name)]
        rows.append((row["case"], *cells, spoken(row["match"])))
    columns = [column for variable in shown.values() for column in (header(variable), "95 %")]
    return pd.DataFrame(rows, columns=["case", *columns, "targets"])


def answer_cards(calibration: pd.DataFrame, verification: pd.DataFrame) -> list[dict]:
    """Our optima as cards."""
    ours = calibration[calibration["surrogate"] == "ours"]
    return [answer_card(row, verification[verification["case"] == row["case"]]) for _, row in ours.iterrows()]


def answer_card(row: Mapping, verification: pd.DataFrame) -> dict:
    """Case, each variable with its interval, every property as simulated and as wanted, and the two verdicts.

    `state` is "good" only if the simulated soil matches every target and none of its simulations was spoiled.
    """
    values = []
    for name, variable in shown_in(row).items():
        value, interval = value_with_interval(row, name)
        values.append((variable.symbol, f"{value} {variable.unit}".rstrip(), interval))
    sound = not row["n_spoiled"]
    match = (
        "the simulated soil matches its targets"
        if row["match"] == "matches"
        else f"simulated against wanted: {spoken(row['match'])}"
    )
    prediction = (
        "simulation confirms the prediction" if row["prediction"] == "confirmed" else f"prediction {spoken(row['prediction'])}"
    )
    return {
        "case": spoken(row["case"]),
        "values": values,
        "properties": [property_line(line) for _, line in verification.iterrows()],
        "state": state_of(row["match"], "matches") if sound else "bad",
        "verdicts": [(state_of(row["match"], "matches"), match), (state_of(row["prediction"], "confirmed"), prediction)],
        "next": next_step(row),
        "spoiled": "" if sound else f"{row['n_spoiled']:.0f} of its simulations failed or did not come to rest",
        "soft": soft(row["max_overlap_ratio"]),
    }


def next_step(row: Mapping) -> str:
    """What to do with an answer."""
    if row["match"] == "matches" and not row["n_spoiled"]:
        return f"Next: export/{row['case']} holds a material card, and input for DEM programs."
    if "misses" in row["match"]:
        return "Next: see whether the target is within reach (section 2), and the best simulated points (section 6)."
    if row["match"] == UNSIMULATED:
        return "Next: see why no simulation of it ended well (Checks and sources)."
    return "Next: raise verify.more_seeds; each round doubles the seeds of the tests that do not decide yet."


def soft(overlap: float) -> str:
    """A warning if grains overlap by more than they should in the simulations of an optimum."""
    if not overlap > LARGEST_OVERLAP_RATIO:
        return ""
    return f"grains overlap by up to {overlap:.0%} of r in its simulations, more than {LARGEST_OVERLAP_RATIO:.0%}: too soft?"


def state_of(answer: str, good: str) -> str:
    """One of "good", "bad", "open" (not decided, or not simulated) and "none" (not asked)."""
    if answer in (good, UNASKED):
        return "good" if answer == good else "none"
    return "bad" if BEYOND.search(answer) else "open"


def property_line(line: Mapping) -> tuple[str, str, str, str]:
    """Symbol of a property, its simulated value with its standard error, what is wanted, and the state of its match."""
    response = RESPONSES[line["response"]]
    simulated, unit = with_error(line["simulated"], line["simulated_se"]), printed_unit(response)
    return (
        response.symbol,
        f"{simulated}{unit if unit == '°' else f' {unit}'}",
        "" if pd.isna(line["target"]) else f"wanted {number(line['target'])}",
        state_of(line["match"], "matches"),
    )


def spoken_list(names: str) -> str:
    """Comma-separated names as words."""
    return ", ".join(spoken(name) for name in names.split(",") if name)


def properties_table(verification: pd.DataFrame, responses: Responses) -> pd.DataFrame:
    """Target, prediction and simulation of every property at the optimum."""
    cases, columns, names = list(dict.fromkeys(verification["case"])), [], ["case"]
    for response in responses.values():
        rows = verification[verification["response"] == response.name].set_index("case").loc[cases]
        columns.append([number(v) for v in rows["target"]])
        for kind in ("predicted", "simulated"):
            columns.append([with_error(v, e) for v, e in zip(rows[kind], rows[f"{kind}_se"], strict=True)])
        names += [header(response), "predicted", "simulated"]
    return pd.DataFrame(list(zip(cases, *columns, strict=True)), columns=names)


def packing_table(study: Study) -> pd.DataFrame:
    """Solid fraction, void ratio and bulk density of every optimum in the states that its tests know: means of its runs."""
    rows = []
    for _, optimum in study.tables["calibration"].query("surrogate == 'ours'").iterrows():
        states = [(test.NAME, *state) for test in of_study(study.config) for state in test.SOLID_FRACTIONS.items()]
        for experiment, column, state in states:
            runs = runs_at(study, experiment, optimum)
            fraction = runs[column].mean() if column in runs else float("nan")
            density = fraction * runs["density_kg_m3"].mean()
            cells = number(fraction, 3), number(1.0 / fraction - 1.0, 3), number(density, 0)
            rows.append((spoken(optimum["case"]), state, *cells, len(runs)))
    columns = ["case", "state", "solid fraction", "void ratio", "bulk density (kg/m³)", "simulations"]
    return pd.DataFrame(rows, columns=columns)


def answer_remarks(study: Study) -> list[str]:
    """One paragraph per case: what a user of its parameters must know."""
    return [" ".join(caveats(row, study)) for _, row in study.tables["calibration"].query("surrogate == 'ours'").iterrows()]


def caveats(optimum: Mapping, study: Study) -> list[str]:
    """Sentences on one optimum."""
    found = [
        *missed_targets(optimum),
        *beyond_simulated(optimum, study.tables["reachability"], study.responses),
        *outside_interval(optimum),
        *doubts(optimum),
        *undetermined(optimum["case"], study.tables["identifiability"], study.tables["equivalents"]),
    ]
    return [f"{optimum['case']}:", *(found or ["nothing to add."])]


def missed_targets(optimum: Mapping) -> list[str]:
    """Targets that the optimum misses, and predictions at it that are extrapolated."""
    sentences = []
    if optimum["missed"]:
        sentences.append(
            f"No virtual soil of this design has all properties of the real one; this one misses "
            f"{spoken_list(optimum['missed'])}, by up to {optimum['deviation_sd']:.0f} standard deviations. "
            "The intervals are those of the nearest soils, not of the real one."
        )
    if optimum["extrapolated"]:
        sentences.append(f"It lies outside the simulated points; extrapolated: {spoken_list(optimum['extrapolated'])}.")
    return sentences


def outside_interval(optimum: Mapping) -> list[str]:
    """Why the variables of an optimum lie outside their own 95 % intervals."""
    outside = [name for name in shown_in(optimum) if not optimum[f"{name}_low_95"] <= optimum[name] <= optimum[f"{name}_high_95"]]
    if not outside:
        return []
    large = optimum.get(f"weight_{LARGE_GRAINS}", 0.0) > 0
    why = "also prefers large grains" if large else "weighs errors by the configured weights"
    named = ", ".join(map(symbol, outside))
    return [f"Its {named} lies outside the 95 % interval: the optimum {why}, while the interval holds what is probable."]


def beyond_simulated(optimum: Mapping, reachability: pd.DataFrame, responses: Responses) -> list[str]:
    """Predictions at an optimum that lie outside the range of all simulations of the campaign."""
    sentences = []
    for response in responses.values():
        known = reachability[reachability["response"] == response.name]
        if known.empty:
            continue
        simulated = known.iloc[0]
        low, high, value = simulated["lowest_simulated"], simulated["highest_simulated"], optimum[response.column]
        if not low <= value <= high:
            sentences.append(
                f"The predicted {response.words}, {value:.1f} {response.unit}, lies beyond all that the campaign simulated "
                f"({low:.1f} to {high:.1f})."
            )
    return sentences


def doubts(optimum: Mapping) -> list[str]:
    """The optimum at an edge, not confirmed, or one of several."""
    sentences = []
    if optimum["at_bound"]:
        sentences.append(f"It lies at the edge of the design ({symbols(optimum['at_bound'])}).")
    if optimum["prediction"] != "confirmed":
        sentences.append(f"Simulating it does not confirm what was predicted ({spoken(optimum['prediction'])}).")
    if "not decided" in optimum["match"]:
        sentences.append("Tests there are too few or too small to decide whether it meets its targets; raise verify.more_seeds.")
    if optimum["n_distinct"] > 1:
        sentences.append(f"{optimum['n_distinct']} distinct minima were found; the cheapest is shown.")
    return sentences


def undetermined(case: str, identifiability: pd.DataFrame, equivalents: pd.DataFrame) -> list[str]:
    """The two farthest of the parameter sets that the tests cannot tell apart, if they leave a combination open."""
    sets = equivalents[equivalents["case"] == case].sort_values("radius_m")
    if identifiability.loc[identifiability["case"] == case, "determined"].astype(bool).all() or len(sets) < 2:
        return []
    fine, coarse = ((row, variables_in_words(row)) for _, row in sets.iloc[[0, -1]].iterrows())
    named = ", ".join(variable.symbol for variable in shown_in(sets).values())
    return [
        f"Parameters can be traded: the tests do not tell {named} = {fine[1]} from {coarse[1]} (section 5 lists more such sets)."
    ]
