"""Gather, scatter and integrate as explicit vector code: the one place beyond plain numba.

A compiler does not vectorise access to records at scattered places. Here LANES contacts (or grains) are handled at a time: each
record is loaded whole, and a transpose in registers turns records into the rows that `dem.contact.block` works on, or back.
Same signatures and meaning as the plain twins in `dem.pairs` and `dem.motion`; tests compare the two.
LLVM translates the fixed vector lengths to what the processor has. Lane patterns are written for x86's 128-bit lanes.
"""

import math

from llvmlite import ir

from dem import motion, pairs
from dem.jit import cgutils, intrinsic, lean_jit, types
from dem.layout import BLOCK, FORCE, FREE, GRAIN, INVERSE_MASS, LOAD, RESIST, RESISTANCE, TWIST, TWIST_J, UX, VX

LANES = 16
TINY = 1e-30

DOUBLE, INT32, INT64 = ir.DoubleType(), ir.IntType(32), ir.IntType(64)
BYTES = {"float": 4, "double": 8}

#: What the velocity half of a record (v, u, 1/m, free) becomes in a pair: v_i - v_j, u_i + u_j.
APPROACH = [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 0.0, 0.0]
#: Position half (x, y, z, radius): x_i - x_j, r_i + r_j.
SEPARATION = [-1.0, -1.0, -1.0, 1.0]
#: A load record (F, Q, resistance) of grain i as grain j feels it.
REACTION = [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0, 0.0]


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

    def index(self, array, q, c, record):
        """Offset of the record whose number stands at q + c in an array of integers."""
        number = self.b.load(self.b.gep(array[0], [self.at(q, c)]))
        number = number if number.type == INT64 else self.b.zext(number, INT64)
        return self.b.mul(number, ir.Constant(INT64, record))

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

    def call(self, name, *vectors):
        """A vector function of LLVM."""
        kind = vectors[0].type
        full_name = f"llvm.{name}.v{kind.count}f{8 * BYTES[str(kind.element)]}"
        function = cgutils.get_or_insert_function(self.b.module, ir.FunctionType(kind, [kind] * len(vectors)), full_name)
        return self.b.call(function, vectors)

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
        """4 vectors of 16, seen as four lanes of four: transpose the 4 x 4 block of every lane."""

        def unpack(x, y, first):
            return self.pick(x, y, [4 * lane + k + 16 * s for lane in range(4) for k in (first, first + 1) for s in (0, 1)])

        def join(x, y, first):
            return self.pick(x, y, [4 * lane + k + 16 * s for lane in range(4) for s in (0, 1) for k in (first, first + 1)])

        low, high = unpack(r[0], r[1], 0), unpack(r[0], r[1], 2)
        low_2, high_2 = unpack(r[2], r[3], 0), unpack(r[2], r[3], 2)
        return [join(low, low_2, 0), join(low, low_2, 2), join(high, high_2, 0), join(high, high_2, 2)]

    def records_to_rows(self, records):
        """16 vectors of 8 -> 8 vectors of 16."""
        halves = [self.transpose_lanes([self.concatenate(e[c], e[c + 4]) for c in range(4)]) for e in (records[:8], records[8:])]

        def gather(k, lanes):
            return self.pick(
                halves[0][k], halves[1][k], [4 * lane + t + 16 * s for s in (0, 1) for lane in lanes for t in range(4)]
            )

        return [gather(k, (0, 2)) for k in range(4)] + [gather(k, (1, 3)) for k in range(4)]

    def rows_to_records(self, rows):
        """8 vectors of 16 -> 16 vectors of 8."""
        upper, lower = self.transpose_lanes(rows[:4]), self.transpose_lanes(rows[4:])
        return [
            self.pick(upper[c % 4], lower[c % 4], [4 * (c // 4) + k + 16 * s for s in (0, 1) for k in range(4)]) for c in range(16)
        ]

    def places_to_rows(self, places):
        """8 vectors of 4 -> 4 vectors of 8."""
        wide = [self.concatenate(places[k], places[k + 2]) for k in (0, 1, 4, 5)]
        even, odd = [0, 8, 2, 10, 4, 12, 6, 14], [1, 9, 3, 11, 5, 13, 7, 15]
        xz, yr = ([self.pick(wide[k], wide[k + 1], lanes) for k in (0, 2)] for lanes in (even, odd))
        first, second = [0, 1, 4, 5, 8, 9, 12, 13], [2, 3, 6, 7, 10, 11, 14, 15]
        return (
            self.pick(*xz, first),
            self.pick(*yr, first),
            self.pick(*xz, second),
            self.pick(*yr, second),
        )


def emit_gather(e, period=None, frequency=None):
    """Emit the gather of LANES pairs; arguments (grains, first, second, q, b)."""
    grains, first, second, buffer = e.array(0), e.array(1), e.array(2), e.array(4)
    q, element = e.args[3], buffer[1]
    places, approaches = [], []
    for c in range(LANES):
        i, j = e.index(first, q, c, GRAIN), e.index(second, q, c, GRAIN)
        places.append(e.fma(e.load(grains, j, 4), e.constant(SEPARATION), e.load(grains, i, 4)))
        v_i, v_j = e.load(grains, e.at(i, VX), 8), e.load(grains, e.at(j, VX), 8)
        approaches.append(e.narrow(e.fma(v_j, e.constant(APPROACH), v_i), element))
    halves = []
    for h in (0, 8):
        *axes, R_sum = e.places_to_rows(places[h : h + 8])
        if period:
            axes = [nearest_image(e, x, period[a], frequency[a]) for a, x in enumerate(axes)]
        gap = e.b.fmul(R_sum, R_sum)
        for x in axes:
            gap = e.fma(e.b.fneg(x), x, gap)
        halves.append([e.narrow(row, element) for row in (*axes, gap)])
    rows = [e.concatenate(low, high) for low, high in zip(*halves, strict=True)] + e.records_to_rows(approaches)[:6]
    for r, row in enumerate(rows):
        e.store(buffer, e.at(q, r * BLOCK), row)


def emit_gather_rolling(e):
    """Emit the gather of u_i - u_j; arguments as for `emit_gather`."""
    grains, first, second, buffer = e.array(0), e.array(1), e.array(2), e.array(4)
    q, differences = e.args[3], []
    for c in range(LANES):
        i, j = e.index(first, q, c, GRAIN), e.index(second, q, c, GRAIN)
        differences.append(e.b.fsub(e.load(grains, e.at(i, UX), 4), e.load(grains, e.at(j, UX), 4)))
    low, high = e.places_to_rows(differences[:8]), e.places_to_rows(differences[8:])
    for t in range(3):
        row = e.concatenate(e.narrow(low[t], buffer[1]), e.narrow(high[t], buffer[1]))
        e.store(buffer, e.at(q, (10 + t) * BLOCK), row)


def emit_gather_at_wall(e):
    """Emit the gather of LANES grains near a wall; arguments (grains, first, velocity, q, b, places)."""
    grains, first, q, buffer, places = e.array(0), e.array(1), e.args[3], e.array(4), e.array(5)
    v_wall = e.padded_axes(2)
    centres, approaches = [], []
    for c in range(LANES):
        i = e.index(first, q, c, GRAIN)
        centres.append(e.load(grains, i, 4))
        approaches.append(e.narrow(e.b.fsub(e.load(grains, e.at(i, VX), 8), v_wall), buffer[1]))
    for h in (0, 8):
        for r, row in enumerate(e.places_to_rows(centres[h : h + 8])):
            e.store(places, e.at(q, r * BLOCK + h), row)
    for r, row in enumerate(e.records_to_rows(approaches)[:6]):
        e.store(buffer, e.at(q, (4 + r) * BLOCK), row)


def nearest_image(e, x, period, frequency):
    """As `dem.neighbours.nearest_image`."""
    return e.fma(e.b.fneg(period), e.call("rint", e.b.fmul(x, frequency)), x)


def load_records(e, buffer, q, twist):
    """Load records of LANES contacts from slot q on, as vectors of 8; Q stands in row `twist`."""
    rows = [e.load(buffer, e.at(q, r * BLOCK), LANES) for first in (FORCE, twist) for r in range(first, first + 3)]
    rows.append(e.load(buffer, e.at(q, RESISTANCE * BLOCK), LANES))
    return e.rows_to_records([*rows, e.constant([0.0] * LANES, buffer[1])])


def emit_scatter_at_wall(e):
    """Emit the scatter of LANES wall contacts; arguments (loads, first, q, b)."""
    loads, first, q, buffer = e.array(0), e.array(1), e.args[2], e.array(3)
    for c, record in enumerate(load_records(e, buffer, q, TWIST)):
        i = e.index(first, q, c, LOAD)
        e.store(loads, i, e.b.fadd(e.load(loads, i, 8), record))


def emit_scatter(e, own_twist_of_j):
    """Emit the scatter of LANES pairs; arguments (loads, first, second, q, b). own_twist_of_j: Q on j is not that on i."""
    loads, first, second, buffer = e.array(0), e.array(1), e.array(2), e.array(4)
    q = e.args[3]
    on_i = load_records(e, buffer, q, TWIST)
    on_j = load_records(e, buffer, q, TWIST_J) if own_twist_of_j else on_i
    sign = e.constant(REACTION, buffer[1])
    for c in range(LANES):
        i, j = e.index(first, q, c, LOAD), e.index(second, q, c, LOAD)
        e.store(loads, i, e.b.fadd(e.load(loads, i, 8), on_i[c]))
        e.store(loads, j, e.fma(on_j[c], sign, e.load(loads, j, 8)))


@intrinsic
def gather_lanes(typing, grains, first, second, q, b):
    """Gather LANES pairs from slot q on."""

    def generate(context, builder, signature, args):
        emit_gather(Emitter(context, builder, signature, args))
        return context.get_dummy_value()

    return types.void(grains, first, second, q, b), generate


@intrinsic
def gather_lanes_at_wall(typing, grains, first, velocity, q, b, places):
    """Gather LANES grains that may touch a wall of this velocity."""

    def generate(context, builder, signature, args):
        emit_gather_at_wall(Emitter(context, builder, signature, args))
        return context.get_dummy_value()

    return types.void(grains, first, velocity, q, b, places), generate


@intrinsic
def gather_lanes_rolling(typing, grains, first, second, q, b):
    """Gather the difference of spin velocities of LANES pairs."""

    def generate(context, builder, signature, args):
        emit_gather_rolling(Emitter(context, builder, signature, args))
        return context.get_dummy_value()

    return types.void(grains, first, second, q, b), generate


def spread_axes(e, k):
    """The three numbers of array argument k, each spread over a vector."""
    values = e.load(e.array(k), ir.Constant(INT64, 0), 2), e.load(e.array(k), ir.Constant(INT64, 2), 1)
    return [e.spread(values[0], 0, 8), e.spread(values[0], 1, 8), e.spread(values[1], 0, 8)]


@intrinsic
def gather_lanes_periodic(typing, grains, first, second, q, b, period, frequency):
    """Gather LANES pairs by nearest image."""

    def generate(context, builder, signature, args):
        e = Emitter(context, builder, signature, args)
        emit_gather(e, spread_axes(e, 5), spread_axes(e, 6))
        return context.get_dummy_value()

    return types.void(grains, first, second, q, b, period, frequency), generate


@intrinsic
def scatter_lanes(typing, loads, first, second, q, b):
    """Scatter the loads of LANES pairs from slot q on."""

    def generate(context, builder, signature, args):
        emit_scatter(Emitter(context, builder, signature, args), own_twist_of_j=False)
        return context.get_dummy_value()

    return types.void(loads, first, second, q, b), generate


@intrinsic
def scatter_lanes_rolling(typing, loads, first, second, q, b):
    """Scatter the loads of LANES pairs whose torques differ on i and j."""

    def generate(context, builder, signature, args):
        emit_scatter(Emitter(context, builder, signature, args), own_twist_of_j=True)
        return context.get_dummy_value()

    return types.void(loads, first, second, q, b), generate


@intrinsic
def scatter_lanes_at_wall(typing, loads, first, q, b):
    """Scatter the loads of LANES wall contacts to their grains from slot q on."""

    def generate(context, builder, signature, args):
        emit_scatter_at_wall(Emitter(context, builder, signature, args))
        return context.get_dummy_value()

    return types.void(loads, first, q, b), generate


@intrinsic
def integrate_lanes(typing, grains, loads, which, gravity, dt, k):
    """Advance LANES grains, which[k] and the next ones; returns their largest squared speed."""

    def generate(context, builder, signature, args):
        return emit_integrate(Emitter(context, builder, signature, args))

    return types.float64(grains, loads, which, gravity, dt, k), generate


def emit_integrate(e):
    """Emit one step of LANES grains; see `dem.motion.integrate`."""
    grains, loads, which = e.array(0), e.array(1), e.array(2)
    element = loads[1]
    step, k = spread_scalar(e, e.args[4], 8), e.args[5]
    nothing = e.constant([0.0] * 8)
    fall = e.b.fmul(e.padded_axes(3), step)
    twist = e.b.fmul(step, e.constant([1.0, 1.0, 1.0, 2.5, 2.5, 2.5, 2.5, 0.0]))
    offsets, moved, seen = [], [], []
    for c in range(LANES):
        grain, load = e.index(which, k, c, GRAIN), e.index(which, k, c, LOAD)
        offsets.append(grain)
        m = e.load(grains, e.at(grain, VX), 8)
        impulse = e.b.fmul(e.widen(e.load(loads, load, 8)), e.b.fmul(e.spread(m, INVERSE_MASS - VX, 8), twist))
        change = e.fma(e.spread(m, FREE - VX, 8), fall, e.pick(impulse, nothing, [0, 1, 2, 3, 4, 5, 8, 8]))
        m = e.b.fadd(m, change)
        moved.append(m)
        seen.append(e.narrow(e.pick(m, impulse, [0, 1, 2, 3, 4, 5, 8 + RESIST, 7]), element))
        e.store(loads, load, e.constant([0.0] * 8, element))
    rows = e.records_to_rows(seen)
    speed2 = e.b.fmul(rows[0], rows[0])
    spin2 = e.fma(rows[3], rows[3], e.constant([TINY] * LANES, element))
    for t in (1, 2):
        speed2 = e.fma(rows[t], rows[t], speed2)
        spin2 = e.fma(rows[3 + t], rows[3 + t], spin2)
    keep = e.b.fsub(e.constant([1.0] * LANES, element), e.b.fdiv(rows[RESIST], e.call("sqrt", spin2)))
    keep = e.call("maxnum", keep, e.constant([0.0] * LANES, element))
    ones = e.constant([1.0] * 8)
    for c in range(LANES):
        grain = offsets[c]
        factor = e.pick(e.widen(e.spread(keep, c, 8)), ones, [8, 8, 8, 0, 0, 0, 8, 8])
        m = e.b.fmul(moved[c], factor)
        e.store(grains, e.at(grain, VX), m)
        way = e.pick(m, nothing, [0, 1, 2, 8])
        e.store(grains, grain, e.fma(way, e.pick(step, step, range(4)), e.load(grains, grain, 4)))
    return largest(e, speed2)


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
def gather_pairs(grains, first, second, n, b):
    """As `dem.pairs.gather_pairs`."""
    whole = n - n % LANES
    for q in range(0, whole, LANES):
        gather_lanes(grains, first, second, q, b)
    pairs.gather_pairs(grains, first[whole:], second[whole:], n - whole, b[whole:])


@lean_jit
def gather_periodic_pairs(grains, period, frequency, first, second, n, b):
    """As `dem.pairs.gather_periodic_pairs`."""
    whole = n - n % LANES
    for q in range(0, whole, LANES):
        gather_lanes_periodic(grains, first, second, q, b, period, frequency)
    pairs.gather_periodic_pairs(grains, period, frequency, first[whole:], second[whole:], n - whole, b[whole:])


@lean_jit
def gather_at_wall(grains, velocity, first, n, b, places):
    """As `dem.pairs.gather_at_wall`."""
    whole = n - n % LANES
    for q in range(0, whole, LANES):
        gather_lanes_at_wall(grains, first, velocity, q, b, places)
    pairs.gather_at_wall(grains, velocity, first[whole:], n - whole, b[whole:], places[whole:])


@lean_jit
def scatter_at_wall(loads, first, n, b):
    """As `dem.pairs.scatter_at_wall`."""
    whole = n - n % LANES
    for q in range(0, whole, LANES):
        scatter_lanes_at_wall(loads, first, q, b)
    pairs.scatter_at_wall(loads, first[whole:], n - whole, b[whole:])


@lean_jit
def gather_rolling(grains, first, second, n, b):
    """As `dem.pairs.gather_rolling`."""
    whole = n - n % LANES
    for q in range(0, whole, LANES):
        gather_lanes_rolling(grains, first, second, q, b)
    pairs.gather_rolling(grains, first[whole:], second[whole:], n - whole, b[whole:])


@lean_jit
def scatter_pairs(loads, first, second, n, b):
    """As `dem.pairs.scatter_pairs`."""
    whole = n - n % LANES
    for q in range(0, whole, LANES):
        scatter_lanes(loads, first, second, q, b)
    pairs.scatter_pairs(loads, first[whole:], second[whole:], n - whole, b[whole:])


@lean_jit
def scatter_rolling(loads, first, second, n, b):
    """As `dem.pairs.scatter_rolling`."""
    whole = n - n % LANES
    for q in range(0, whole, LANES):
        scatter_lanes_rolling(loads, first, second, q, b)
    pairs.scatter_rolling(loads, first[whole:], second[whole:], n - whole, b[whole:])


@lean_jit
def integrate(grains, loads, which, gravity, dt, zero):
    """As `dem.motion.integrate`."""
    n = which.shape[0]
    whole = n - n % LANES
    fastest2 = 0.0
    for k in range(0, whole, LANES):
        fastest2 = max(fastest2, integrate_lanes(grains, loads, which, gravity, dt, k))
    return max(math.sqrt(fastest2), motion.integrate(grains, loads, which[whole:], gravity, dt, zero))
