"""Does the virtual soil do what the surrogates say: optima beside simulations of them."""

import numpy as np
import pandas as pd

from virtual_soil.calibration.mohr_coulomb import lines
from virtual_soil.calibration.noise import line_errors
from virtual_soil.calibration.points import point_at, point_id
from virtual_soil.calibration.surrogate import RESPONSES
from virtual_soil.calibration.uncertainty import Likelihood, intervals

#: Two numbers agree when they differ by no more than this many standard errors of their difference.
NOISE_LIMIT = 2.0


def comparison_table(calibration, models, tables: dict, material: dict, shear: dict, scatter: dict) -> pd.DataFrame:
    """One row per case and response: target, prediction at the optimum, mean of its simulations, and their gap.

    Parameters
    ----------
    calibration : optima of the cases. models : the surrogates that predicted them, by response.
    tables : "repose", "shear", "strength" of simulations at the optima; others in them do not matter.
    material : base values. shear : strength and normal_stress that make a strength line.
    scatter : of the campaign, for optima with too few seeds to tell. heap: standard deviation of an angle of repose over seeds
    (deg); line: relative scatter of strengths about their lines.

    Returns
    -------
    simulated_sd is the scatter over seeds (each with its own strength line), simulated_se the standard error of the mean. A missing
    value in `simulated` says that no simulation there ended well; such a row does not agree.
    """
    variables = [name for name in material if name in calibration]
    rows = []
    for _, optimum in calibration.iterrows():
        values = {name: float(optimum[name]) for name in variables}
        point = point_id(point_at(material, values))
        found = simulated(point, tables, shear, scatter)
        for name, (column, unit) in RESPONSES.items():
            predicted, error = (float(v) for v in models[name].predict_with_error(values))
            mean, sd, se, n = found[name]
            gap, gap_se = mean - predicted, float(np.hypot(se, error))
            rows.append(
                {
                    "case": optimum["case"],
                    "soil": optimum["soil"],
                    **values,
                    "response": name,
                    "unit": unit,
                    "target": float(optimum[f"target_{column}"]),
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


def simulated(point: str, tables: dict, shear: dict, scatter: dict) -> dict[str, tuple[float, float, float, int]]:
    """Mean, standard deviation over seeds, standard error and number of seeds of every response at one point."""
    repose, strength = (tables[name][tables[name]["point_id"] == point] for name in ("repose", "strength"))
    heaps = repose["angle_of_repose_deg"].dropna()
    result = {"angle_of_repose": summary(heaps.to_numpy(), scatter["heap"] / np.sqrt(max(len(heaps), 1)))}
    runs = tables["shear"][tables["shear"]["point_id"] == point]
    by_seed = [line for _, line in lines(runs, ["seed"], shear["strength"], shear["normal_stress"])]
    for name, column, error in (
        ("cohesion", "cohesion_pa", "cohesion_se_pa"),
        ("friction_angle", "friction_angle_deg", "friction_angle_se_deg"),
    ):
        line_error = float(line_errors(strength, error, scatter["line"])[0]) if len(strength) else np.nan
        result[name] = summary(np.array([getattr(line, column) for line in by_seed], float), line_error)
    return result


def summary(values: np.ndarray, known_error: float) -> tuple[float, float, float, int]:
    """Mean, standard deviation, standard error and number of values; of fewer than three the error is the one that is known."""
    n = len(values)
    if not n:
        return np.nan, np.nan, np.nan, 0
    sd = float(values.std(ddof=1)) if n > 1 else np.nan
    return float(values.mean()), sd, sd / np.sqrt(n) if n > 2 else known_error, n


def conclusion(calibration, posterior, verification, likelihoods: dict[str, Likelihood], processes: dict) -> pd.DataFrame:
    """The optima with everything that says how far to trust them; one row per case.

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
        columns = [column for column, _ in RESPONSES.values()]
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
