"""The uncertainty: parameters that are consistent with the targets, directions that the tests determine, and coverage."""

import itertools
from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from virtual_soil.calibration.further import FURTHER_RATIO, further_error, halving_error, left_over
from virtual_soil.calibration.response import Responses
from virtual_soil.calibration.space import space_of
from virtual_soil.calibration.trade_off import trade_off
from virtual_soil.calibration.verify import UNASKED, verdict
from virtual_soil.campaign.experiments.registry import RESPONSES
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.plots import COLOURS, canvas
from virtual_soil.report.quantities import VARIABLES, axis_label, combination, header, shown_in, symbol
from virtual_soil.report.study import Study, offers
from virtual_soil.report.text import number, spoken, with_error

NAME, TITLE, HEADING = "uncertainty", "5. Uncertainty", "5. How sure is it"
LINKS = {"uncertainty": "5. How sure"}
FIGURES = {
    "iso": Entry("Curves of equal response", view="iso", hint="Choose the case and go through the radii.", needs="plane"),
    "trade_off": Entry("Trade-off of the responses"),
    "coverage": Entry("Coverage of the stated regions"),
}
TABLES = {
    "equivalents": "Equivalent parameter sets",
    "equivalents_simulated": "Equivalent sets, simulated",
    "identifiability": "Determined combinations",
    "narrowing": "What a further measurement would leave of the uncertainty",
    "coverage": "Coverage of the stated regions",
}
#: Equivalent sets listed for every case.
N_SHOWN = 10
#: Masses of regions in the table of the coverage.
MASSES = (0.5, 0.9, 0.95)

#: Half width of the band around a target, over the target, and its minimum in Pa or degrees.
BAND, MIN_BAND = 0.05, 1.0
#: Points of the plotted fields along static and rolling friction.
N_POINTS = 90


def figures(study: Study) -> dict[str, Item]:
    """Curves of equal response, and the coverage."""
    iso = {"iso": iso_figure(study)} if "plane" in offers(study.config) else {}
    return iso | {"trade_off": trade_off_figure(study), "coverage": coverage_figure(study.tables["coverage"])}


def tables(study: Study) -> dict[str, pd.DataFrame]:
    """Equivalent sets, determined combinations of the variables, what would narrow them, and the coverage."""
    asked = asked_of(study.tables["verification"])
    variables = study.config["design"]["variables"]
    return {
        "equivalents": equivalents_table(study.tables["equivalents"], study.responses),
        "equivalents_simulated": simulated_table(study.tables.get("equivalents_simulated"), study.responses),
        "identifiability": identifiability_table(study.tables["identifiability"]),
        "narrowing": narrowing_table(study.tables["posterior"], variables, study.responses, asked, study.config),
        "coverage": coverage_table(study.tables["coverage"]),
    }


def words(study: Study) -> dict:
    """Hidden soils found again; whether equivalent sets were simulated, and whether a case leaves a response unasked."""
    asked = asked_of(study.tables["verification"])
    return {
        "twins": twin_table(study.twins),
        "simulated": "equivalents_simulated" in study.tables,
        "measured_percent": f"{100.0 * FURTHER_RATIO:g}",
        "unasked": any(set(study.responses) - names for names in asked.values()),
    }


def asked_of(verification: pd.DataFrame) -> dict[str, set[str]]:
    """Responses that each case is calibrated by."""
    return {
        str(case): set(lines.loc[lines["match"] != UNASKED, "response"]) for case, lines in verification.groupby("case", sort=False)
    }


def iso_figure(study: Study) -> Item:
    """Curves of equal response through the targets."""
    tables = study.tables
    sets = {"posterior": tables["posterior"], "equivalent": tables["equivalents"], "optimum": tables["calibration"]}
    return Item(
        iso_responses(tables["calibration"], tables["posterior"], tables["equivalents"], study.models["chosen"]),
        pd.concat([table.assign(kind=kind) for kind, table in sets.items()]),
        "Curves of equal response through the targets, with the parameters that are consistent with them",
    )


def iso_responses(calibration: pd.DataFrame, posterior: pd.DataFrame, equivalents: pd.DataFrame, surrogates: Mapping) -> Figure:
    """For every case: curves of equal response through its targets in the friction plane, posterior, equivalents and optimum."""
    ours = calibration[calibration["surrogate"] == "ours"]
    figure, panels = canvas(len(ours), width=max(5.0 * len(ours), 8.0), height=4.4)
    for axes, (_, optimum) in zip(panels, ours.iterrows(), strict=False):
        own, sets = (table[table["case"] == optimum["case"]] for table in (posterior, equivalents))
        axes.plot(own["static_friction"], own["rolling_friction"], ".", color="0.7", markersize=2.5, zorder=0)
        for colour, (name, surrogate) in zip(COLOURS, surrogates.items(), strict=False):
            draw_iso_response(axes, name, surrogate, optimum, colour)
        axes.plot(sets["static_friction"], sets["rolling_friction"], "o", color="0.2", markerfacecolor="none", markersize=4)
        axes.plot(optimum["static_friction"], optimum["rolling_friction"], "*", color="black", markersize=13)
        axes.set_title(f"{spoken(optimum['case'])}, r = {1e6 * optimum['radius_m']:.0f} µm", fontsize="medium")
        axes.set_xlabel(axis_label("static_friction"))
        axes.legend(fontsize="x-small", loc="upper right")
    panels[0].set_ylabel(axis_label("rolling_friction"))
    return figure


def draw_iso_response(axes, name: str, surrogate, optimum: Mapping, colour: str) -> None:
    """The curve on which a response has its target at the optimum's radius, and a band around it; nothing without a target."""
    ranges = [surrogate.ranges[name] for name in ("static_friction", "rolling_friction")]
    s, r = np.meshgrid(*(np.linspace(low, high, N_POINTS) for low, high in ranges))
    values = {"static_friction": s, "rolling_friction": r, "radius_m": np.full_like(s, optimum["radius_m"])}
    response, field = RESPONSES[name], surrogate.predict(values)
    target = optimum[f"target_{response.column}"]
    if pd.isna(target):
        return
    reached = field.min() <= target <= field.max()
    axes.plot([], [], color=colour, label=f"{response.words} {response.symbol} = {target:g}" + ("" if reached else ": nowhere"))
    if reached:
        axes.contour(s, r, field, levels=[target], colors=colour)
        band = max(BAND * abs(target), MIN_BAND)
        axes.contourf(s, r, field, levels=[target - band, target + band], colors=colour, alpha=0.15)


def trade_off_figure(study: Study) -> Item:
    """What meeting one target costs of another: predictions over the design, and those that none beats in all targets."""
    verification, space, parts = study.tables["verification"], space_of(study.config["design"]), []
    for case in dict.fromkeys(verification["case"]):
        lines = verification[(verification["case"] == case) & (verification["match"] != UNASKED)].set_index("response")
        targets = {name: (line["target"], line["target_se"]) for name, line in lines.iterrows()}
        table = trade_off(study.models["chosen"], space, targets)
        parts.append((case, lines, table))
    data = pd.concat([table.assign(case=case) for case, _, table in parts], ignore_index=True)
    alt = "Predicted responses over each other, with the targets and the virtual soils that no other one beats in all of them"
    return Item(trade_offs(parts), data, alt)


def trade_offs(parts: list[tuple[str, pd.DataFrame, pd.DataFrame]]) -> Figure:
    """For every case (its name, lines of the verification by response, `trade_off`) a row of panels: each pair of responses."""
    pairs = [list(itertools.combinations(lines.index, 2)) or [(lines.index[0],) * 2] for _, lines, _ in parts]
    columns = max(map(len, pairs))
    figure = Figure(figsize=(max(3.7 * columns, 6.0), 3.2 * len(parts)), layout="constrained")
    panels = figure.subplots(len(parts), columns, squeeze=False)
    for row, (case, lines, table), own in zip(panels, parts, pairs, strict=True):
        for axes, pair in itertools.zip_longest(row, own):
            if pair is None:
                axes.set_axis_off()
                continue
            draw_trade_off(axes, lines, table, pair)
            axes.set_title(spoken(case), fontsize="medium")
    panels[0, 0].legend(fontsize="x-small")
    return figure


def draw_trade_off(axes, lines: pd.DataFrame, table: pd.DataFrame, pair: tuple[str, str]) -> None:
    """Predictions of two responses over each other, the front, the targets (bars: two standard deviations) and the optimum."""
    first, second = pair
    axes.plot(table[first], table[second], ".", color="0.8", markersize=2, label="predicted over the design")
    front = table[table["on_front"]]
    axes.plot(front[first], front[second], ".", color=COLOURS[0], markersize=4, label="none is better in all targets")
    x, y = lines.loc[first], lines.loc[second]
    bars = {"xerr": 2.0 * x["target_se"], "yerr": 2.0 * y["target_se"], "fmt": "x", "color": COLOURS[1]}
    axes.errorbar(x["target"], y["target"], **bars, capsize=2, label="target")
    axes.errorbar(
        x["simulated"], y["simulated"], xerr=2.0 * x["simulated_se"], yerr=2.0 * y["simulated_se"],
        fmt="*", color="black", capsize=2, markersize=9, label="optimum, simulated",
    )  # fmt: skip
    axes.set(xlabel=axis_label(first), ylabel=axis_label(second))


def identifiability_table(table: pd.DataFrame) -> pd.DataFrame:
    """Combinations of the variables, and whether the tests determine them."""
    return pd.DataFrame(
        {
            "case": table["case"],
            "combination": [combination(row) for _, row in table.iterrows()],
            "singular value": [f"{v:.2g}" for v in table["singular_value"]],
            "standard deviation (extents)": [f"{v:.2g}" for v in table["standard_deviation"]],
            "determined": np.where(table["determined"], "yes", "no"),
        }
    )


def narrowing_table(
    posterior: pd.DataFrame, variables: list[str], responses: Responses, asked: Mapping[str, set[str]], config: Mapping
) -> pd.DataFrame:
    """What is left of each variable's standard deviation if a response were measured that a case is not calibrated by."""
    consequences = config["verify"]["difference_of_consequence"]
    rows = []
    for case, samples in posterior.groupby("case", sort=False):
        for name in (name for name in responses if name not in asked[str(case)]):
            known = samples[responses[name].column]
            error = further_error(known, FURTHER_RATIO, consequences[responses[name].column])
            row = {
                "case": spoken(str(case)),
                "measured as well": header(responses[name]),
                "expected": f"{known.mean():.4g} ± {error:.2g}",
            }
            row |= {symbol(v): f"{left_over(samples[v], known, error):.2f}" for v in variables}
            halving = {v: halving_error(samples[v], known) for v in variables}
            rows.append(row | {f"halves {symbol(v)} at": "–" if pd.isna(halving[v]) else f"± {halving[v]:.2g}" for v in variables})
    return pd.DataFrame(rows)


def equivalents_table(equivalents: pd.DataFrame, responses: Responses) -> pd.DataFrame:
    """Sets that serve as well as the best, to pick one from, with their predicted responses; the first of each case."""
    equivalents = equivalents[equivalents["rank"] <= N_SHOWN]
    return pd.DataFrame(
        {
            "case": equivalents["case"].map(spoken),
            "set": equivalents["rank"],
            **{
                header(v): [number(value, v.digits, v.scale) for value in equivalents[name]]
                for name, v in shown_in(equivalents).items()
            },
            **{header(response): [number(value) for value in equivalents[response.column]] for response in responses.values()},
        }
    )


def simulated_table(simulated: pd.DataFrame | None, responses: Responses) -> pd.DataFrame:
    """Equivalent sets beside their simulations; without rows if none was simulated."""
    shown = VARIABLES if simulated is None else shown_in(simulated)
    columns = ["case", "set", *map(header, shown.values()), *(header(response) for response in responses.values()), "targets"]
    if simulated is None:
        return pd.DataFrame(columns=columns)
    rows = []
    for (case, rank), lines in simulated.groupby(["case", "rank"], sort=False):
        first, by_name = lines.iloc[0], lines.set_index("response")
        where = [number(first[name], variable.digits, variable.scale) for name, variable in shown.items()]
        found = [with_error(by_name.loc[name, "simulated"], by_name.loc[name, "simulated_se"]) for name in responses]
        rows.append((spoken(str(case)), rank, *where, *found, spoken(verdict(lines, "match"))))
    return pd.DataFrame(rows, columns=columns)


def coverage_figure(coverage: pd.DataFrame) -> Item:
    """Share of the known soils that regions of every mass hold, for each kind of soil."""
    figure, (axes,) = canvas(width=5.0)
    axes.plot([0, 1], [0, 1], color="0.6", linewidth=1)
    for colour, (kind, levels) in zip(COLOURS, coverage.groupby("kind", sort=False)["credible_level"], strict=False):
        axes.step(
            np.sort(levels), (np.arange(len(levels)) + 1) / len(levels), where="post", color=colour, label=f"{kind} ({len(levels)})"
        )
    axes.set(xlabel="mass of the stated region", ylabel="share of soils whose parameters it holds", xlim=(0, 1), ylim=(0, 1))
    axes.legend(loc="upper left")
    return Item(figure, coverage, "Share of soils of known parameters that the stated regions hold, over the mass of the region")


def coverage_table(coverage: pd.DataFrame) -> pd.DataFrame:
    """Share of the known soils that the regions of three masses hold."""
    rows = [
        (kind, len(levels), *(f"{(levels <= mass).mean():.0%}" for mass in MASSES))
        for kind, levels in coverage.groupby("kind", sort=False)["credible_level"]
    ]
    return pd.DataFrame(rows, columns=["soils", "number", *(f"within the {mass:.0%} region" for mass in MASSES)])


def twin_table(twins: pd.DataFrame | None) -> pd.DataFrame | None:
    """Hidden soils found again; None if there are none."""
    if twins is None or twins.empty:
        return None
    return pd.DataFrame([twin_row(row) for _, row in twins.iterrows()])


def twin_row(row: Mapping) -> dict[str, str]:
    """True and estimated value of one variable of a hidden soil."""
    variable = VARIABLES[row["variable"]]
    truth, optimum, low, high = (number(row[name], 3, variable.scale) for name in ("truth", "optimum", "low_95", "high_95"))
    return {
        "twin": row["twin"],
        "variable": header(variable),
        "truth": truth,
        "optimum": optimum,
        "95 % interval": f"{low} to {high}",
        "truth inside the 95 % region": "yes" if row["inside_95"] else "no",
    }
