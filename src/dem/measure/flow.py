"""Field of displacement and velocity in a vertical plane through a tool."""

import numpy as np

from dem import Grains


def plane_flow(
    at_rest: Grains,
    begin: Grains,
    end: Grains,
    duration_s: float,
    centre_m: np.ndarray,
    half_thickness_m: float,
    period_m: np.ndarray,
) -> dict[str, np.ndarray]:
    """Columns of the grains whose centres are within a half thickness of the plane y = centre_m[1], at the middle of an interval.

    x_m, z_m: place from the centre, nearest image. radius_m. displacement_x_m, displacement_z_m: since the bed was at rest.
    velocity_x_m_s, velocity_z_m_s: mean over the interval, so that the grains' rattling does not hide their flow.

    Parameters
    ----------
    at_rest, begin, end : the same grains before the test, and at begin and end of the interval; their places are not wrapped.
    centre_m : (3,), of the tool in the middle of the interval. period_m : (3,), 0 where not periodic.
    """
    place = 0.5 * (begin.positions_m + end.positions_m)
    moved, velocity = place - at_rest.positions_m, (end.positions_m - begin.positions_m) / duration_s
    apart = place - centre_m
    apart -= period_m * np.rint(np.divide(apart, period_m, out=np.zeros_like(apart), where=period_m > 0))
    near = np.abs(apart[:, 1]) <= half_thickness_m
    columns = {"x_m": apart[:, 0], "z_m": apart[:, 2], "radius_m": end.radii_m}
    for name, values in (("displacement_{}_m", moved), ("velocity_{}_m_s", velocity)):
        columns |= {name.format(axis): values[:, k] for axis, k in (("x", 0), ("z", 2))}
    return {name: values[near] for name, values in columns.items()}
