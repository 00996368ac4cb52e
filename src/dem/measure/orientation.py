"""Distribution of the long axes of clumps: preferred direction, degree of order, and tilt from the vertical.

The long axis is that of the smallest moment of inertia. Its two ends are the same, so directions are counted without sign: the
orientation tensor is the mean of n n^T (de Gennes & Prost, The Physics of Liquid Crystals, 2.1). Isotropic axes have eigenvalues of
1/3 and an order of 0, up to some 1/sqrt(n).
"""

from dataclasses import dataclass

import numpy as np
import scipy

from dem.html import Rich

#: Bins of |cos| of the tilt: of equal width, so that isotropic axes fill them equally.
TILT_BINS = 10

#: The smallest moment is below the next by this share, or there is no long axis.
LEAST_DIFFERENCE = 0.01


class OrientationError(ValueError):
    """Orientations or moments that have no long axes."""


@dataclass(frozen=True, kw_only=True)
class OrientationDistribution(Rich):
    """Distribution of n long axes.

    Attributes
    ----------
    tensor : (3, 3), mean of n n^T. order : (3 largest eigenvalue - 1) / 2, 0 isotropic, 1 all parallel.
    director : (3,), direction of that eigenvalue, z not negative.
    tilt_shares : (TILT_BINS,), share of the axes in bins of |cos| of the angle from the vertical: first those that lie.
    mean_tilt_deg : mean angle from the vertical (isotropic: 57.3).
    """

    tensor: np.ndarray
    order: float
    director: np.ndarray
    tilt_shares: np.ndarray
    mean_tilt_deg: float


def long_axes(orientations, moments) -> np.ndarray:
    """Unit vectors (n, 3) along the long axes of clumps.

    Parameters
    ----------
    orientations : (n, 4), quaternions (w, x, y, z). moments : (n, 3), principal moments; both as `dem.ClumpStates` has them.

    Raises
    ------
    OrientationError : no clumps, shapes that differ, or a clump without a long axis, such as a sphere or a tetrahedron.
    """
    orientations, moments = np.asarray(orientations, float), np.asarray(moments, float)
    if orientations.ndim != 2 or orientations.shape[1:] != (4,) or moments.shape != (len(orientations), 3) or not len(moments):
        raise OrientationError(
            f"orientations have shape {orientations.shape} and moments {moments.shape}; allowed: (n, 4) and (n, 3)"
        )
    ascending = np.sort(moments, axis=1)
    round_ = ascending[:, 0] > (1.0 - LEAST_DIFFERENCE) * ascending[:, 1]
    if round_.any():
        k = int(np.argmax(round_))
        raise OrientationError(f"moments of clump {k} are {moments[k].tolist()}; allowed: a single smallest one, for a long axis")
    along = np.eye(3)[np.argmin(moments, axis=1)]
    return scipy.spatial.transform.Rotation.from_quat(orientations, scalar_first=True).apply(along)


def measure_orientations(orientations, moments) -> OrientationDistribution:
    """Distribution of the long axes; arguments and errors as in `long_axes`."""
    axes = long_axes(orientations, moments)
    tensor = axes.T @ axes / len(axes)
    values, directions = np.linalg.eigh(tensor)
    cosines = np.minimum(np.abs(axes[:, 2]), 1.0)
    shares = np.histogram(cosines, TILT_BINS, (0.0, 1.0))[0] / len(axes)
    return OrientationDistribution(
        tensor=tensor,
        order=float(1.5 * values[2] - 0.5),
        director=directions[:, 2] * (1.0 if directions[2, 2] >= 0.0 else -1.0),
        tilt_shares=shares,
        mean_tilt_deg=float(np.degrees(np.arccos(cosines)).mean()),
    )
