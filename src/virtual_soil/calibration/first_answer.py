"""A first answer without any simulation: a soil calibrated on a reference campaign.

Search, posterior and intervals are those of a study; only the simulations are the reference's. The resulting error is unknown until
a campaign at the study's settings has verified the optimum: every row of the answer says so.
"""

from collections.abc import Collection, Iterable

import numpy as np
import pandas as pd

from virtual_soil.calibration.checks import reachability_table
from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.optimise import LARGE_GRAINS, RADIUS, calibrate, cases_about
from virtual_soil.calibration.response import Responses
from virtual_soil.calibration.scaling import Scaling
from virtual_soil.calibration.space import space_of
from virtual_soil.calibration.uncertainty import likelihood_of, posterior_table, sample
from virtual_soil.calibration.verify import QUESTIONS, conclusion

BASIS = "surrogates of the reference tables; to be confirmed by a campaign at one's own settings"


def cases_of(soils: pd.DataFrame, cases: list[dict], responses: Responses) -> list[dict]:
    """A study's cases of a soil; if it has none, one with equal weights and the soil's name.

    soils : the soil table of one soil. Raises CalibrationError if it has a target for none of the responses.
    """
    soil, targets = soils["soil"].iloc[0], set(soils["property"])
    known = {name: response for name, response in responses.items() if name in targets}
    demand(bool(known), f"targets of {soil}", sorted(targets), f"at least one of {', '.join(responses)}")
    equal = {"case": soil, "soil": soil, "weights": dict.fromkeys(known, 1.0)}
    return cases_about(known, [case for case in cases if case["soil"] == soil]) or [equal]


def first_answer(responses: Responses, models: dict, processes: dict, tables: dict, soils: pd.DataFrame, settings: dict):
    """Calibrate one soil on another campaign's surrogates.

    Parameters
    ----------
    models, processes : by response, that campaign's chosen surrogates and Gaussian processes (see `calibration.from_json`).
    tables : its tables of the responses, by name. soils : the soil table of one soil.
    settings : the campaign's "design"; the "cases" to solve, "optimise" and "uncertainty" of the study, and the "scale" of its
    objectives (see `calibrate`). For another test than the campaign's, models, processes and design are those of
    `scaling.Scaling`.

    Returns
    -------
    (a table as of `calibration.conclusion`, the verdicts being "not simulated", with `out_of_reach` and `basis`; the reachability
    table)
    """
    design, ratio = settings["design"], settings["uncertainty"]["target_uncertainty_ratio"]
    space, variables = space_of(design), design["variables"]
    reach = reachability_table(responses, models, space, tables, soils, ratio)
    options = {**settings["optimise"], "cases": settings["cases"]}
    optima, _, _ = calibrate(responses, models, soils, options, variables, "ours", settings["scale"])
    likelihoods = {case["case"]: likelihood_of(case, responses, models, soils, space, ratio) for case in settings["cases"]}
    n_samples = settings["uncertainty"]["n_samples"]
    samples = [
        posterior_table(case, likelihoods[case["case"]], *sample(likelihoods[case["case"]], n_samples))
        for case in settings["cases"]
    ]
    unverified = pd.DataFrame(columns=["case", "response", *QUESTIONS, "n_spoiled", "max_overlap_ratio"])
    table = conclusion(optima, pd.concat(samples, ignore_index=True), unverified, likelihoods, processes)
    table = table.assign(**design.get("fixed", {}))
    return table.assign(out_of_reach=",".join(reach.loc[~reach["reachable"], "response"]), basis=BASIS), reach


def first_answer_text(
    responses: Responses,
    table: pd.DataFrame,
    reach: pd.DataFrame,
    soils: pd.DataFrame,
    design: dict,
    material: dict,
    strengths: dict[str, str],
    scaling: Scaling,
) -> str:
    """The answer in a few lines.

    material : the reference campaign's, whose design variables the answer replaces. strengths : response -> which strength the
    reference measured, empty if none. scaling : the test in terms of the reference's.
    """
    lines = [
        f"First answer for {table['soil'].iloc[0]}, from the reference tables in docs/reference.",
        "No simulation was run for it. A campaign at your own settings has to confirm it.",
        "",
        "The soil:",
        *soil_lines(soils, strengths),
        *conditions(scaling, responses),
        "",
        "Can such grains behave like it?",
        *reach_lines(reach, responses),
        *(line for _, row in table.iterrows() for line in case_lines(row, design["variables"], responses)),
        "",
        *closing_lines(table, design["variables"], material, scaling),
    ]
    return "\n".join(lines) + "\n"


def soil_lines(soils: pd.DataFrame, strengths: dict[str, str]) -> list[str]:
    """The soil's properties, and which of its strengths are not the reference's."""
    lines = []
    for _, row in soils.iterrows():
        error = row["standard_uncertainty"]
        stated = f" +- {error:.3g}" if np.isfinite(error) else ""
        lines.append(f"  {row['property']:<22}{row['value']:>8.4g}{stated} {row['unit']}   {row['method']}; {row['source']}")
    for _, row in soils.iterrows():
        stated, measured = row["strength"], strengths.get(row["property"], "")
        if stated and measured and stated != measured:
            lines.append(f"  {row['property']}: a {stated} strength of the soil, beside the {measured} strength of the reference")
    return lines


def reach_lines(reach: pd.DataFrame, responses: Responses) -> list[str]:
    """Whether the design reaches the targets."""
    lines = []
    for _, row in reach.iterrows():
        unit = responses[row["response"]].unit
        ends = f"the design reaches {row['lowest_predicted']:.3g} to {row['highest_predicted']:.3g} {unit}"
        nearer = f"; nearer with {row['grows_with']}" if row["grows_with"] else ""
        verdict = "yes" if row["reachable"] else f"NO, nearest {row['nearest_reachable']:.3g}{nearer}"
        lines.append(f"  {row['response']:<22}{verdict} ({ends})")
    return lines


def case_lines(row: pd.Series, variables: Iterable[str], responses: Responses) -> list[str]:
    """Optimum of a case, what is predicted there, and what it misses."""
    lines = ["", f"Case {row['case']}: optimum, 95 % interval"]
    for name in variables:
        lines.append(f"  {name:<26}{row[name]:>10.4g}   {row[f'{name}_low_95']:.3g} to {row[f'{name}_high_95']:.3g}")
    lines.append(f"{'predicted there, 95 % interval, wanted':>49}")
    for column in (response.column for response in responses.values()):
        interval = f"{row[f'{column}_low_95']:.3g} to {row[f'{column}_high_95']:.3g}"
        wanted = row[f"target_{column}"]
        asked = f"{wanted:.4g}" if np.isfinite(wanted) else "-"
        lines.append(f"  {column:<26}{row[column]:>10.4g}   {interval:<18} {asked}")
    for what, said in (("missed by more than two standard deviations", "missed"), ("extrapolated", "extrapolated")):
        if row[said]:
            lines.append(f"  {what}: {row[said].replace(',', ', ')}")
    return lines


def closing_lines(table: pd.DataFrame, variables: Collection[str], material: dict, scaling: Scaling) -> list[str]:
    """What was held, and how to read the optima."""
    prefers = RADIUS in variables and (table[f"weight_{LARGE_GRAINS}"] > 0).any()
    preference = " and prefers large grains" if prefers else ""
    held = ", ".join(f"{name} = {value:g}" for name, value in material.items() if name not in variables)
    return [
        f"Held at the reference's values{'' if scaling.its_own else ', but for what was asked for'}: {held}.",
        f"The optimum minimises the weighted errors{preference}; the interval holds what is consistent with the soil.",
        "An optimum outside its interval, or an interval as wide as the design, says that the tests do not determine it.",
    ]


def conditions(scaling: Scaling, responses: Responses) -> list[str]:
    """The test that the answer is for, if it is not the reference's, and the errors that the scaling adds."""
    if scaling.known:
        return []
    test = scaling.test
    added = {name: scaling.error(response) for name, response in responses.items()}
    errors = ", ".join(f"{name} +- {error:.2g} {responses[name].unit}" for name, error in added.items() if error)
    like = (
        "The reference has no heap lifted as slowly, for its size and gravity; its slowest stand for it: extrapolated."
        if scaling.slow
        else f"At the same lift speed over sqrt(gravity x radius) the reference's grains have {scaling.ratio:.4g} times the radius."
    )
    return [
        "",
        f"The test: a tube lifted at {test['lift_speed_m_s']:.4g} m/s under {test['gravity_m_s2']:.4g} m/s2.",
        like,
        f"Errors added for it (docs/scaling.md): {errors}.",
    ]
