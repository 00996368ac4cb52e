"""How far each grain may move before a list could miss a contact.

A list made with allowances a_i holds every pair closer than r_i + r_j + a_i + a_j, so it misses none until a grain has moved
farther than its own. Fast grains have larger ones: a few of them do not make the lists short-lived for all.

Inner allowances count from where each grain was when it got its own, and pairs are chosen by these places. So a grain that has used
up its own gets another alone, and only the slabs whose pairs it belongs to choose their contacts again.
"""

import math
from typing import NamedTuple

from dem.jit import strict_inline_jit, strict_jit
from dem.layout import MOTION, PLACE, RADIUS, USE, VX

#: An outer allowance is half a skin, or more if its grain moves farther in the time of the list, in which the mean grain moves the
#: root of FLOW times its way in a step times the skin: larger lists are made anew more seldom.
FLOW = 16.0
#: Mean way in a step, in skins, below which grains are at rest.
TINY = 1e-12

#: Inner allowances last for a number of steps at which it costs about the same to make the list anew as to hold pairs that do not
#: touch, which this UPKEEP weighs. Each grain may gain a SHARE of the fastest one's speed meanwhile.
UPKEEP, SHARE = 4.0, 0.03
#: Least inner allowance in skins, largest in outer ones. The outer list is old when a grain has less than WORTH of its own left.
LEAST_INNER, MOST_INNER, WORTH = 2.5e-4, 0.5, 0.5
#: A grain that has less left than its way in this share of the steps for which it was allowed, or than this share of its allowance,
#: is allowed anew when its slab is looked at.
LITTLE, LEAST_LEFT = 0.25, 1e-3


class Terms(NamedTuple):
    """Number of steps for which inner allowances last unless grains gain speed, and what every grain has beyond its own way (m)."""

    n_steps: float
    for_all: float


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


@strict_inline_jit
def moved(place, i, since):
    """Distance in m of grain i from its place in the records `since`."""
    o = PLACE * i
    x, y, z = place[o] - since[o], place[o + 1] - since[o + 1], place[o + 2] - since[o + 2]
    return math.sqrt(x * x + y * y + z * z)


@strict_inline_jit
def note_place(place, i, since):
    """Note the place record of grain i in the records `since`."""
    for t in range(PLACE):
        since[PLACE * i + t] = place[PLACE * i + t]


@strict_jit
def allow_outer(grains, lists, dt, skin, most):
    """Set the outer allowances for grains where they are now: from half a skin to `most` in m. Returns that of the mean speed."""
    n = lists.allowance.shape[0]
    _, mean = speeds(grains, n)
    duration_s = math.sqrt(FLOW * dt * skin / max(mean, TINY * skin / dt))
    for i in range(n):
        lists.allowance[i] = min(max(0.5 * skin, speed(grains, i) * duration_s), most)
        note_place(grains.place, i, lists.origin)
    return min(max(0.5 * skin, mean * duration_s), most)


@strict_jit
def allow_inner(grains, lists, dt, skin, reach_m):
    """Set within[i] = r_i + inner allowance + reach_m / 2, and USE, for grains that are where they are now.

    Returns the largest share of an allowance that is used up in a step, below 0 if the outer list is old or a place is not a
    number, and the terms of the allowances.
    """
    n, largest = lists.within.shape[0], 0.0
    fastest, mean = speeds(grains, n)
    n_steps = 0.5 * math.sqrt(UPKEEP * skin / max((SHARE * fastest + mean) * dt, 1e-9 * skin))
    terms = Terms(n_steps, max(SHARE * fastest * dt * n_steps, LEAST_INNER * skin))
    for i in range(n):
        left = allow(grains, i, lists, dt, reach_m, terms)
        if not left > 0.0:
            return -1.0, terms
        largest = max(largest, set_use(grains, i, dt, left))
    return largest, terms


@strict_inline_jit
def allow(grains, i, lists, dt, reach_m, terms):
    """Give grain i an inner allowance where it is now; returns it in m, or -1 if the outer list is old or a place is no number."""
    left = lists.allowance[i] - moved(grains.place, i, lists.origin)
    allowance = min(terms.for_all + speed(grains, i) * dt * terms.n_steps, MOST_INNER * lists.allowance[i])
    if not left >= WORTH * allowance:
        return -1.0
    allowance = min(allowance, left)
    note_place(grains.place, i, lists.place)
    lists.within[i] = grains.place[PLACE * i + RADIUS] + allowance + 0.5 * reach_m
    return allowance


@strict_jit
def look(which, grains, lists, dt, reach_m, terms):
    """Set USE of the grains of the numbers `which` by what is left of their inner allowances; those that have little get another.

    Returns the number of these, below 0 if the outer list is old or a place is not a number; how many of them may be near
    surfaces; the largest share of an allowance that is used up in a step.
    """
    place, largest, n_renewed, n_near = grains.place, 0.0, 0, 0
    for k in range(which.shape[0]):
        i = which[k]
        allowance = lists.within[i] - place[PLACE * i + RADIUS] - 0.5 * reach_m
        left = allowance - moved(place, i, lists.place)
        if not left > max(LITTLE * terms.n_steps * dt * speed(grains, i), LEAST_LEFT * allowance):
            left = allow(grains, i, lists, dt, reach_m, terms)
            if not left > 0.0:
                return -1, 0, 0.0
            n_renewed += 1
            n_near += int(lists.surfaces.outer.row[i, 0] < lists.surfaces.outer.row[i, 1])
        largest = max(largest, set_use(grains, i, dt, left))
    return n_renewed, n_near, largest


@strict_inline_jit
def set_use(grains, i, dt, left):
    """Set USE of grain i, which has `left` m left; returns the share of it that is used up in a step."""
    grains.motion[MOTION * i + USE] = dt / left
    return speed(grains, i) * dt / left
