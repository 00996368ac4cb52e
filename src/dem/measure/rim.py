"""Stresses along a wheel's rim, from the loads of single grains on it.

theta is the angle from the lowest point of the rim, positive forwards. sigma points to the axle, tau forwards at the lowest point:
it resists a driven wheel. Then (Wong & Reece 1967, J. Terramech. 4(1), 81)

    F_x = R b int (tau cos theta - sigma sin theta) dtheta,  F_z = R b int (sigma cos theta + tau sin theta) dtheta,
    T = R^2 b int tau dtheta.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dem.html import Rich
from dem.measure.blocks import block_means
from dem.measure.wheel import steady_samples

#: Number of bins of the angle over the whole rim: 5 degrees each.
N_BINS = 72
#: Entries of a bin's load: force to the axle and along the rim in N, torque that the motor must give in N m.
NORMAL, SHEAR, TORQUE, LOADS = range(4)


@dataclass(frozen=True)
class RimStress(Rich):
    """Means in bins of the angle (N_BINS,), from -180 to 180 degrees, each with its standard error from block means.

    Loads on the sides and grousers count at their angle, over the area of the rim.
    """

    theta_deg: np.ndarray
    normal_stress_pa: np.ndarray
    normal_stress_error_pa: np.ndarray
    shear_stress_pa: np.ndarray
    shear_stress_error_pa: np.ndarray


def theta_rad() -> np.ndarray:
    """Middles of the bins (N_BINS,)."""
    return (np.arange(N_BINS) + 0.5) * (2.0 * math.pi / N_BINS) - math.pi


def rim_loads(arms_m: np.ndarray, forces_n: np.ndarray, torques_n_m: np.ndarray, row: np.ndarray, n_rows: int) -> np.ndarray:
    """Loads (n_rows, N_BINS, LOADS) of single contacts on a wheel, summed up in bins of the angle.

    Parameters
    ----------
    arms_m : places (k, 3) from the axle, which is along y. forces_n, torques_n_m : (k, 3), on the wheel, torques about the axle.
    row (k,) : to which a contact belongs.
    """
    theta = np.arctan2(arms_m[:, 0], -arms_m[:, 2])
    cos, sin = np.cos(theta), np.sin(theta)
    loads = np.empty((len(theta), LOADS))
    loads[:, NORMAL] = forces_n[:, 2] * cos - forces_n[:, 0] * sin
    loads[:, SHEAR] = forces_n[:, 0] * cos + forces_n[:, 2] * sin
    loads[:, TORQUE] = -torques_n_m[:, 1]
    binned = np.zeros((n_rows, N_BINS, LOADS))
    which = np.floor((theta + math.pi) * (N_BINS / (2.0 * math.pi))).astype(int) % N_BINS
    np.add.at(binned, (row, which), loads)
    return binned


def steady_loads(rim: Mapping[str, np.ndarray], time_s: np.ndarray) -> np.ndarray:
    """Loads (n, N_BINS, LOADS) at the n samples of the steady stretch.

    rim : contacts as in `dem.experiments.wheel.WheelRun`. time_s : of the samples. Raises ValueError if the wheel did not travel.
    """
    stretch = steady_samples(time_s)
    chosen, row = stretch[rim["sample"]], np.cumsum(stretch) - 1
    arms, forces, torques = (rim[name][chosen] for name in ("arms_m", "forces_n", "torques_n_m"))
    return rim_loads(arms, forces, torques, row[rim["sample"][chosen]], int(stretch.sum()))


def rim_stress(loads: np.ndarray, radius_m: float, width_m: float) -> RimStress:
    """Stresses from loads (n, N_BINS, LOADS) at n samples; raises ValueError with fewer samples than blocks."""
    area = radius_m * width_m * 2.0 * math.pi / N_BINS
    means = block_means(loads) / area
    stress, error = means.mean(axis=0), means.std(axis=0, ddof=1) / math.sqrt(len(means))
    return RimStress(np.degrees(theta_rad()), stress[:, NORMAL], error[:, NORMAL], stress[:, SHEAR], error[:, SHEAR])


def integrated(stress: RimStress, radius_m: float, width_m: float) -> dict[str, float]:
    """drawbar_pull_n, load_n and torque_n_m that the stresses add up to.

    The torque is that of a smooth wheel without sides: rubbing on sides has a shorter arm, and on grousers a longer one.
    """
    theta, area = np.radians(stress.theta_deg), radius_m * width_m * 2.0 * math.pi / N_BINS
    cos, sin, normal, shear = np.cos(theta), np.sin(theta), stress.normal_stress_pa, stress.shear_stress_pa
    return {
        "drawbar_pull_n": float((shear * cos - normal * sin).sum() * area),
        "load_n": float((normal * cos + shear * sin).sum() * area),
        "torque_n_m": float(shear.sum() * area * radius_m),
    }
