"""Checks on a campaign: what the acceleration costs in accuracy, and whether the targets can be reached at all."""

import numpy as np
import pandas as pd

from calibration.surrogate import RESPONSES

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


def pooled_scatter(runs: pd.DataFrame, quantity: str) -> float:
    """Standard deviation over seeds, pooled over points and fidelities; NaN without repeats."""
    groups = [group.to_numpy() for _, group in runs.groupby(["point_id", "fidelity"])[quantity]]
    freedom = sum(len(group) - 1 for group in groups)
    if not freedom:
        return float("nan")
    return float(np.sqrt(sum(((group - group.mean()) ** 2).sum() for group in groups) / freedom))


def reachability_table(repose: pd.DataFrame, strength: pd.DataFrame, soils: pd.DataFrame) -> pd.DataFrame:
    """Every target beside the range of its simulated response, and the nearest value inside that range."""
    rows = []
    for _, target in soils.iterrows():
        column = RESPONSES[target["property"]][0]
        source = repose if target["property"] == "angle_of_repose" else strength
        simulated = source.loc[source["fidelity"] == "campaign", column].dropna()
        low, high = float(simulated.min()), float(simulated.max())
        rows.append(
            {
                "soil": target["soil"],
                "response": target["property"],
                "target": target["value"],
                "lowest_simulated": low,
                "highest_simulated": high,
                "reachable": bool(low <= target["value"] <= high),
                "nearest_reachable": float(np.clip(target["value"], low, high)),
            }
        )
    return pd.DataFrame(rows)
