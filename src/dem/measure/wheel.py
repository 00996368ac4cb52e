"""What a wheel does in the steady stretch of its travel: drawbar pull, torque, sinkage, load, their ratios; and its rut."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dem.html import Rich
from dem.measure.blocks import block_means, mean_and_error, ratio_and_error

#: Share of the travel, its last, over which means are taken.
STEADY_SHARE = 0.4


@dataclass(frozen=True, kw_only=True)
class Steady(Rich):
    """Means over the steady stretch, each with its standard error from block averages.

    load_n: what the soil carries. traction_coefficient: T / (W R). efficiency: F v / (T w); of a wheel that pulls nothing, or is
    not driven, it has no meaning. slip: of the travelled distance (of a free wheel a result). power_balance_w: T w - F v, which is
    dissipated and cannot be negative in the mean. sinkage_drift_m: last less first block: large against the error, the stretch is
    not steady. n_samples: of the stretch.
    """

    drawbar_pull_n: float
    drawbar_pull_error_n: float
    torque_n_m: float
    torque_error_n_m: float
    sinkage_m: float
    sinkage_error_m: float
    load_n: float
    load_error_n: float
    drawbar_ratio: float
    drawbar_ratio_error: float
    traction_coefficient: float
    traction_coefficient_error: float
    efficiency: float
    efficiency_error: float
    slip: float
    slip_error: float
    power_balance_w: float
    power_balance_error_w: float
    sinkage_drift_m: float
    n_samples: int


def slip_of(speed_m_s, rim_speed_m_s):
    """Slip of a speed and a rim's speed, both forwards: 1 - v / u where driven (u >= v), u / v - 1 where skidding."""
    v, u = np.asarray(speed_m_s, float), np.asarray(rim_speed_m_s, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(u >= v, 1.0 - v / u, u / v - 1.0)


def steady_samples(time_s: np.ndarray, share: float = STEADY_SHARE) -> np.ndarray:
    """True for the samples (n,) in the last share of the travel; raises ValueError if the wheel did not travel."""
    last = float(time_s[-1]) if len(time_s) else 0.0
    if last <= 0.0:
        raise ValueError("travel of the wheel is 0 s; allowed: a run that went on after the wheel was lowered.")
    return time_s > (1.0 - share) * last * (1.0 + 1e-12)


def steady(history: Mapping[str, np.ndarray], radius_m: float, share: float = STEADY_SHARE) -> Steady:
    """Means over the last share of the travel.

    Parameters
    ----------
    history : columns of `dem.experiments.wheel.WheelRun`; time_s is negative before the travel.
    radius_m : of the rim.

    Raises
    ------
    ValueError : the wheel did not travel, or the stretch has fewer samples than blocks.
    """
    columns = {name: np.asarray(values, float) for name, values in history.items()}
    stretch = steady_samples(columns["time_s"], share)
    force, torque, sinkage, load, speed, rate = (
        columns[name][stretch]
        for name in ("drawbar_pull_n", "torque_n_m", "sinkage_m", "vertical_force_n", "speed_m_s", "rim_rate_rad_s")
    )
    slips = mean_and_error(slip_of(block_means(speed), radius_m * block_means(rate)))
    pairs = {
        "drawbar_pull_n": mean_and_error(force),
        "torque_n_m": mean_and_error(torque),
        "sinkage_m": mean_and_error(sinkage),
        "load_n": mean_and_error(load),
        "drawbar_ratio": ratio_and_error(force, load),
        "traction_coefficient": ratio_and_error(torque, load * radius_m),
        "efficiency": ratio_and_error(force * speed, torque * rate),
        "slip": slips,
        "power_balance_w": mean_and_error(torque * rate - force * speed),
    }
    values = {name: value for name, (value, _) in pairs.items()}
    errors = {error_name(name): error for name, (_, error) in pairs.items()}
    blocks = block_means(sinkage)
    return Steady(**values, **errors, sinkage_drift_m=float(blocks[-1] - blocks[0]), n_samples=int(stretch.sum()))


def error_name(name: str) -> str:
    """Name of the standard error of a quantity: `error` comes before its unit."""
    for unit in ("_n_m", "_n", "_m", "_w"):
        if name.endswith(unit):
            return f"{name.removesuffix(unit)}_error{unit}"
    return f"{name}_error"


def rut(before: np.ndarray, after: np.ndarray, columns: slice | np.ndarray = slice(None)) -> tuple[np.ndarray, np.ndarray]:
    """Mean change of height in m across the track (m,), and its standard deviation along the track (m,).

    before, after : maps (n, m) of `dem.experiments.surface.height_map`, of one shape. columns : cells along x that count, as
    those behind the wheel.
    """
    change = (np.asarray(after) - np.asarray(before))[columns]
    return np.nanmean(change, axis=0), np.nanstd(change, axis=0)
