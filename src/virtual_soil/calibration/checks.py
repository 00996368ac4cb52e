"""Checks on a campaign: the error of the accelerated fidelity, and whether the design reaches the targets."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from virtual_soil.calibration.noise import NOISE_LIMIT, pooled_scatter, target_uncertainty
from virtual_soil.calibration.response import Responses
from virtual_soil.calibration.space import REACH, Space

ACCELERATION = [
    "experiment",
    "quantity",
    "static_friction",
    "rolling_friction",
    "campaign_mean",
    "campaign_sd",
    "campaign_n",
    "reference_mean",
    "reference_sd",
    "reference_n",
    "bias",
    "bias_se",
    "exceeds_noise",
    "campaign_wall_time_s",
    "reference_wall_time_s",
]


class FidelityCheck(NamedTuple):
    """A quantity to compare between fidelities: its experiment, the table of runs that holds it, its column.

    load : column of the load that a run is made at, if it has one; loads without a reference simulation do not count.
    """

    experiment: str
    table: pd.DataFrame
    quantity: str
    load: str | None = None


def acceleration_table(compared: list[FidelityCheck]) -> pd.DataFrame:
    """Accelerated and reference simulations of the check points: means, bias, its standard error from the scatter over seeds.

    The scatter is pooled over all points and both fidelities of an experiment. Empty where a study has no check points.
    """
    return pd.DataFrame([row for check in compared for row in biases(*check)], columns=ACCELERATION)


def biases(experiment: str, table: pd.DataFrame, quantity: str, load: str | None) -> list[dict]:
    """One row per check point of one experiment."""
    good = table[table[quantity].notna() & (table["status"] != "failed")]
    reference = good[good["fidelity"] == "reference"]
    relevant = good[good["point_id"].isin(reference["point_id"])]
    if load is not None:
        relevant = relevant[relevant[load].isin(reference[load])]
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


def reachability_table(responses: Responses, models: dict, space: Space, tables: dict, soils: pd.DataFrame, ratio: float):
    """Every target beside the range of its response over the design, before anything is optimised.

    A target is reachable if it lies between the surrogate's lowest and highest value, or beyond them by no more than two of its own
    standard uncertainties (`ratio` of its value where the soil states none). `grows_with` is the direction in which to extend the
    design for an unreachable target: the variables whose increase (+) or decrease (-) brings the response nearer to it, strongest
    first. Targets of other responses than these are left out.
    """
    unit = space.everywhere(REACH)
    rows = []
    for _, target in soils[soils["property"].isin(responses)].iterrows():
        name = target["property"]
        mean = models[name].predict(space.values(unit))
        if not responses[name].signed:
            mean = np.maximum(mean, 0.0)  # a surrogate may go below zero, a soil cannot
        source = tables[responses[name].table]
        simulated = source.loc[source["fidelity"] == "campaign", responses[name].column].dropna()
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
