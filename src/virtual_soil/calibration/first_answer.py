"""A first answer without any simulation: a soil calibrated on a campaign that others have run.

The surrogates, the search, the posterior and the intervals are those of a campaign of one's own; only the simulations are not. What
that costs is not known before a campaign at one's own settings has verified the optimum: the answer says so in every row.
"""

import numpy as np
import pandas as pd

from virtual_soil.calibration.checks import reachability_table
from virtual_soil.calibration.models import space_of
from virtual_soil.calibration.optimise import calibrate
from virtual_soil.calibration.surrogate import RESPONSES
from virtual_soil.calibration.uncertainty import likelihood_of, posterior_table, sample
from virtual_soil.calibration.verify import conclusion

#: How much each response and the radius weigh where a study names no case of the soil.
EQUAL_WEIGHTS = (0.25, 0.25, 0.25, 0.25)
BASIS = "surrogates of the reference tables; to be confirmed by a campaign at one's own settings"


def cases_of(soil: str, cases: list[dict]) -> list[dict]:
    """A study's cases of a soil; one with equal weights and the soil's name where it has none."""
    return [case for case in cases if case["soil"] == soil] or [{"case": soil, "soil": soil, "weights": list(EQUAL_WEIGHTS)}]


def first_answer(models: dict, processes: dict, tables: dict, soils: pd.DataFrame, settings: dict):
    """Calibrate one soil on another campaign's surrogates.

    Parameters
    ----------
    models, processes : by response, that campaign's chosen surrogates and Gaussian processes (see `calibration.from_json`).
    tables : its "repose" and "strength". soils : the soil table of one soil.
    settings : its "design"; the "cases" to solve, "optimise" and "uncertainty" of one's own study.

    Returns
    -------
    (a table as of `calibration.conclusion`, `verified` being "not simulated", with `out_of_reach` and `basis`; the reachability
    table)
    """
    design, ratio = settings["design"], settings["uncertainty"]["target_uncertainty_ratio"]
    space, variables = space_of(design), design["variables"]
    reach = reachability_table(models, space, tables["repose"], tables["strength"], soils, ratio)
    optima, _, _ = calibrate(models, soils, {**settings["optimise"], "cases": settings["cases"]}, variables, "ours")
    likelihoods = {case["case"]: likelihood_of(case, models, soils, space, ratio) for case in settings["cases"]}
    n_samples = settings["uncertainty"]["n_samples"]
    samples = [
        posterior_table(case, likelihoods[case["case"]], *sample(likelihoods[case["case"]], n_samples))
        for case in settings["cases"]
    ]
    unverified = pd.DataFrame({"case": [], "simulated": []})
    table = conclusion(optima, pd.concat(samples, ignore_index=True), unverified, likelihoods, processes)
    return table.assign(out_of_reach=",".join(reach.loc[~reach["reachable"], "response"]), basis=BASIS), reach


def first_answer_text(table: pd.DataFrame, reach: pd.DataFrame, soils: pd.DataFrame, design: dict, material: dict) -> str:
    """The answer in a few lines; material: the reference campaign's, of which the design's variables are replaced by the answer."""
    soil = table["soil"].iloc[0]
    lines = [
        f"First answer for {soil}, from the reference tables in docs/reference.",
        "No simulation was run for it. A campaign at your own settings has to confirm it.",
        "",
        "The soil:",
    ]
    for _, row in soils.iterrows():
        error = row["standard_uncertainty"]
        stated = f" +- {error:.3g}" if np.isfinite(error) else ""
        lines.append(f"  {row['property']:<18}{row['value']:>8.4g}{stated} {row['unit']}   {row['method']}; {row['source']}")
    lines += ["", "Can such grains behave like it?"]
    for _, row in reach.iterrows():
        ends = f"the design reaches {row['lowest_predicted']:.3g} to {row['highest_predicted']:.3g} {RESPONSES[row['response']][1]}"
        nearer = f"; nearer with {row['grows_with']}" if row["grows_with"] else ""
        verdict = "yes" if row["reachable"] else f"NO, nearest {row['nearest_reachable']:.3g}{nearer}"
        lines.append(f"  {row['response']:<18}{verdict} ({ends})")
    for _, row in table.iterrows():
        lines += ["", f"Case {row['case']}: optimum, 95 % interval"]
        for name in design["variables"]:
            lines.append(f"  {name:<22}{row[name]:>10.4g}   {row[f'{name}_low_95']:.3g} to {row[f'{name}_high_95']:.3g}")
        lines.append(f"{'predicted there, 95 % interval, wanted':>45}")
        for column, _ in RESPONSES.values():
            interval = f"{row[f'{column}_low_95']:.3g} to {row[f'{column}_high_95']:.3g}"
            lines.append(f"  {column:<22}{row[column]:>10.4g}   {interval:<18} {row[f'target_{column}']:.4g}")
        for what, said in (("missed by more than two standard deviations", "missed"), ("extrapolated", "extrapolated")):
            if row[said]:
                lines.append(f"  {what}: {row[said].replace(',', ', ')}")
    held = ", ".join(f"{name} = {value:g}" for name, value in material.items() if name not in design["variables"])
    lines += [
        "",
        f"Held at the reference's values: {held}.",
        "The optimum minimises the weighted errors and prefers large grains; the interval holds what is consistent with the soil.",
        "An optimum outside its interval, or an interval as wide as the design, says that the tests do not determine it.",
    ]
    return "\n".join(lines) + "\n"
