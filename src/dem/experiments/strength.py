"""Peak and steady strength of a sheared soil, read from a curve of shear stress: of a simulation or of a laboratory test.

Dense soil rises to a peak, dilates, and comes down to the steady (critical) state, in which it shears on at constant stress and
volume (Schofield & Wroth 1968). The shear stress of a few thousand grains fluctuates by some 5 % as force chains build and buckle.
The highest sample is therefore the highest fluctuation, and the peak is that of a running mean. The steady strength is the mean of
the last part of the curve; its error follows from the means of consecutive blocks, since single samples are not independent.

Position: displacement or shear strain, in any unit, ascending. Signs: shear stress is positive when the soil resists, normal stress
positive in compression.
"""

from dataclasses import dataclass

import numpy as np

from dem import Rich

#: Window of the peak's running mean, as a part of the samples up to the highest. It follows the peak and not the length of the
#: curve: a test that goes on longer has the same peak. Where there is none, the highest sample comes late and the window is wide.
PEAK_WINDOW = 0.4
#: A curve of fewer samples, such as one read by hand, is not averaged.
LEAST_AVERAGED = 30
#: Last part of the curve in which the strength is to be steady, and number of its blocks.
STEADY_PART, N_BLOCKS = 0.5, 5
#: Student's factor for the mean of N_BLOCKS values, so that two standard errors have the probability of two normal ones (95.45 %),
#: and for the slope through them, which has one degree of freedom less.
MEAN_FACTOR, SLOPE_FACTOR = 1.435, 1.653
#: The strength is steady if it changes over the last part by no more than two standard errors, and by no more than this ratio.
NOISE_LIMIT, LARGEST_DRIFT = 2.0, 0.1
#: Least number of samples, so that each block has two.
LEAST_SAMPLES = 20


class CurveError(ValueError):
    """A curve from which no strength can be read."""


@dataclass(frozen=True, kw_only=True)
class Peak(Rich):
    """Highest running mean of the shear stress, the normal stress over the same samples, and the position of their middle."""

    shear_stress_pa: float
    normal_stress_pa: float
    position: float


@dataclass(frozen=True, kw_only=True)
class Steady(Rich):
    """Mean shear and normal stress of the last part of a curve.

    stress_ratio_se : standard error of their ratio, from blocks. drift, drift_se : change of the ratio over the part, relative to
    the ratio, and its standard error. steady : False if the ratio still changes, beyond its noise or by more than LARGEST_DRIFT.
    """

    shear_stress_pa: float
    normal_stress_pa: float
    stress_ratio_se: float
    drift: float
    drift_se: float
    steady: bool


def peak(position, shear_stress_pa, normal_stress_pa) -> Peak:
    """Peak strength of a curve.

    Parameters
    ----------
    position, shear_stress_pa, normal_stress_pa : array_like, shape (n,). Of fewer than LEAST_AVERAGED samples the highest is the
    peak.

    Raises
    ------
    CurveError : the curve is empty, uneven in length or not finite.
    """
    position, shear, normal = checked(position, shear_stress_pa, normal_stress_pa)
    n = max(1, round(PEAK_WINDOW * (1 + int(np.argmax(shear))))) if len(shear) >= LEAST_AVERAGED else 1
    means = [np.convolve(values, np.full(n, 1.0 / n), mode="valid") for values in (position, shear, normal)]
    highest = int(np.argmax(means[1]))
    at, tau, p = (float(values[highest]) for values in means)
    return Peak(shear_stress_pa=tau, normal_stress_pa=p, position=at)


def steady(position, shear_stress_pa, normal_stress_pa) -> Steady:
    """Steady strength of a curve, and whether it is steady; arguments as of `peak`.

    Raises
    ------
    CurveError : as of `peak`; also fewer than 20 samples, gaps between them, positions that go back, or no normal stress.
    """
    position, shear, normal = checked(position, shear_stress_pa, normal_stress_pa)
    check_long(position, normal)
    begin = position[-1] - STEADY_PART * (position[-1] - position[0])
    block = np.minimum((N_BLOCKS * (position - begin) / (position[-1] - begin)).astype(int), N_BLOCKS - 1)
    within, places = position >= begin, (np.arange(N_BLOCKS) + 0.5) / N_BLOCKS - 0.5
    parts = [within & (block == k) for k in range(N_BLOCKS)]
    if not all(part.any() for part in parts):
        raise CurveError(f"the samples leave gaps of more than {STEADY_PART / N_BLOCKS:g} of the curve; allowed: smaller gaps")
    ratios = np.array([shear[part].mean() / normal[part].mean() for part in parts])
    mean = float(shear[within].mean() / normal[within].mean())
    slope = float(places @ ratios / (places @ places))
    residuals = ratios - ratios.mean() - slope * places
    slope_se = SLOPE_FACTOR * float(np.sqrt(residuals @ residuals / (N_BLOCKS - 2) / (places @ places)))
    drift, drift_se = slope / abs(mean), slope_se / abs(mean)
    return Steady(
        shear_stress_pa=float(shear[within].mean()),
        normal_stress_pa=float(normal[within].mean()),
        stress_ratio_se=MEAN_FACTOR * float(ratios.std(ddof=1)) / N_BLOCKS**0.5,
        drift=drift,
        drift_se=drift_se,
        steady=abs(drift) <= min(NOISE_LIMIT * drift_se, LARGEST_DRIFT),
    )


def checked(*columns) -> tuple[np.ndarray, ...]:
    """Position, shear and normal stress as arrays; raises CurveError unless they make a curve."""
    names = ("position", "shear stress", "normal stress")
    arrays = tuple(np.asarray(column, dtype=float) for column in columns)
    n = len(arrays[0])
    if n == 0:
        raise CurveError("the curve has no samples; allowed: at least one")
    for name, values in zip(names, arrays, strict=True):
        if values.shape != (n,):
            raise CurveError(f"{name} has shape {values.shape}; allowed: ({n},), a value for each position")
        if not np.isfinite(values).all():
            worst = int(np.argmin(np.isfinite(values)))
            raise CurveError(f"{name} is {values[worst]} in sample {worst}; allowed: finite numbers")
    return arrays


def check_long(position: np.ndarray, normal: np.ndarray) -> None:
    """Raise CurveError unless a curve is long enough to be steady, goes forward and has normal stress."""
    if len(position) < LEAST_SAMPLES:
        raise CurveError(f"the curve has {len(position)} samples; allowed: at least {LEAST_SAMPLES}")
    back = np.diff(position) < 0.0
    if back.any() or position[-1] <= position[0]:
        raise CurveError(f"the position does not grow after sample {int(np.argmax(back))}; allowed: ascending positions")
    if (normal <= 0.0).any():
        worst = int(np.argmax(normal <= 0.0))
        raise CurveError(f"normal stress is {normal[worst]:g} in sample {worst}; allowed: above zero")
