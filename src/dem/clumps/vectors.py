"""Sum of the members' loads and their places as explicit vector code, a clump at a time; see `dem.step.vectors`.

Same signatures and meaning as `sum_members` and `place_members` in `dem.clumps.motion`; tests compare the two. A member's place,
force and torque are vectors of four float64, of which the last lane carries the radius or the rolling resistance.
"""

import math

import numpy as np
from llvmlite import ir

from dem.clumps.records import BRAKE, CENTRE, FORCE, ROTATION, SPIN, TORQUE, VELOCITY
from dem.jit import cgutils, intrinsic, lean_jit, types
from dem.layout import BLOCK, LOAD, MOTION, PLACE, RADIUS
from dem.step.vectors import FAST, INT32, INT64, Emitter, spread_scalar

#: Lanes of a vector for a cross product: y, z, x and z, x, y; the last lane stays.
NEXT, AFTER_NEXT = [1, 2, 0, 3], [2, 0, 1, 3]
NOTHING = [0.0] * PLACE


class ClumpEmitter(Emitter):
    """With the clump's values, argument 3, at offset q, argument 4."""

    def row(self, first, step=1):
        """Vector of three rows, from `first` on, and zero."""
        data, vector = self.array(3)[0], self.constant(NOTHING)
        for t in range(3):
            value = self.b.load(self.b.gep(data, [self.at(self.args[4], (first + step * t) * BLOCK)]))
            vector = self.b.insert_element(vector, value, ir.Constant(INT32, t))
        return vector

    def set_rows(self, first, vector, count):
        """Put the first lanes of a vector into rows."""
        for t in range(count):
            pointer = self.b.gep(self.array(3)[0], [self.at(self.args[4], (first + t) * BLOCK)])
            self.b.store(self.b.extract_element(vector, ir.Constant(INT32, t)), pointer)

    def add_cross(self, x, y, total):
        """Return total + x cross y."""
        total = self.fma(self.pick(x, x, NEXT), self.pick(y, y, AFTER_NEXT), total)
        return self.fma(self.b.fneg(self.pick(x, x, AFTER_NEXT)), self.pick(y, y, NEXT), total)

    def members(self):
        """Loop over the entries of the clump's members: arguments 5 to 6, the latter excluded."""
        return cgutils.for_range_slice(self.b, self.args[5], self.args[6], ir.Constant(INT64, 1))


@intrinsic
def sum_clump(typing, place, loads, grain, values, q, first, last):
    """Sum the loads of one clump's members, and clear them."""

    def generate(context, builder, signature, args):
        e = ClumpEmitter(context, builder, signature, args)
        place, loads, grain, centre, none = e.array(0), e.array(1), e.array(2), e.row(CENTRE), e.constant(NOTHING)
        force, torque = (cgutils.alloca_once_value(builder, none) for _ in range(2))
        with e.members() as (k, _):
            number = e.number(grain, k, 0)
            at = e.start(number, LOAD)
            load, where = e.load(loads, at, LOAD), e.record(place, number, PLACE)
            e.store(loads, at, e.constant([0.0] * LOAD, loads[1]))
            pushed, twisted = (e.widen(e.pick(load, load, lanes)) for lanes in (range(4), range(4, 8)))
            total = e.fma(e.spread(where, RADIUS, PLACE), twisted, builder.load(torque))
            builder.store(e.add_cross(builder.fsub(where, centre), pushed, total), torque)
            builder.store(builder.fadd(builder.load(force), pushed), force)
        e.set_rows(FORCE, builder.load(force), 3)
        e.set_rows(TORQUE, builder.load(torque), BRAKE + 1 - TORQUE)
        return context.get_dummy_value()

    return types.void(place, loads, grain, values, q, first, last), generate


@intrinsic
def place_clump(typing, place, motion, grain, values, q, first, last, arm):
    """Place one clump's members; returns their largest squared speed."""

    def generate(context, builder, signature, args):
        e = ClumpEmitter(context, builder, signature, args)
        place, motion, grain, arm = e.array(0), e.array(1), e.array(2), e.array(7)
        axes = [e.row(ROTATION + axis, step=3) for axis in range(3)]
        centre, velocity, spin = e.row(CENTRE), e.row(VELOCITY), e.row(SPIN)
        fastest2 = cgutils.alloca_once_value(builder, e.constant(NOTHING))
        with e.members() as (k, _):
            number = e.number(grain, k, 0)
            at, offset = e.start(number, PLACE), e.b.mul(k, ir.Constant(INT64, 3))
            old, away = e.load(place, at, PLACE), e.constant(NOTHING)
            for t, axis in enumerate(axes):
                length = builder.load(builder.gep(arm[0], [e.at(offset, t)]))
                away = e.fma(axis, spread_scalar(e, length, PLACE), away)
            e.store(place, at, e.pick(builder.fadd(centre, away), old, [0, 1, 2, 4 + RADIUS]))
            moving = e.add_cross(spin, away, velocity)
            turning = builder.fmul(spin, e.spread(old, RADIUS, PLACE))
            record = e.concatenate(e.narrow(moving, motion[1]), e.narrow(turning, motion[1]))
            e.store(motion, e.start(number, MOTION), record)
            square = builder.fmul(moving, moving)
            sum_ = builder.fadd(builder.fadd(square, e.pick(square, square, NEXT)), e.pick(square, square, AFTER_NEXT))
            builder.store(e.call("maxnum", builder.load(fastest2), sum_, fast=FAST), fastest2)
        return builder.extract_element(builder.load(fastest2), ir.Constant(INT32, 0))

    return types.float64(place, motion, grain, values, q, first, last, arm), generate


@lean_jit
def sum_members(grains, loads, clumps):
    """As `dem.clumps.motion.sum_members`."""
    begin = clumps.begin
    for c in range(begin.shape[0] - 1):
        sum_clump(grains.place, loads, clumps.grain, clumps.blocks[c // BLOCK], np.int64(c % BLOCK), begin[c], begin[c + 1])


@lean_jit
def place_members(grains, clumps):
    """As `dem.clumps.motion.place_members`."""
    begin, fastest2 = clumps.begin, 0.0
    for c in range(begin.shape[0] - 1):
        values, q = clumps.blocks[c // BLOCK], np.int64(c % BLOCK)
        of_clump = place_clump(grains.place, grains.motion, clumps.grain, values, q, begin[c], begin[c + 1], clumps.arm)
        fastest2 = max(fastest2, of_clump)
    return math.sqrt(fastest2)
