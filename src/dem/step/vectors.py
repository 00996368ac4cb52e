"""Gather, scatter and integrate as explicit vector code: the one place beyond plain numba.

A compiler does not vectorise access to records at scattered places. Here LANES contacts (or grains) are handled at a time: each
record is loaded whole, and a transpose in registers turns records into the rows that `dem.contact.stage` works on, or back.
Same signatures and meaning as the plain twins in `dem.step.gather` and `dem.step.motion`; tests compare the two.
LLVM translates the fixed vector lengths to what the processor has. Lane patterns are written for x86's 128-bit lanes. Vectors have
256 bits, as records have: of 512 bits they would have to be put together of two, which takes longer than what it saves (Zen 4).
"""

import math

import numpy as np
from llvmlite import ir

from dem.jit import cgutils, exact_jit, inline_jit, intrinsic, lean_jit, types
from dem.layout import APPROACH as APPROACH_ROW
from dem.layout import BLOCK, FORCE, FREE, INVERSE_MASS, LOAD, MOTION, PLACE, RESISTANCE, SPEEDS, TWIST, TWIST_J, UX, U
from dem.step import gather, motion

LANES = 8
#: Number of grains integrated in parallel lanes, and number of such groups per call.
GROUP, GROUPS_AT_ONCE = 4, 8
TINY = 1e-30

#: What LLVM may assume of a single operation, where the function around it keeps the order of its sums.
FAST = ("fast",)

DOUBLE, INT32, INT64 = ir.DoubleType(), ir.IntType(32), ir.IntType(64)
BYTES = {"float": 4, "double": 8}

#: What a motion record (v, zero, u, zero) becomes in a pair: v_i - v_j, u_i + u_j.
APPROACH = [-1.0, -1.0, -1.0, 0.0, 1.0, 1.0, 1.0, 0.0]
#: What a place record (x, y, z, radius) becomes: x_i - x_j, r_i + r_j.
SEPARATION = [-1.0, -1.0, -1.0, 1.0]
#: A load record (F, zero, Q, resistance) of grain i as grain j feels it.
REACTION = [-1.0, -1.0, -1.0, 0.0, 1.0, 1.0, 1.0, 1.0]
#: What changes a motion record per load, inverse mass and time step: 2/5 m du/dt = Q. The last is the most that brakes the spin.
KICK = [1.0, 1.0, 1.0, 0.0, 2.5, 2.5, 2.5, -2.5]


class Emitter:
    """Short names for what the intrinsics emit: all vectors are LLVM values, all offsets count elements."""

    def __init__(self, context, builder, signature, args):
        self.context, self.b, self.types, self.args = context, builder, signature.args, args

    def array(self, k):
        """Data pointer and element type of argument k."""
        array = self.context.make_array(self.types[k])(self.context, self.b, self.args[k])
        return array.data, self.context.get_data_type(self.types[k].dtype)

    def _pointer(self, array, offset, vector_type):
        data, element = array
        return self.b.bitcast(self.b.gep(self.b.bitcast(data, element.as_pointer()), [offset]), vector_type.as_pointer())

    def load(self, array, offset, count):
        """`count` elements from an offset."""
        vector_type = ir.VectorType(array[1], count)
        return self.b.load(self._pointer(array, offset, vector_type), align=BYTES[str(array[1])])

    def store(self, array, offset, vector):
        """Put a vector at an offset."""
        self.b.store(vector, self._pointer(array, offset, vector.type), align=BYTES[str(array[1])])

    def number(self, array, q, c):
        """The integer at q + c of an array."""
        number = self.b.load(self.b.gep(array[0], [self.at(q, c)]))
        return number if number.type == INT64 else self.b.zext(number, INT64)

    def start(self, number, length):
        """Offset of the record of that number among records of `length` values."""
        return self.b.mul(number, ir.Constant(INT64, length))

    def record(self, array, number, length):
        """The whole record of that number."""
        return self.load(array, self.start(number, length), length)

    def at(self, offset, extra):
        """Offset plus a constant."""
        return self.b.add(offset, ir.Constant(INT64, extra))

    def constant(self, values, element=DOUBLE):
        """A vector of numbers."""
        return ir.Constant(ir.VectorType(element, len(values)), list(values))

    def pick(self, x, y, lanes):
        """Vector of the given lanes of x followed by y."""
        return self.b.shuffle_vector(x, y, self.constant(list(lanes), INT32))

    def spread(self, x, lane, count):
        """Vector of `count` copies of one lane."""
        return self.pick(x, x, [lane] * count)

    def call(self, name, *vectors, fast=()):
        """A vector function of LLVM."""
        kind = vectors[0].type
        full_name = f"llvm.{name}.v{kind.count}f{8 * BYTES[str(kind.element)]}"
        function = cgutils.get_or_insert_function(self.b.module, ir.FunctionType(kind, [kind] * len(vectors)), full_name)
        return self.b.call(function, vectors, fastmath=fast)

    def fma(self, x, y, z):
        """Return x y + z."""
        return self.call("fma", x, y, z)

    def narrow(self, x, element):
        """Convert to the contact precision."""
        return x if x.type.element == element else self.b.fptrunc(x, ir.VectorType(element, x.type.count))

    def widen(self, x):
        """Convert to double."""
        return x if x.type.element == DOUBLE else self.b.fpext(x, ir.VectorType(DOUBLE, x.type.count))

    def padded_axes(self, k):
        """The three numbers of array argument k and five zeros."""
        values = self.load(self.array(k), ir.Constant(INT64, 0), 2), self.load(self.array(k), ir.Constant(INT64, 2), 1)
        three = self.concatenate(values[0], self.pick(values[1], values[1], [0, 0]))
        wide = self.concatenate(three, three)
        return self.pick(wide, self.constant([0.0] * 8), [0, 1, 2] + [8] * 5)

    def concatenate(self, x, y):
        """Put y behind x."""
        return self.pick(x, y, range(2 * x.type.count))

    def transpose_lanes(self, r):
        """4 vectors of m lanes of four: the 4 x 4 blocks that the lanes of one number make, transposed."""
        n = r[0].type.count

        def unpack(x, y, first):
            return self.pick(x, y, [lane + k + n * s for lane in range(0, n, 4) for k in (first, first + 1) for s in (0, 1)])

        def join(x, y, first):
            return self.pick(x, y, [lane + k + n * s for lane in range(0, n, 4) for s in (0, 1) for k in (first, first + 1)])

        low, high = unpack(r[0], r[1], 0), unpack(r[0], r[1], 2)
        low_2, high_2 = unpack(r[2], r[3], 0), unpack(r[2], r[3], 2)
        return [join(low, low_2, 0), join(low, low_2, 2), join(high, high_2, 0), join(high, high_2, 2)]

    def transpose(self, records):
        """8 vectors of 8, seen as a matrix, transposed."""
        first, second = self.transpose_lanes(records[:4]), self.transpose_lanes(records[4:])
        low, high = ([t + 8 * s + k for s in (0, 1) for k in range(4)] for t in (0, 4))
        return [self.pick(x, y, lanes) for lanes in (low, high) for x, y in zip(first, second, strict=True)]

    def fours_to_rows(self, fours):
        """8 vectors of 4 -> 4 vectors of 8."""
        return self.transpose_lanes([self.concatenate(fours[k], fours[k + 4]) for k in range(4)])

    def transpose_places(self, p):
        """4 vectors of 4 doubles, seen as a matrix, transposed."""
        xz = [self.pick(p[k], p[k + 1], [0, 4, 2, 6]) for k in (0, 2)]
        yr = [self.pick(p[k], p[k + 1], [1, 5, 3, 7]) for k in (0, 2)]
        low, high = [0, 1, 4, 5], [2, 3, 6, 7]
        return self.pick(*xz, low), self.pick(*yr, low), self.pick(*xz, high), self.pick(*yr, high)


def emit_gather(e, spins, period=None, frequency=None):
    """Emit the gather of LANES pairs; arguments (place, motion, first, second, q, b). spins: the spin velocities of j too."""
    place, motion, first, second, buffer = e.array(0), e.array(1), e.array(2), e.array(3), e.array(5)
    q, element = e.args[4], buffer[1]
    separations, approaches, second_spins = [], [], []
    for c in range(LANES):
        i, j = e.number(first, q, c), e.number(second, q, c)
        separations.append(e.fma(e.record(place, j, PLACE), e.constant(SEPARATION), e.record(place, i, PLACE)))
        approaches.append(e.fma(e.record(motion, j, MOTION), e.constant(APPROACH, element), e.record(motion, i, MOTION)))
        second_spins.append(e.load(motion, e.at(e.start(j, MOTION), UX), MOTION - UX))
    for h in range(0, LANES, PLACE):
        *axes, R_sum = e.transpose_places(separations[h : h + PLACE])
        if period:
            axes = [nearest_image(e, x, period[a], frequency[a]) for a, x in enumerate(axes)]
        gap = e.b.fmul(R_sum, R_sum)
        for x in axes:
            gap = e.fma(e.b.fneg(x), x, gap)
        for r, row in enumerate((*axes, gap)):
            e.store(buffer, e.at(q, r * BLOCK + h), e.narrow(row, element))
    rows = speed_rows(e, approaches)
    if spins:
        rows += e.fours_to_rows(second_spins)[:3]
    for r, row in enumerate(rows):
        e.store(buffer, e.at(q, (APPROACH_ROW + r) * BLOCK), row)


def speed_rows(e, records):
    """Velocity and spin velocity of LANES motion records as six rows."""
    rows = e.transpose(records)
    return [rows[t] for t in SPEEDS]


def emit_gather_at_surface(e):
    """Emit the gather of LANES grains near a wall; arguments (place, motion, first, velocity, q, b, places)."""
    place, motion, first, q, buffer, places = e.array(0), e.array(1), e.array(2), e.args[4], e.array(5), e.array(6)
    v_wall = e.padded_axes(3)
    leading = e.narrow(v_wall, buffer[1])
    rest = e.narrow(e.b.fsub(v_wall, e.widen(leading)), buffer[1])
    centres, approaches = [], []
    for c in range(LANES):
        i = e.number(first, q, c)
        centres.append(e.record(place, i, PLACE))
        approaches.append(e.b.fsub(e.b.fsub(e.record(motion, i, MOTION), leading), rest))
    for h in range(0, LANES, PLACE):
        for r, row in enumerate(e.transpose_places(centres[h : h + PLACE])):
            e.store(places, e.at(q, r * BLOCK + h), row)
    for r, row in enumerate(speed_rows(e, approaches)):
        e.store(buffer, e.at(q, (APPROACH_ROW + r) * BLOCK), row)


def nearest_image(e, x, period, frequency):
    """As `dem.grid.nearest_image`."""
    return e.fma(e.b.fneg(period), e.call("rint", e.b.fmul(x, frequency)), x)


def load_records(e, buffer, q, twist):
    """Load records of LANES contacts from slot q on, as vectors of 8; Q stands in row `twist`."""
    force, q_rows = ([e.load(buffer, e.at(q, r * BLOCK), LANES) for r in range(first, first + 3)] for first in (FORCE, twist))
    resistance = e.load(buffer, e.at(q, RESISTANCE * BLOCK), LANES)
    return e.transpose([*force, e.constant([0.0] * LANES, buffer[1]), *q_rows, resistance])


def emit_scatter_at_surface(e):
    """Emit the scatter of LANES wall contacts; arguments (loads, first, q, b)."""
    loads, first, q, buffer = e.array(0), e.array(1), e.args[2], e.array(3)
    for c, record in enumerate(load_records(e, buffer, q, TWIST)):
        i = e.start(e.number(first, q, c), LOAD)
        e.store(loads, i, e.b.fadd(e.load(loads, i, LOAD), record))


def emit_scatter(e, spins):
    """Emit the scatter of LANES pairs; arguments (loads, first, second, q, b). spins: Q on j is not that on i."""
    loads, first, second, buffer = e.array(0), e.array(1), e.array(2), e.array(4)
    q = e.args[3]
    on_i = load_records(e, buffer, q, TWIST)
    on_j = load_records(e, buffer, q, TWIST_J) if spins else on_i
    sign = e.constant(REACTION, buffer[1])
    for c in range(LANES):
        i, j = (e.start(e.number(numbers, q, c), LOAD) for numbers in (first, second))
        e.store(loads, i, e.b.fadd(e.load(loads, i, LOAD), on_i[c]))
        e.store(loads, j, e.fma(on_j[c], sign, e.load(loads, j, LOAD)))


@intrinsic
def prefetch_line(typing, array, index):
    """Prefetch the cache line of an element into the second-level cache."""

    def generate(context, builder, signature, args):
        pointer = builder.gep(Emitter(context, builder, signature, args).array(0)[0], [args[1]])
        byte = ir.IntType(8).as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [byte, INT32, INT32, INT32])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0i8")
        to_read, second_level, data = (ir.Constant(INT32, k) for k in (0, 2, 1))
        builder.call(function, [builder.bitcast(pointer, byte), to_read, second_level, data])
        return context.get_dummy_value()

    return types.void(array, index), generate


@intrinsic
def gather_lanes_direct(typing, place, motion, first, second, q, b, spins):
    """Gather LANES pairs from slot q on."""

    def generate(context, builder, signature, args):
        emit_gather(Emitter(context, builder, signature, args), spins != types.none)
        return context.get_dummy_value()

    return types.void(place, motion, first, second, q, b, spins), generate


@intrinsic
def gather_lanes_at_surface(typing, place, motion, first, velocity, q, b, places):
    """Gather LANES grains that may touch a wall of this velocity."""

    def generate(context, builder, signature, args):
        emit_gather_at_surface(Emitter(context, builder, signature, args))
        return context.get_dummy_value()

    return types.void(place, motion, first, velocity, q, b, places), generate


def spread_axes(e, k):
    """The three numbers of array argument k, each spread over a vector."""
    values = e.load(e.array(k), ir.Constant(INT64, 0), 2), e.load(e.array(k), ir.Constant(INT64, 2), 1)
    return [e.spread(values[0], 0, 4), e.spread(values[0], 1, 4), e.spread(values[1], 0, 4)]


@intrinsic
def gather_lanes_periodic(typing, place, motion, first, second, q, b, period, frequency, spins):
    """Gather LANES pairs by nearest image."""

    def generate(context, builder, signature, args):
        e = Emitter(context, builder, signature, args)
        emit_gather(e, spins != types.none, spread_axes(e, 6), spread_axes(e, 7))
        return context.get_dummy_value()

    return types.void(place, motion, first, second, q, b, period, frequency, spins), generate


@intrinsic
def scatter_lanes(typing, loads, first, second, q, b, spins):
    """Scatter the loads of LANES pairs from slot q on."""

    def generate(context, builder, signature, args):
        emit_scatter(Emitter(context, builder, signature, args), spins != types.none)
        return context.get_dummy_value()

    return types.void(loads, first, second, q, b, spins), generate


@intrinsic
def scatter_lanes_at_surface(typing, loads, first, q, b):
    """Scatter the loads of LANES wall contacts to their grains from slot q on."""

    def generate(context, builder, signature, args):
        emit_scatter_at_surface(Emitter(context, builder, signature, args))
        return context.get_dummy_value()

    return types.void(loads, first, q, b), generate


@intrinsic
def integrate_group(typing, place, motion, remainder, loads, which, gravity, dt, k):
    """Advance GROUP grains, which[k] and the next ones; returns the largest squared share of an allowance that is used up."""

    def generate(context, builder, signature, args):
        return emit_integrate(Emitter(context, builder, signature, args), 1)

    return types.float64(place, motion, remainder, loads, which, gravity, dt, k), generate


@intrinsic
def integrate_groups(typing, place, motion, remainder, loads, which, gravity, dt, k):
    """As `integrate_group`, GROUPS_AT_ONCE times."""

    def generate(context, builder, signature, args):
        return emit_integrate(Emitter(context, builder, signature, args), GROUPS_AT_ONCE)

    return types.float64(place, motion, remainder, loads, which, gravity, dt, k), generate


class Advance:
    """One step of group after group of GROUP grains; see `dem.step.motion.integrate`.

    Resistance against spin is a long chain of dependent operations. A group is pulled before the previous group is moved, so that
    the two chains overlap; the processor's instruction window is too short to overlap them by itself.
    """

    def __init__(self, e):
        self.e = e
        self.place, self.motion, self.remainder, self.loads, self.which = (e.array(k) for k in range(5))
        self.element = self.loads[1]
        step = spread_scalar(e, e.args[6], MOTION)
        self.fall = e.narrow(e.b.fmul(e.padded_axes(5), step), self.element)
        self.kick = e.narrow(e.b.fmul(step, e.constant(KICK)), self.element)
        self.step = e.b.fmul(e.pick(step, step, range(PLACE)), e.constant([1.0, 1.0, 1.0, 0.0]))
        self.nothing = e.constant([0.0] * MOTION, self.element)
        self.brake_ends = e.constant([0.0] * (MOTION - 1) + [-1.0], self.element)  # passes the resistance through
        self.largest2 = e.constant([0.0] * MOTION, self.element)

    def pull(self, g):
        """Return numbers, velocity increments, unbraked velocities and braking factors (negative) of the grains of group g."""
        e = self.e
        numbers = [e.number(self.which, e.args[7], g * GROUP + c) for c in range(GROUP)]
        changes, unbraked = [], []
        for number in numbers:
            rest, load = e.record(self.remainder, number, MOTION), e.record(self.loads, number, LOAD)
            left = e.pick(rest, self.nothing, [0, 1, 2, 8, 4, 5, 6, 8])
            left = e.fma(e.spread(rest, FREE, MOTION), self.fall, left)
            changes.append(e.fma(load, e.b.fmul(e.spread(rest, INVERSE_MASS, MOTION), self.kick), left))
            unbraked.append(e.b.fadd(e.record(self.motion, number, MOTION), changes[-1]))
        x, y, z, resist = e.transpose_lanes(unbraked)  # of v, `USE` and of u, resistance
        speed2 = e.constant([TINY] * MOTION, self.element)
        for axis in (x, y, z):
            speed2 = e.fma(axis, axis, speed2)
        share = e.b.fdiv(resist, e.call("sqrt", speed2, fast=FAST), flags=FAST)
        share = e.call("maxnum", share, e.constant([-1.0] * MOTION, self.element), fast=FAST)
        used2 = e.b.fmul(e.b.fmul(speed2, resist), resist)
        self.largest2 = e.call("maxnum", self.largest2, used2, fast=FAST)
        return numbers, changes, unbraked, share

    def move(self, numbers, changes, unbraked, share):
        """Brake the spin, round, move, and clear the loads."""
        e = self.e
        for c, number in enumerate(numbers):
            brake = e.pick(share, self.brake_ends, [8, 8, 8, 8, UX + c, UX + c, UX + c, 15])
            before, rest = e.record(self.motion, number, MOTION), e.record(self.remainder, number, MOTION)
            change = e.fma(brake, unbraked[c], changes[c])
            after = e.b.fadd(before, change)
            rounded_off = e.b.fsub(change, e.b.fsub(after, before))
            e.store(self.motion, e.start(number, MOTION), after)
            e.store(self.remainder, e.start(number, MOTION), e.pick(rounded_off, rest, [0, 1, 2, 11, 4, 5, 6, 15]))
            e.store(self.loads, e.start(number, LOAD), self.nothing)
            at = e.start(number, PLACE)
            velocity = e.widen(e.pick(after, after, range(PLACE)))
            e.store(self.place, at, e.fma(velocity, self.step, e.load(self.place, at, PLACE)))


def emit_integrate(e, n_groups):
    """Emit one step of n_groups groups of grains."""
    advance, pulled = Advance(e), []
    for g in range(n_groups + 1):
        if g < n_groups:
            pulled.append(advance.pull(g))
        if g >= 1:
            advance.move(*pulled[g - 1])
    return largest(e, e.pick(advance.largest2, advance.largest2, [0, 1, 2, 3]))


def undefined(count):
    """A vector whose lanes do not matter."""
    return ir.Constant(ir.VectorType(DOUBLE, count), ir.Undefined)


def spread_scalar(e, value, count):
    """Vector of `count` copies of a number."""
    return e.spread(e.b.insert_element(undefined(count), value, ir.Constant(INT32, 0)), 0, count)


def largest(e, vector):
    """Largest lane as a double."""
    while vector.type.count > 1:
        half = vector.type.count // 2
        vector = e.call("maxnum", e.pick(vector, vector, range(half)), e.pick(vector, vector, range(half, 2 * half)))
    value = e.b.extract_element(vector, ir.Constant(INT32, 0))
    return value if vector.type.element == DOUBLE else e.b.fpext(value, DOUBLE)


@lean_jit
def prefetch(grains, loads, which):
    """Prefetch the records of the grains of the numbers `which`, array by array: most are neighbours in memory."""
    for k in range(which.shape[0]):
        prefetch_line(grains.place, np.uint64(which[k]) * U[PLACE])
    for k in range(which.shape[0]):
        prefetch_line(grains.motion, np.uint64(which[k]) * U[MOTION])
    for k in range(which.shape[0]):
        prefetch_line(loads, np.uint64(which[k]) * U[LOAD])


@inline_jit
def gather_lanes(grains, first, second, q, b, images, spins):
    """Gather LANES pairs from slot q on."""
    if images is None:
        gather_lanes_direct(grains.place, grains.motion, first, second, q, b, spins)
    else:
        gather_lanes_periodic(grains.place, grains.motion, first, second, q, b, images.length, images.frequency, spins)


@lean_jit
def gather_pairs(grains, first, second, n, b, access):
    """As `dem.step.gather.gather_pairs`."""
    whole = n - n % LANES
    for q in range(0, whole, LANES):
        gather_lanes(grains, first, second, q, b, access.images, access.spins)
    gather.gather_pairs(grains, first[whole:], second[whole:], n - whole, b[whole:], access)


@inline_jit
def gather_at_surface(grains, velocity, first, n, b, places):
    """As `dem.step.gather.gather_at_surface`."""
    whole = n - n % LANES
    for q in range(0, whole, LANES):
        gather_lanes_at_surface(grains.place, grains.motion, first, velocity, q, b, places)
    gather.gather_at_surface(grains, velocity, first[whole:], n - whole, b[whole:], places[whole:])


@inline_jit
def scatter_at_surface(loads, first, n, b):
    """As `dem.step.gather.scatter_at_surface`."""
    whole = n - n % LANES
    for q in range(0, whole, LANES):
        scatter_lanes_at_surface(loads, first, q, b)
    gather.scatter_at_surface(loads, first[whole:], n - whole, b[whole:])


@lean_jit
def scatter_pairs(loads, first, second, n, b, spins):
    """As `dem.step.gather.scatter_pairs`."""
    whole = n - n % LANES
    for q in range(0, whole, LANES):
        scatter_lanes(loads, first, second, q, b, spins)
    gather.scatter_pairs(loads, first[whole:], second[whole:], n - whole, b[whole:], spins)


@exact_jit
def integrate(grains, loads, which, gravity, dt, zero):
    """As `dem.step.motion.integrate`."""
    n = which.shape[0]
    many, whole = n - n % (GROUP * GROUPS_AT_ONCE), n - n % GROUP
    largest2 = 0.0
    for k in range(0, many, GROUP * GROUPS_AT_ONCE):
        largest2 = max(largest2, integrate_groups(grains.place, grains.motion, grains.remainder, loads, which, gravity, dt, k))
    for k in range(many, whole, GROUP):
        largest2 = max(largest2, integrate_group(grains.place, grains.motion, grains.remainder, loads, which, gravity, dt, k))
    return max(math.sqrt(largest2), motion.integrate(grains, loads, which[whole:], gravity, dt, zero))
