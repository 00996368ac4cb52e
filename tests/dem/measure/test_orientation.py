"""Orientation distribution of long axes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dem.measure.orientation import OrientationError, long_axes, measure_orientations

MOMENTS = np.array([2.0, 1.0, 3.0])  # long along y


def quaternions(rotation):
    return rotation.as_quat(scalar_first=True).reshape(-1, 4)


def test_random_orientations_are_isotropic():
    n = 20_000
    found = measure_orientations(quaternions(Rotation.random(n, rng=1)), np.tile(MOMENTS, (n, 1)))
    assert found.tensor == pytest.approx(np.eye(3) / 3.0, abs=0.01)
    assert found.order == pytest.approx(0.0, abs=0.015)
    assert found.tilt_shares == pytest.approx(np.full(10, 0.1), abs=0.01)
    assert found.mean_tilt_deg == pytest.approx(np.degrees(1.0), abs=0.5)


def test_axes_that_lie_in_a_plane_and_axes_that_stand():
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    lying = measure_orientations(quaternions(Rotation.from_rotvec(np.outer(angles, [0.0, 0.0, 1.0]))), np.tile(MOMENTS, (8, 1)))
    assert lying.tensor == pytest.approx(np.diag([0.5, 0.5, 0.0]))
    assert lying.order == pytest.approx(0.25)
    assert lying.tilt_shares[0] == 1.0
    assert lying.mean_tilt_deg == pytest.approx(90.0)
    standing = Rotation.from_rotvec([[0.5 * np.pi, 0.0, 0.0], [-0.5 * np.pi, 0.0, 0.0]])
    upright = measure_orientations(quaternions(standing), np.tile(MOMENTS, (2, 1)))
    assert upright.order == pytest.approx(1.0)
    assert upright.director == pytest.approx([0.0, 0.0, 1.0])
    assert upright.tilt_shares[-1] == 1.0
    assert upright.mean_tilt_deg == pytest.approx(0.0, abs=1e-6)


def test_the_axis_turns_with_the_clump():
    turn = Rotation.from_rotvec([0.2, 0.5, -0.4])
    assert long_axes(quaternions(turn), MOMENTS[None])[0] == pytest.approx(turn.apply([0.0, 1.0, 0.0]))


@pytest.mark.parametrize(
    ("orientations", "moments", "message"),
    [
        (np.zeros((0, 4)), np.zeros((0, 3)), "allowed: .n, 4. and .n, 3."),
        (np.ones((2, 3)), np.ones((2, 3)), "allowed: .n, 4. and .n, 3."),
        (np.ones((2, 4)), np.ones((2, 3)), "moments of clump 0 are .*for a long axis"),
    ],
)
def test_what_has_no_long_axis_is_refused(orientations, moments, message):
    with pytest.raises(OrientationError, match=message):
        measure_orientations(orientations, moments)
