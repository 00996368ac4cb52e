"""The contact stage on single contacts: what it does to the history."""

import numpy as np
import pytest

from dem.contact.block import contact_stage
from dem.layout import BLOCK, BUFFER, C_N, C_T, CONSTANTS, FORCE, INV_R_SUM, K_N, K_T, MU_S

DT = 1e-6


def stage(normal, velocity, spring, mu_s=1e9, overlap=1e-5, radius=1e-3, dashpot=0.0):
    """Force on i and new spring of one contact of two grains that do not spin."""
    b, c, h = np.zeros(BUFFER * BLOCK), np.zeros(CONSTANTS * BLOCK), np.zeros(6 * BLOCK)
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    apart = normal * (2 * radius - overlap)
    for a in range(3):
        b[a * BLOCK], b[(4 + a) * BLOCK], h[a * BLOCK] = apart[a], velocity[a], spring[a]
    b[3 * BLOCK] = (2 * radius) ** 2 - apart @ apart
    c[INV_R_SUM * BLOCK], c[K_N * BLOCK], c[K_T * BLOCK], c[C_N * BLOCK], c[C_T * BLOCK] = 1 / (2 * radius), 1e6, 1e6, 0.0, dashpot
    c[MU_S * BLOCK] = mu_s
    contact_stage(1, b, c, h, DT, 1.0, 0.0, 1e-30, -1e30)
    return np.array([b[(FORCE + a) * BLOCK] for a in range(3)]), np.array([h[a * BLOCK] for a in range(3)]), normal


@pytest.mark.parametrize("normal", [(1, 0, 0), (0, 1, 1), (1, -2, 3)])
def test_the_spring_turns_with_the_normal_and_stays_in_the_contact_plane(normal):
    _, spring, n = stage(normal, velocity=(0.1, -0.2, 0.3), spring=(3e-7, 2e-7, -1e-7))
    assert abs(spring @ n) < 1e-6 * np.linalg.norm(spring)


def test_the_spring_grows_against_the_sliding_and_pushes_back():
    force, spring, _ = stage((0, 0, 1), velocity=(0.2, 0.0, 0.0), spring=(1e-7, 0.0, 0.0))
    assert spring == pytest.approx([1e-7 + 0.2 * DT, 0.0, 0.0])
    assert force[0] == pytest.approx(-1e6 * np.sqrt(1e-5) * spring[0])
    assert force[2] > 0.0


def test_a_sliding_contact_keeps_only_the_spring_that_coulomb_allows():
    force, spring, _ = stage((0, 0, 1), velocity=(0.0, 0.0, 0.0), spring=(1e-4, 0.0, 0.0), mu_s=0.5)
    assert -force[0] == pytest.approx(0.5 * force[2])
    assert spring[0] == pytest.approx(0.5 * force[2] / (1e6 * np.sqrt(1e-5)))


def test_a_dashpot_beyond_the_limit_is_cut_off_and_leaves_the_spring_alone():
    force, spring, _ = stage((0, 0, 1), velocity=(0.2, 0.0, 0.0), spring=(0.0, 0.0, 0.0), mu_s=0.5, dashpot=1e6)
    assert -force[0] == pytest.approx(0.5 * force[2])
    assert spring[0] == pytest.approx(0.2 * DT)


def test_a_contact_that_opens_forgets_its_spring():
    _, spring, _ = stage((0, 0, 1), velocity=(0.0, 0.0, 0.0), spring=(1e-7, 0.0, 0.0), overlap=-1e-6)
    assert spring == pytest.approx([0.0, 0.0, 0.0])
