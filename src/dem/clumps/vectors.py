"""Sum of the members' loads and their places as explicit vector code, four clumps at a time; see `dem.step.vectors`.

Same signatures and meaning as `dem.clumps.members`; tests compare the two. A row of a block has the values of four clumps side by
side; of each a member is taken at a time, whose records a transpose in registers turns into such rows, or back.
"""

import math

import numpy as np
from llvmlite import ir

from dem.clumps import members
from dem.clumps.records import BLOCK, CENTRE, FORCE, FOUR, ROTATION, SPIN, VELOCITY
from dem.jit import cgutils, intrinsic, lean_jit, types
from dem.layout import LOAD, MOTION, PLACE, QX, UX
from dem.step.vectors import DOUBLE, FAST, INT64, Emitter, largest

NOTHING = [0.0] * FOUR
#: Rows of force, torque and brake.
SUMS = 7


class ClumpEmitter(Emitter):
    """Of FOUR clumps side by side: argument 3 is their block, 4 the first one's place in it, 5 and 6 their first and last lane."""

    def rows(self, first, count=3):
        """Values of the clumps in rows."""
        return [self.load(self.array(3), self.at(self.args[4], (first + t) * BLOCK), FOUR) for t in range(count)]

    def set_rows(self, first, values):
        """Put values into rows."""
        for t, row in enumerate(values):
            self.store(self.array(3), self.at(self.args[4], (first + t) * BLOCK), row)

    def add_cross(self, x, y, total):
        """Return total + x cross y."""
        return [self.fma(self.b.fneg(x[c]), y[b], self.fma(x[b], y[c], total[a])) for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]

    def members(self):
        """Loop over the clumps' lanes, of a member each, the last excluded."""
        return cgutils.for_range_slice(self.b, self.args[5], self.args[6], ir.Constant(INT64, 1))

    def numbers(self, lane):
        """Grains of the members of one lane; argument 2 has all."""
        return [self.number(self.array(2), self.start(lane, FOUR), t) for t in range(FOUR)]


@intrinsic
def sum_clumps(typing, place, loads, grain, values, q, first, last):
    """Sum the loads of the members of FOUR clumps, and clear them: a member that comes again has none left."""

    def generate(context, builder, signature, args):
        e = ClumpEmitter(context, builder, signature, args)
        place, loads = e.array(0), e.array(1)
        centre, sums = e.rows(CENTRE), [cgutils.alloca_once(builder, ir.VectorType(DOUBLE, FOUR)) for _ in range(SUMS)]
        for total in sums:
            builder.store(e.constant(NOTHING), total)
        with e.members() as (lane, _):
            numbers = e.numbers(lane)
            starts = [e.start(number, LOAD) for number in numbers]
            *where, radius = e.transpose_places([e.record(place, number, PLACE) for number in numbers])
            *force, _ = map(e.widen, e.transpose_places([e.load(loads, at, LOAD // 2) for at in starts]))
            *twist, brake = map(e.widen, e.transpose_places([e.load(loads, e.at(at, QX), LOAD // 2) for at in starts]))
            for at in starts:
                e.store(loads, at, e.constant([0.0] * LOAD, loads[1]))
            arm = [builder.fsub(x, c) for x, c in zip(where, centre, strict=True)]
            old = [builder.load(total) for total in sums]
            torque = e.add_cross(arm, force, [e.fma(radius, t, o) for t, o in zip(twist, old[3:6], strict=True)])
            new = [*(builder.fadd(f, o) for f, o in zip(force, old[:3], strict=True)), *torque, e.fma(radius, brake, old[6])]
            for total, value in zip(sums, new, strict=True):
                builder.store(value, total)
        e.set_rows(FORCE, [builder.load(total) for total in sums])
        return context.get_dummy_value()

    return types.void(place, loads, grain, values, q, first, last), generate


@intrinsic
def place_clumps(typing, place, motion, grain, values, q, first, last, arm):
    """Place the members of FOUR clumps; returns the largest squared share of an allowance that is used up."""

    def generate(context, builder, signature, args):
        e = ClumpEmitter(context, builder, signature, args)
        place, motion, arm = e.array(0), e.array(1), e.array(7)
        nothing = e.constant(NOTHING)
        centre, velocity, spin, rotation = e.rows(CENTRE), e.rows(VELOCITY), e.rows(SPIN), e.rows(ROTATION, 9)
        largest2 = cgutils.alloca_once(builder, nothing.type)
        builder.store(nothing, largest2)
        with e.members() as (lane, _):
            numbers, at = e.numbers(lane), e.start(lane, PLACE * FOUR)
            *arms, radius = (e.load(arm, e.at(at, t * FOUR), FOUR) for t in range(PLACE))
            away = []
            for axis in range(3):
                part = builder.fmul(rotation[3 * axis], arms[0])
                for t in (1, 2):
                    part = e.fma(rotation[3 * axis + t], arms[t], part)
                away.append(part)
            where = [*(builder.fadd(c, x) for c, x in zip(centre, away, strict=True)), radius]
            for number, record in zip(numbers, e.transpose_places(where), strict=True):
                e.store(place, e.start(number, PLACE), record)
            moving = e.add_cross(spin, away, velocity)
            turning = [builder.fmul(radius, w) for w in spin]
            *_, use = e.transpose_places([e.load(motion, e.start(number, MOTION), UX) for number in numbers])
            for offset, rows in ((0, (*moving, e.widen(use))), (UX, (*turning, nothing))):
                records = e.transpose_places([e.narrow(row, motion[1]) for row in rows])
                for number, record in zip(numbers, records, strict=True):
                    e.store(motion, e.at(e.start(number, MOTION), offset), record)
            speed2 = builder.fmul(moving[0], moving[0])
            for v in moving[1:]:
                speed2 = e.fma(v, v, speed2)
            used2 = builder.fmul(builder.fmul(speed2, e.widen(use)), e.widen(use))
            builder.store(e.call("maxnum", builder.load(largest2), used2, fast=FAST), largest2)
        return largest(e, builder.load(largest2))

    return types.float64(place, motion, grain, values, q, first, last, arm), generate


@lean_jit
def sum_members(grains, loads, clumps):
    """As `dem.clumps.members.sum_members`, of all clumps."""
    begin, n = clumps.lane, clumps.begin.shape[0] - 1
    for g in range(begin.shape[0] - 1):
        values, q = clumps.blocks[g * FOUR // BLOCK], np.int64(g * FOUR % BLOCK)
        sum_clumps(grains.place, loads, clumps.lane_grain, values, q, begin[g], begin[g + 1])
    members.sum_members(grains, loads, clumps, n - n % FOUR, n)


@lean_jit
def place_members(grains, clumps):
    """As `dem.clumps.members.place_members`, of all clumps."""
    begin, n, largest2 = clumps.lane, clumps.begin.shape[0] - 1, 0.0
    place, motion, _ = grains
    for g in range(begin.shape[0] - 1):
        values, q = clumps.blocks[g * FOUR // BLOCK], np.int64(g * FOUR % BLOCK)
        of_four = place_clumps(place, motion, clumps.lane_grain, values, q, begin[g], begin[g + 1], clumps.lane_arm)
        largest2 = max(largest2, of_four)
    return max(math.sqrt(largest2), members.place_members(grains, clumps, n - n % FOUR, n))
