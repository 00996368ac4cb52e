"""The paper's fourth objective (Equation 4), which prefers large grains: they are cheaper to simulate."""

import numpy as np


def large_grains(radius_um):
    """phi4 = 10 (pi/2 - arctan(r - 5)), r in um; near 10/r for large grains."""
    return 10.0 * (np.pi / 2 - np.arctan(radius_um - 5.0))
