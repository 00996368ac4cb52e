"""Verification of the answer: optima beside simulations of them."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from virtual_soil.calibration.noise import NOISE_LIMIT, error_of_mean
from virtual_soil.calibration.points import point_at, point_id
from virtual_soil.calibration.response import Response, Responses
from virtual_soil.calibration.uncertainty import Likelihood, intervals


def comparison_table(
    responses: Responses,
    calibration: pd.DataFrame,
    models: dict,
    tables: dict,
    by_seed: Mapping[str, pd.DataFrame],
    scatter: Mapping[str, float],
    material: dict,
) -> pd.DataFrame:
    """One row per case and response: target, prediction at the optimum, mean of its simulations, and their gap.

    Parameters
    ----------
    calibration : optima of the cases. models : the surrogates that predicted them, by response.
    tables : by name, those of the responses, of simulations at the optima; other points in them do not matter.
    by_seed : by response, a table of its values with point_id and the response's column, a row for each seed of a point.
    scatter : by response, the campaign's scatter (see `noise.known_scatter`), for optima with fewer than three seeds.
    material : base values.

    Returns
    -------
    simulated_sd is the scatter over seeds, simulated_se the standard error of the mean. A missing value in `simulated` means that
    no simulation there ended well; such a row does not agree.
    """
    variables = [name for name in material if name in calibration]
    rows = []
    for _, optimum in calibration.iterrows():
        values = {name: float(optimum[name]) for name in variables}
        point = point_id(point_at(material, values))
        for name, response in responses.items():
            predicted, error = (float(v) for v in models[name].predict_with_error(values))
            mean, sd, se, n = simulated(response, point, tables[response.table], by_seed[name], scatter[name])
            gap, gap_se = mean - predicted, float(np.hypot(se, error))
            rows.append(
                {
                    "case": optimum["case"],
                    "soil": optimum["soil"],
                    **values,
                    "response": name,
                    "unit": response.unit,
                    "target": float(optimum[f"target_{response.column}"]),
                    "predicted": predicted,
                    "predicted_se": error,
                    "simulated": mean,
                    "simulated_sd": sd,
                    "simulated_se": se,
                    "n_seeds": n,
                    "gap": gap,
                    "gap_se": gap_se,
                    "agrees": bool(abs(gap) <= NOISE_LIMIT * gap_se),
                }
            )
    return pd.DataFrame(rows, columns=list(rows[0]) if rows else [])


def simulated(response: Response, point: str, table: pd.DataFrame, by_seed: pd.DataFrame, scatter: float):
    """Mean, standard deviation over seeds, standard error and number of seeds of a response at one point."""
    values = by_seed.loc[by_seed["point_id"] == point, response.column].dropna().to_numpy()
    return summary(values, error_of_mean(response, table[table["point_id"] == point], scatter, len(values)))


def summary(values: np.ndarray, known_error: float) -> tuple[float, float, float, int]:
    """Mean, standard deviation, standard error and number of values; with fewer than three the error is the known one."""
    n = len(values)
    if not n:
        return np.nan, np.nan, np.nan, 0
    sd = float(values.std(ddof=1)) if n > 1 else np.nan
    return float(values.mean()), sd, sd / np.sqrt(n) if n > 2 else known_error, n


def conclusion(calibration, posterior, verification, likelihoods: dict[str, Likelihood], processes: dict) -> pd.DataFrame:
    """The optima with their uncertainty and the verdict of their verification; one row per case.

    Added to each: 95 % intervals of variables and responses; `deviation_sd`, the largest distance of a prediction from its target
    in standard deviations of both, and `missed`, the responses beyond two of them; `extrapolated`, the responses whose simulated
    points do not surround the optimum (processes: the Gaussian processes, which know the points); `verified`: "agrees", or
    "differs" and "not simulated" with the responses concerned.
    """
    rows = []
    for _, optimum in calibration.iterrows():
        likelihood = likelihoods[optimum["case"]]
        variables = likelihood.space.variables
        values = {name: float(optimum[name]) for name in variables}
        columns = [response.column for response in likelihood.responses.values()]
        deviations = likelihood.deviations(values)
        rows.append(
            {
                **optimum.to_dict(),
                **intervals(posterior[posterior["case"] == optimum["case"]], [*variables, *columns]),
                "deviation_sd": max(deviations.values()),
                "missed": ",".join(name for name, deviation in deviations.items() if deviation > NOISE_LIMIT),
                "extrapolated": ",".join(name for name, process in processes.items() if not process.surrounds(values)),
                "verified": verdict(verification[verification["case"] == optimum["case"]]),
            }
        )
    return pd.DataFrame(rows)


def verdict(verification: pd.DataFrame) -> str:
    """One case's verification in a few words."""
    if verification.empty or verification["simulated"].isna().all():
        return "not simulated"
    unknown = verification["simulated"].isna()
    parts = {"differs": verification.loc[~verification["agrees"] & ~unknown], "not simulated": verification.loc[unknown]}
    return "; ".join(f"{word}: {', '.join(rows['response'])}" for word, rows in parts.items() if len(rows)) or "agrees"
