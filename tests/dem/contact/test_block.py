"""The contact stage on single contacts: what it does to the history."""

import numpy as np
import pytest

from dem.contact.model import ContactModel, Numbers
from dem.contact.stage import contact_stage
from dem.layout import (
    APPROACH,
    BLOCK,
    BUFFER,
    FORCE,
    GAP,
    GEOMETRY,
    INV_R_SUM,
    RESISTANCE,
    SECOND_SPIN,
    SHARE,
    SPIN_SUM,
    TWIST,
    TWIST_J,
)

DT = 1e-6
K_N, C_N, K_T, C_T, MU_S, MU_R = range(GEOMETRY, GEOMETRY + 6)


def scratch(rolling_model, tangential_model="edem"):
    """Work buffer, constants, history and laws, in float64."""
    model = ContactModel(rolling_model, "edem", "none", tangential_model)
    laws = model.laws(np.float64, DT)._replace(numbers=Numbers(DT, 1.0, 0.0, 1e-30))
    return *(np.zeros(rows * BLOCK) for rows in (BUFFER, model.n_constants, model.n_history)), laws


def stage(normal, velocity, spring, mu_s=1e9, overlap=1e-5, radius=1e-3, dashpot=0.0, model="edem"):
    """Force on i and new spring of one contact of two grains that do not spin."""
    b, c, h, laws = scratch("type_a", model)
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    apart = normal * (2 * radius - overlap)
    for a in range(3):
        b[a * BLOCK], b[(APPROACH + a) * BLOCK], h[a * BLOCK] = apart[a], velocity[a], spring[a]
    b[GAP * BLOCK] = (2 * radius) ** 2 - apart @ apart
    c[INV_R_SUM * BLOCK], c[K_N * BLOCK], c[K_T * BLOCK], c[C_N * BLOCK], c[C_T * BLOCK] = 1 / (2 * radius), 1e6, 1e6, 0.0, dashpot
    c[MU_S * BLOCK] = mu_s
    contact_stage(1, b, c, h, laws)
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


def test_with_the_limit_of_liggghts_a_dashpot_knows_no_limit_while_the_contact_sticks_and_rests_while_it_slips():
    sticking = {"mu_s": 0.5, "dashpot": 1e6, "model": "liggghts"}
    force, spring, _ = stage((0, 0, 1), velocity=(0.2, 0.0, 0.0), spring=(0.0, 0.0, 0.0), **sticking)
    assert spring[0] == pytest.approx(0.2 * DT)
    assert -force[0] == pytest.approx(1e6 * np.sqrt(1e-5) * spring[0] + 1e6 * 1e-5**0.25 * 0.2)
    assert -force[0] > 10 * 0.5 * force[2]
    force, spring, _ = stage((0, 0, 1), velocity=(-0.2, 0.0, 0.0), spring=(1e-4, 0.0, 0.0), **sticking)
    assert -force[0] == pytest.approx(0.5 * force[2])
    assert spring[0] == pytest.approx(0.5 * force[2] / (1e6 * np.sqrt(1e-5)))


def test_a_contact_that_opens_forgets_its_spring():
    _, spring, _ = stage((0, 0, 1), velocity=(0.0, 0.0, 0.0), spring=(1e-7, 0.0, 0.0), overlap=-1e-6)
    assert spring == pytest.approx([0.0, 0.0, 0.0])


@pytest.mark.parametrize(("mu_r", "slips"), [(1e3, False), (0.01, True)])
def test_a_rolling_spring_turns_both_grains_back(mu_r, slips):
    """Type C in its usual form: an angle, k_r = S_t R*^2, at most mu_r F_n R*, opposite and equal torques."""
    r_i, r_j, overlap, k = 1e-3, 3e-3, 1e-5, 1e6
    R_star, S_t, f_n = r_i * r_j / (r_i + r_j), k * np.sqrt(overlap), k * overlap**1.5
    w_i, w_j, before = np.array([2.0, -1.0, 5.0]), np.array([0.5, 3.0, 4.0]), np.array([1e-3, 2e-3, 0.0])
    b, c, h, laws = scratch("type_c")
    apart = np.array([0.0, 0.0, r_i + r_j - overlap])
    for a in range(3):
        b[a * BLOCK], b[(SPIN_SUM + a) * BLOCK] = apart[a], r_i * w_i[a] + r_j * w_j[a]
        b[(SECOND_SPIN + a) * BLOCK], h[(3 + a) * BLOCK] = r_j * w_j[a], R_star * before[a]
    b[GAP * BLOCK] = (r_i + r_j) ** 2 - apart @ apart
    c[INV_R_SUM * BLOCK], c[K_N * BLOCK], c[K_T * BLOCK], c[MU_R * BLOCK] = 1 / (r_i + r_j), k, k, mu_r
    c[SHARE * BLOCK] = R_star / r_i
    contact_stage(1, b, c, h, laws)  # without sliding friction: rolling alone turns the grains
    angle = (before + (w_i - w_j) * DT) * [1.0, 1.0, 0.0]
    largest = mu_r * f_n * R_star / (S_t * R_star**2)
    assert (np.linalg.norm(angle) > largest) == slips
    angle *= min(1.0, largest / np.linalg.norm(angle))
    assert np.array([h[(3 + a) * BLOCK] for a in range(3)]) == pytest.approx(R_star * angle)
    moment = S_t * R_star**2 * angle
    assert np.array([b[(TWIST + a) * BLOCK] for a in range(3)]) == pytest.approx(-moment / r_i)
    assert np.array([b[(TWIST_J + a) * BLOCK] for a in range(3)]) == pytest.approx(moment / r_j)
    assert b[RESISTANCE * BLOCK] == 0.0
