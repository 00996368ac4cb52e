"""How far each grain may move before a list could miss a contact.

A list made with allowances a_i holds every pair closer than r_i + r_j + a_i + a_j, so it misses none until a grain has moved
farther than its own. Fast grains have larger ones: a few of them do not make the lists short-lived for all.
"""

import math

from dem.jit import strict_jit
from dem.layout import MOTION, PLACE, RADIUS, VX

#: An outer allowance is half a skin, or more if its grain moves farther in the time of the list, in which the mean grain moves the
#: root of FLOW times its way in a step times the skin: larger lists are made anew more seldom.
FLOW = 16.0
#: Mean way in a step, in skins, below which grains are at rest.
TINY = 1e-12

#: Inner allowances last for a number of steps at which it costs about the same to make the list anew as to hold pairs that do not
#: touch, which this UPKEEP weighs. Each grain may gain a SHARE of the fastest one's speed meanwhile.
UPKEEP, SHARE = 4.0, 0.1
#: Least inner allowance in skins, largest in outer ones. The outer list is old when a grain has less than WORTH of its own left.
LEAST_INNER, MOST_INNER, WORTH = 2.5e-4, 0.5, 0.5


@strict_jit
def speed(grains, i):
    """Speed of grain i in m/s."""
    o = MOTION * i + VX
    x, y, z = float(grains.motion[o]), float(grains.motion[o + 1]), float(grains.motion[o + 2])
    return math.sqrt(x * x + y * y + z * z)


@strict_jit
def speeds(grains, n):
    """Largest and mean speed of n grains in m/s."""
    fastest, total = 0.0, 0.0
    for i in range(n):
        fastest = max(fastest, speed(grains, i))
        total += speed(grains, i)
    return fastest, total / max(n, 1)


@strict_jit
def moved(place, i, since):
    """Distance in m of grain i from its place in `since` (n, 3)."""
    o = PLACE * i
    x, y, z = place[o] - since[i, 0], place[o + 1] - since[i, 1], place[o + 2] - since[i, 2]
    return math.sqrt(x * x + y * y + z * z)


@strict_jit
def note_places(place, since):
    """Note where the grains are in `since` (n, 3)."""
    for i in range(since.shape[0]):
        for a in range(3):
            since[i, a] = place[PLACE * i + a]


@strict_jit
def allow_outer(grains, lists, dt, skin, most):
    """Set the outer allowances for grains where they are now: from half a skin to `most` in m. Returns that of the mean speed."""
    n = lists.allowance.shape[0]
    _, mean = speeds(grains, n)
    duration_s = math.sqrt(FLOW * dt * skin / max(mean, TINY * skin / dt))
    for i in range(n):
        lists.allowance[i] = min(max(0.5 * skin, speed(grains, i) * duration_s), most)
    note_places(grains.place, lists.origin)
    return min(max(0.5 * skin, mean * duration_s), most)


@strict_jit
def allow_inner(grains, lists, dt, skin, reach_m):
    """Set within[i] = r_i + inner allowance + reach_m / 2 for grains that are where they are now.

    Returns the least allowance in m, below 0 if the outer list is old or a place is not a number, and the number of steps for which
    all last.
    """
    n, place = lists.within.shape[0], grains.place
    fastest, mean = speeds(grains, n)
    n_steps = 0.5 * math.sqrt(UPKEEP * skin / max((SHARE * fastest + mean) * dt, 1e-9 * skin))
    for_all = max(SHARE * fastest * dt * n_steps, LEAST_INNER * skin)
    least = skin
    for i in range(n):
        left = lists.allowance[i] - moved(place, i, lists.origin)
        allowance = min(for_all + speed(grains, i) * dt * n_steps, MOST_INNER * lists.allowance[i])
        if not left >= WORTH * allowance:
            return -1.0, 0.0
        allowance = min(allowance, left)
        least = min(least, allowance)
        lists.within[i] = place[PLACE * i + RADIUS] + allowance + 0.5 * reach_m
    note_places(place, lists.place)
    return least, n_steps


@strict_jit
def inner_left(grains, lists, dt, reach_m, fastest):
    """Least that is left of any inner allowance in m, below 0 if that grain has moved too far or its place is not a number.

    Second, the number of steps for which all last if each grain gains a SHARE of the speed `fastest` in m/s.
    """
    place, least, n_steps = grains.place, 1e30, 1e30
    for i in range(lists.within.shape[0]):
        left = lists.within[i] - place[PLACE * i + RADIUS] - 0.5 * reach_m - moved(place, i, lists.place)
        if not left >= 0.0:
            return -1.0, 0.0
        least = min(least, left)
        way = (speed(grains, i) + SHARE * fastest) * dt
        n_steps = min(n_steps, left / way if way > 0.0 else n_steps)
    return least, n_steps
