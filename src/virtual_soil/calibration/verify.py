"""Verification of the answer: optima beside simulations of them, and two questions with three answers each.

    Does simulation confirm the prediction?        gap = simulated - predicted
    Has the simulated soil the target's value?     difference = simulated - target

The first is "contradicted" and the second "misses" if the value lies beyond NOISE_LIMIT standard errors. Otherwise a test may agree
because it is blunt, so the answer is "not decided" if its standard error exceeds what decides, and "confirmed" or "matches" only
below that. For the prediction half the smallest difference of consequence decides, since an error of that size must show at two
standard errors; for the target the standard error demanded of the simulated mean. The target's own uncertainty cannot be reduced by
simulation: it widens what matches, but leaves nothing undecided.
"""

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from virtual_soil.calibration.noise import NOISE_LIMIT, censoring, error_of_mean, student
from virtual_soil.calibration.points import point_at, point_id
from virtual_soil.calibration.response import Response, Responses
from virtual_soil.calibration.uncertainty import Likelihood, intervals

#: The two questions: column of the answer -> (answer beyond the noise, answer within it).
QUESTIONS = {"prediction": ("contradicted", "confirmed"), "match": ("misses", "matches")}
UNDECIDED, UNSIMULATED = "not decided", "not simulated"
#: Answer to the second question for a response without a weight, or without a target.
UNASKED = "not asked"


def comparison_table(
    responses: Responses,
    calibration: pd.DataFrame,
    models: dict,
    tables: dict,
    by_seed: Mapping[str, pd.DataFrame],
    scatter: Mapping[str, Callable[[dict], np.ndarray]],
    target_errors: Mapping[tuple[str, str], float],
    limits: Mapping[str, Mapping[str, float]],
    spoiled: Mapping[str, int],
    overlaps: Mapping[str, float],
    material: dict,
) -> pd.DataFrame:
    """One row per case and response: target, prediction at the optimum, mean of its simulations, and the two answers.

    Parameters
    ----------
    calibration : optima of the cases, with their weights, or sets that serve as well (`sampled`); a response without a weight is
        not asked to match.
    models : the surrogates that predicted them, by response.
    tables : by name, those of the responses, of simulations at the optima; other points in them do not matter.
    by_seed : by response, a table of its values with point_id and the response's column, a row for each seed of a point.
    scatter : by response, what the campaign knows of its scatter at a point (see `noise.scatter_at`), for optima with fewer than
        three seeds.
    target_errors : by soil and response, the standard uncertainty of a target.
    limits : `difference_of_consequence` and `standard_error`, each by the response's column.
    spoiled, overlaps : by point, number of simulations that failed or did not come to rest, and their largest overlap over the
        radius.
    material : base values.

    Returns
    -------
    simulated_sd is the scatter over seeds, simulated_se the standard error of the mean. A missing value in `simulated` means that
    no simulation there ended well.
    """
    variables = [name for name in material if name in calibration]
    rows = []
    for _, optimum in calibration.iterrows():
        values = {name: float(optimum[name]) for name in variables}
        point, rank = point_id(point_at(material, values)), {"rank": optimum["rank"]} if "rank" in optimum else {}
        for name, response in responses.items():
            predicted, error = (float(v) for v in models[name].predict_with_error(values))
            found = simulated(response, point, tables[response.table], by_seed[name], float(scatter[name](values)[0]))
            target = float(optimum[f"target_{response.column}"]), target_errors.get((optimum["soil"], name), np.nan)
            named = {"case": optimum["case"], "soil": optimum["soil"], **rank, **values, "response": name, "unit": response.unit}
            answers = compared(target, (predicted, error), found, {key: limit[response.column] for key, limit in limits.items()})
            if not optimum[f"weight_{name}"]:
                answers["match"] = UNASKED
            found_there = {"n_spoiled": spoiled.get(point, 0), "max_overlap_ratio": overlaps.get(point, np.nan)}
            rows.append({**named, **answers, **found_there})
    return pd.DataFrame(rows, columns=list(rows[0]) if rows else [])


def sampled(equivalents: pd.DataFrame, calibration: pd.DataFrame, n: int) -> pd.DataFrame:
    """N equivalent sets of every case, farthest from the best first, with the targets and weights of its optimum."""
    asked = [name for name in calibration if name.startswith(("target_", "weight_"))]
    chosen = equivalents[equivalents["rank"].between(2, n + 1)]
    return chosen.merge(calibration[["case", *asked]], on="case")


def compared(
    target: tuple[float, float],
    prediction: tuple[float, float],
    found: tuple[float, float, float, int],
    limits: Mapping[str, float],
) -> dict:
    """Target and prediction, each with its standard error, beside the `simulated` of one response, and the two answers."""
    mean, sd, se, n = found
    gap, gap_se = mean - prediction[0], float(np.hypot(se, prediction[1]))
    difference, difference_se = mean - target[0], float(np.hypot(se, target[1]))
    return {
        "target": target[0],
        "target_se": target[1],
        "predicted": prediction[0],
        "predicted_se": prediction[1],
        "simulated": mean,
        "simulated_sd": sd,
        "simulated_se": se,
        "n_seeds": n,
        "gap": gap,
        "gap_se": gap_se,
        "prediction": answer("prediction", gap, gap_se, gap_se <= 0.5 * limits["difference_of_consequence"]),
        "difference": difference,
        "difference_se": difference_se,
        "match": answer("match", difference, difference_se, se <= limits["standard_error"]),
    }


def answer(question: str, difference: float, error: float, decisive: bool) -> str:
    """Answer to one question; decisive : True if the test is sharp enough that agreement means something."""
    beyond, within = QUESTIONS[question]
    if np.isnan(difference):
        return UNSIMULATED
    if abs(difference) > NOISE_LIMIT * error:
        return beyond
    return within if decisive else UNDECIDED


def simulated(response: Response, point: str, table: pd.DataFrame, by_seed: pd.DataFrame, scatter: float):
    """Mean, standard deviation over seeds, standard error and number of seeds of a response at one point."""
    values = by_seed.loc[by_seed["point_id"] == point, response.column].dropna().to_numpy()
    here = table[table["point_id"] == point]
    mean, sd, se, n = summary(values, error_of_mean(response, here, scatter, len(values)))
    return mean, sd, float(np.hypot(se, censoring(response, here))) if n > 2 else se, n


def summary(values: np.ndarray, known_error: float) -> tuple[float, float, float, int]:
    """Mean, standard deviation, standard error and number of values.

    The error of three values and more is their own, with Student's factor; with fewer it is the known one.
    """
    n = len(values)
    if not n:
        return np.nan, np.nan, np.nan, 0
    sd = float(values.std(ddof=1)) if n > 1 else np.nan
    return float(values.mean()), sd, float(student(n - 1)) * sd / np.sqrt(n) if n > 2 else known_error, n


def undecided(comparison: pd.DataFrame) -> dict[str, list[str]]:
    """Case -> responses of which the simulations at its optimum are too blunt to tell whether they match their targets."""
    open_questions = comparison[comparison["match"] == UNDECIDED]
    return {case: list(names) for case, names in open_questions.groupby("case", sort=False)["response"]}


def conclusion(calibration, posterior, verification, likelihoods: dict[str, Likelihood], processes: dict) -> pd.DataFrame:
    """The optima with their uncertainty and the verdicts of their verification; one row per case.

    Added to each: 95 % intervals of variables and responses; `deviation_sd`, the largest distance of a prediction from its target
    in standard deviations of both, and `missed`, the responses beyond two of them; `extrapolated`, the responses whose simulated
    points do not surround the optimum (processes: the Gaussian processes, which know the points); `prediction` and `match`: see
    `verdict`; `n_spoiled`: simulations of the optimum that failed or did not come to rest; `max_overlap_ratio`: their largest
    overlap.
    """
    rows = []
    for _, optimum in calibration.iterrows():
        likelihood = likelihoods[optimum["case"]]
        variables = likelihood.space.variables
        values = {name: float(optimum[name]) for name in variables}
        columns = [response.column for response in likelihood.responses.values()]
        deviations = likelihood.deviations(values)
        simulated_there = verification[verification["case"] == optimum["case"]]
        rows.append(
            {
                **optimum.to_dict(),
                **intervals(posterior[posterior["case"] == optimum["case"]], [*variables, *likelihood.space.fixed, *columns]),
                "deviation_sd": max(deviations.values()),
                "missed": ",".join(name for name, deviation in deviations.items() if deviation > NOISE_LIMIT),
                "extrapolated": ",".join(name for name, process in processes.items() if not process.surrounds(values)),
                **{question: verdict(simulated_there, question) for question in QUESTIONS},
                "n_spoiled": int(max(simulated_there["n_spoiled"], default=0)),
                "max_overlap_ratio": float(max(simulated_there["max_overlap_ratio"], default=np.nan)),
            }
        )
    return pd.DataFrame(rows)


def verdict(verification: pd.DataFrame, question: str) -> str:
    """Answer of one case: "confirmed" or "matches" if it is that of all responses, else the other answers with their responses.

    Responses that the case does not ask for decide nothing; the table has their answers.
    """
    beyond, within = QUESTIONS[question]
    verification = verification[verification["match"] != UNASKED]
    found = {word: verification.loc[verification[question] == word, "response"] for word in (beyond, UNDECIDED, UNSIMULATED)}
    if len(found[UNSIMULATED]) == len(verification):
        return UNSIMULATED
    return "; ".join(f"{word}: {', '.join(names)}" for word, names in found.items() if len(names)) or within
