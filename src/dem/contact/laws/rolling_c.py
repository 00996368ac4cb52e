"""Rolling resistance of type C, elastic-plastic: a rolling spring between two grains, without viscous part.

A spring of angle theta with k_r = S_t R*^2 (S_t: tangential stiffness), its moment limited to mu_r F_n R*, opposite and equal on
both grains. Written here with the spring's length s = R* theta and the rolling velocity v_r = R* (w_i - w_j), w angular velocity:

    ds/dt = v_r = p_i u_i - p_j u_j,   p_i = R*/R_i = R_j/(R_i + R_j) = 1 - p_j,   u = R w
    S_t |s| <= mu_r F_n                (else s is shortened to it, as a tangential spring)
    Q_i = -p_i S_t s,   Q_j = p_j S_t s  (torque over radius)

On a wall p_i = 1. The spring turns with the contact: its part along the normal is dropped. Limit: nothing resists twisting, so a
grain that rests on a single other one may spin about the normal for ever.
Source: Ai, Chen, Rotter, Ooi 2011, Powder Technol. 206, 269.
"""

from typing import NamedTuple

from dem.contact.laws.mindlin import flat, slip
from dem.jit import lean_jit
from dem.layout import BLOCK as B
from dem.layout import SECOND_SPIN, SPIN_SUM


class RollingC(NamedTuple):
    """Constants of a contact: coefficient of rolling friction."""

    mu_r: float


PARAMETERS = RollingC
PROPERTIES = ("rolling_friction",)
COLUMNS = ("mu_r",)
CONSTANTS = ("mu_r",)
#: Length of the rolling spring in m.
HISTORY = ("s_x", "s_y", "s_z")
#: The torques on the two grains differ.
SEPARATE_SPINS = True
WORDS = {
    "words": "Type C, elastic-plastic (Ai, Chen, Rotter, Ooi 2011, without viscous part): a rolling spring between two grains.",
    "equation": "M = k_r theta, k_r = S_t R*^2, |M| <= mu_r F_n R*",
}


def column_values(a, b, interaction):
    """Values of COLUMNS for two materials."""
    return (interaction.rolling_friction,)


def reach(columns, R_star):
    """Gap in m up to which the law acts: it needs contact."""
    return 0.0


def read(law, c, o):
    """Constants of the contact whose first value stands at o."""
    return RollingC(c[o])


def write(law, raw, p, c, o, pair):
    """Turn the pair's columns, from p on in raw, into constants from o on."""
    c[o] = raw[p]


@lean_jit
def resistance(law, pressing):
    """Largest force of the rolling spring in N, hence |Q| with which a contact resists rolling."""
    return law.mu_r * pressing


@lean_jit
def stored(S_t, s2):
    """Energy in J of a spring of stiffness S_t and squared length s2."""
    return 0.5 * S_t * s2


def rolling_force(law, q, b, h, o, touch, numbers):
    """Force in N of the rolling spring of contact q, whose length in h is renewed."""
    p_i, dt = touch.share, numbers.dt
    sx = h[o] + dt * (p_i * b[SPIN_SUM * B + q] - b[SECOND_SPIN * B + q])
    sy = h[o + B] + dt * (p_i * b[(SPIN_SUM + 1) * B + q] - b[(SECOND_SPIN + 1) * B + q])
    sz = h[o + 2 * B] + dt * (p_i * b[(SPIN_SUM + 2) * B + q] - b[(SECOND_SPIN + 2) * B + q])
    turned = (sx * touch.ax + sy * touch.ay + sz * touch.az) * touch.inv_arm2
    sx -= turned * touch.ax
    sy -= turned * touch.ay
    sz -= turned * touch.az
    S_t = touch.S_t
    factor = slip(S_t * S_t * (sx * sx + sy * sy + sz * sz), resistance(law, touch.pressing), numbers.one, numbers.tiny)
    sx *= factor
    sy *= factor
    sz *= factor
    h[o] = sx
    h[o + B] = sy
    h[o + 2 * B] = sz
    return S_t * sx, S_t * sy, S_t * sz


def rolling_spring(law, h, o, touch, rolling, numbers):
    """Force of the rolling spring after a step (3), its energy before and after it, in N and J, at rolling velocity (3,).

    The history stays as it is; the length before the step is what is left of it after turning with the normal.
    """
    S_t, dt = touch.S_t, numbers.dt
    ax, ay, az = flat(float(h[o]), float(h[o + B]), float(h[o + 2 * B]), touch.ax, touch.ay, touch.az)
    rx, ry, rz = flat(rolling[0], rolling[1], rolling[2], touch.ax, touch.ay, touch.az)
    sx, sy, sz = ax + rx * dt, ay + ry * dt, az + rz * dt
    factor = slip(S_t * S_t * (sx * sx + sy * sy + sz * sz), resistance(law, touch.pressing), numbers.one, numbers.tiny)
    sx, sy, sz = factor * sx, factor * sy, factor * sz
    before, after = stored(S_t, ax * ax + ay * ay + az * az), stored(S_t, sx * sx + sy * sy + sz * sz)
    return S_t * sx, S_t * sy, S_t * sz, before, after
