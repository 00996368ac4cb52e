"""Checks on a campaign: what the acceleration costs in accuracy, and whether the targets can be reached at all."""

import numpy as np
import pandas as pd

from virtual_soil.calibration.noise import pooled_scatter
from virtual_soil.calibration.space import REACH, Space
from virtual_soil.calibration.surrogate import RESPONSES
from virtual_soil.calibration.uncertainty import target_uncertainty

NOISE_LIMIT = 2.0


def acceleration_table(repose: pd.DataFrame, shear: pd.DataFrame) -> pd.DataFrame:
    """Accelerated against reference simulations of the check points: means, bias, its standard error from the seeds' scatter.

    The scatter is pooled over all points and both fidelities of an experiment. Empty where a study has no check points.
    """
    shear = shear.assign(shear_stress_ratio=shear["plateau_shear_stress_pa"] / shear["plane_normal_stress_pa"])
    rows = [*compared(repose, "repose", "angle_of_repose_deg"), *compared(shear, "shear", "shear_stress_ratio")]
    columns = [
        "experiment", "quantity", "static_friction", "rolling_friction", "campaign_mean", "campaign_sd", "campaign_n",
        "reference_mean", "reference_sd", "reference_n", "bias", "bias_se", "exceeds_noise", "campaign_wall_time_s",
        "reference_wall_time_s",
    ]  # fmt: skip
    return pd.DataFrame(rows, columns=columns)


def compared(table: pd.DataFrame, experiment: str, quantity: str) -> list[dict]:
    """One row per check point of one experiment."""
    good = table[table[quantity].notna() & (table["status"] != "failed")]
    reference = good[good["fidelity"] == "reference"]
    relevant = good[good["point_id"].isin(reference["point_id"])]
    if experiment == "shear":
        relevant = relevant[relevant["normal_stress_pa"].isin(reference["normal_stress_pa"])]
    pooled = pooled_scatter(relevant, quantity)
    rows = []
    for _, point in relevant.groupby("point_id", sort=False):
        fast, slow = (point[point["fidelity"] == fidelity] for fidelity in ("campaign", "reference"))
        if fast.empty or slow.empty:
            continue
        bias = fast[quantity].mean() - slow[quantity].mean()
        error = pooled * np.sqrt(1.0 / len(fast) + 1.0 / len(slow))
        rows.append(
            {
                "experiment": experiment,
                "quantity": quantity,
                "static_friction": point["static_friction"].iloc[0],
                "rolling_friction": point["rolling_friction"].iloc[0],
                **described("campaign", fast, quantity),
                **described("reference", slow, quantity),
                "bias": float(bias),
                "bias_se": float(error),
                "exceeds_noise": bool(abs(bias) > NOISE_LIMIT * error),
                "campaign_wall_time_s": float(fast["wall_time_s"].mean()),
                "reference_wall_time_s": float(slow["wall_time_s"].mean()),
            }
        )
    return rows


def described(fidelity: str, runs: pd.DataFrame, quantity: str) -> dict:
    """Mean, standard deviation and number of runs, with the fidelity in the keys."""
    return {
        f"{fidelity}_mean": float(runs[quantity].mean()),
        f"{fidelity}_sd": float(runs[quantity].std()),
        f"{fidelity}_n": len(runs),
    }


def reachability_table(models: dict, space: Space, repose: pd.DataFrame, strength: pd.DataFrame, soils: pd.DataFrame, ratio: float):
    """Every target beside the range of its response over the design, before anything is optimised.

    A target is reachable if it lies between the surrogate's lowest and highest value, or no further beyond them than two of its own
    standard uncertainties (`ratio` of its value where the soil states none). `grows_with` says in which direction to extend the
    design for a target beyond that: the variables by whose increase (+) or decrease (-) the response comes nearer to it, strongest
    first.
    """
    unit = space.everywhere(REACH)
    rows = []
    for _, target in soils.iterrows():
        name = target["property"]
        mean = models[name].predict(space.values(unit))
        source = repose if name == "angle_of_repose" else strength
        simulated = source.loc[source["fidelity"] == "campaign", RESPONSES[name][0]].dropna()
        nearest = int(np.argmin(np.abs(mean - target["value"])))
        bound = float(np.clip(target["value"], mean.min(), mean.max()))
        reachable = abs(bound - target["value"]) <= NOISE_LIMIT * target_uncertainty(target, ratio)
        rows.append(
            {
                "soil": target["soil"],
                "response": name,
                "target": target["value"],
                "lowest_simulated": float(simulated.min()),
                "highest_simulated": float(simulated.max()),
                "lowest_predicted": float(mean.min()),
                "highest_predicted": float(mean.max()),
                "reachable": bool(reachable),
                "nearest_reachable": bound,
                "grows_with": "" if reachable else direction(models[name], space, unit[nearest], target["value"] > mean[nearest]),
            }
        )
    return pd.DataFrame(rows)


def direction(model, space: Space, unit: np.ndarray, upwards: bool) -> str:
    """Variables, strongest first, with the sign of the change that raises (or lowers) a response at coordinates (n,)."""
    h = 0.05
    ends = np.clip(unit + h * np.vstack([np.eye(len(unit)), -np.eye(len(unit))]), 0.0, 1.0)
    values = model.predict(space.values(ends))
    slopes = (values[: len(unit)] - values[len(unit) :]) / (ends[: len(unit)] - ends[len(unit) :]).sum(axis=1)
    slopes = slopes if upwards else -slopes
    order = [k for k in np.argsort(-np.abs(slopes)) if abs(slopes[k]) > 0.05 * np.abs(slopes).max()]
    return ", ".join(f"{'+' if slopes[k] > 0 else '-'}{space.variables[k]}" for k in order)
