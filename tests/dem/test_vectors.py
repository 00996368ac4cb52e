"""The vector code against its plain twins: same inputs, same outputs within rounding."""

import numpy as np
import pytest
from callers import callable_from_python

from dem.layout import (
    BLOCK,
    BUFFER,
    FREE,
    INVERSE_MASS,
    LOAD,
    MOTION,
    PLACE,
    RADIUS,
    RESIST,
    SECOND_SPIN,
    SPEEDS,
    USE,
    UX,
    VX,
    Access,
    GrainArrays,
    Period,
    aligned_zeros,
)
from dem.step import gather, motion, vectors

PRECISIONS = [np.float32, np.float64]
#: Rows of the work buffer that a scatter reads lie among all of them; a gather writes these.
GATHERED, SECOND_SPINS = range(10), range(SECOND_SPIN, SECOND_SPIN + 3)
#: What stands beside velocities in the remainder record; USE and a zero in the motion record.
BESIDE = [INVERSE_MASS, FREE]


def random_grains(n, seed, precision):
    rng = np.random.default_rng(seed)
    grains = GrainArrays(aligned_zeros(PLACE * n, float), *(aligned_zeros(MOTION * n, precision) for _ in range(2)))
    place, motion, remainder = (values.reshape(n, -1) for values in grains)
    place[:, :3] = rng.uniform(0, 20e-4, (n, 3))
    place[:, RADIUS] = rng.uniform(0.5e-4, 1e-4, n)
    motion[:, SPEEDS] = rng.normal(0, 0.1, (n, 6))
    motion[:, USE] = rng.uniform(0.1, 1.0, n)
    remainder[:, SPEEDS] = rng.uniform(-0.5, 0.5, (n, 6)) * np.spacing(motion[:, SPEEDS])
    remainder[:, INVERSE_MASS] = rng.uniform(1e8, 1e9, n)
    remainder[:, FREE] = 1.0
    remainder[: n // 10, BESIDE] = 0.0  # carried by a wall
    return grains


def velocities(grains):
    """Velocities and spin velocities (n, 6) with all their digits."""
    return (grains.motion.astype(np.longdouble) + grains.remainder).reshape(-1, MOTION)[:, SPEEDS]


def test_a_kernel_for_kernels_refuses_calls_from_python():
    with pytest.raises(TypeError, match="scatter_at_surface is a part of other kernels; allowed: a call from a kernel"):
        vectors.scatter_at_surface(None, None, 0, None)


def random_pairs(n_grains, n_pairs, seed):
    rng = np.random.default_rng(seed)
    first = rng.integers(0, n_grains, n_pairs).astype(np.int32)
    second = (first + rng.integers(1, n_grains, n_pairs)).astype(np.int32) % n_grains
    return first, second.astype(np.int32)


def close(a, b, precision):
    """Equal within a few roundings of the largest value."""
    return np.abs(a - b).max() <= 8 * np.finfo(precision).eps * np.abs(a).max()


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("elastic", [None, True])
@pytest.mark.parametrize("n_pairs", [1, 15, 16, 17, 100, BLOCK])
def test_gather(n_pairs, elastic, precision):
    grains, (first, second) = random_grains(50, 1, precision), random_pairs(50, n_pairs, 2)
    plain, vector = (aligned_zeros(BUFFER * BLOCK, precision) for _ in range(2))
    for module, b in ((gather, plain), (vectors, vector)):
        module.gather_pairs(grains, first, second, n_pairs, b, Access(None, None, elastic))
    for row in GATHERED if elastic is None else (*GATHERED, *SECOND_SPINS):
        a, b = (x.reshape(BUFFER, BLOCK)[row, :n_pairs] for x in (plain, vector))
        assert np.abs(a).max() > 0
        assert close(a, b, precision)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("elastic", [None, True])
def test_gather_by_nearest_image(elastic, precision):
    n_pairs = 200
    grains, (first, second) = random_grains(50, 3, precision), random_pairs(50, n_pairs, 4)
    images = Period(np.array([0.0, 15e-4, 10e-4]), np.array([0.0, 1 / 15e-4, 1 / 10e-4]))
    plain, vector = (aligned_zeros(BUFFER * BLOCK, precision) for _ in range(2))
    for module, b in ((gather, plain), (vectors, vector)):
        module.gather_pairs(grains, first, second, n_pairs, b, Access(None, images, elastic))
    for row in GATHERED if elastic is None else (*GATHERED, *SECOND_SPINS):
        a, b = (x.reshape(BUFFER, BLOCK)[row, :n_pairs] for x in (plain, vector))
        assert close(a, b, precision)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("elastic", [None, True])
@pytest.mark.parametrize("n_pairs", [1, 16, 37, BLOCK])
def test_scatter(n_pairs, elastic, precision):
    first, second = random_pairs(50, n_pairs, 5)
    buffer = np.random.default_rng(6).normal(0, 1, BUFFER * BLOCK).astype(precision)
    plain, vector = (aligned_zeros(LOAD * 50, precision) for _ in range(2))
    gather.scatter_pairs(plain, first, second, n_pairs, buffer, elastic)
    vectors.scatter_pairs(vector, first, second, n_pairs, buffer, elastic)
    assert np.abs(plain).max() > 0
    assert close(plain, vector, precision)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("n", [1, 16, 37, BLOCK])
def test_gather_at_a_wall(n, precision):
    grains, (first, _) = random_grains(50, 9, precision), random_pairs(50, n, 10)
    velocity, results = np.array([0.1, -0.2, 0.3]), []
    for module in (gather, vectors):
        b, places = aligned_zeros(BUFFER * BLOCK, precision), aligned_zeros(4 * BLOCK, float)
        callable_from_python(module.gather_at_surface)(grains, velocity, first, n, b, places)
        results.append((b.reshape(BUFFER, BLOCK)[4:10, :n], places.reshape(4, BLOCK)[:, :n]))
    (plain, plain_places), (vector, vector_places) = results
    assert (plain_places == vector_places).all()
    place, motion = grains.place.reshape(-1, PLACE)[first], grains.motion.reshape(-1, MOTION)[first]
    assert (plain_places.T == place).all()
    assert close(plain, np.hstack([motion[:, VX : VX + 3] - velocity, motion[:, UX : UX + 3]]).T, precision)
    for row, row_2 in zip(plain, vector, strict=True):
        assert close(row, row_2, precision)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("n", [1, 16, 37, BLOCK])
def test_scatter_at_a_wall(n, precision):
    first, _ = random_pairs(50, n, 11)
    buffer = np.random.default_rng(12).normal(0, 1, BUFFER * BLOCK).astype(precision)
    plain, vector = (aligned_zeros(LOAD * 50, precision) for _ in range(2))
    gather.scatter_at_surface(plain, first, n, buffer)
    callable_from_python(vectors.scatter_at_surface)(vector, first, n, buffer)
    assert np.abs(plain).max() > 0
    assert close(plain, vector, precision)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("n", [1, 8, 45])
@pytest.mark.parametrize("force_n", [1e-6, 1e-9])  # stops many a spin; is a rounding of most velocities
def test_integrate(force_n, n, precision):
    gravity, dt = np.array([1.0, 2.0, -9.81]), 1e-4 * min(1.0, 1e8 * force_n)
    loads = np.random.default_rng(8).normal(0, force_n, LOAD * n).astype(precision)
    loads[RESIST::LOAD] = np.abs(loads[RESIST::LOAD])
    loads[3::LOAD] = 0.0
    which = np.random.default_rng(13).permutation(n + 3)[:n]
    others = np.setdiff1d(np.arange(n + 3), which)
    start, loads = random_grains(n + 3, 7, precision), np.resize(loads, LOAD * (n + 3))
    results = []
    for module in (motion, vectors):
        grains, work = GrainArrays(*(values.copy() for values in start)), loads.copy()
        used = module.integrate(grains, work, which, gravity, dt, precision(0))
        assert not work.reshape(-1, LOAD)[which].any()
        assert (work.reshape(-1, LOAD)[others] == loads.reshape(-1, LOAD)[others]).all()
        for before, after in zip(start, grains, strict=True):
            assert (after.reshape(n + 3, -1)[others] == before.reshape(n + 3, -1)[others]).all()
        for before, after in zip(start[1:], grains[1:], strict=True):
            assert (after.reshape(-1, MOTION)[:, BESIDE] == before.reshape(-1, MOTION)[:, BESIDE]).all()
        results.append((grains, used))
    (plain, used), (vector, used_2) = results
    shares = np.linalg.norm(plain.motion.reshape(-1, MOTION)[which, :3], axis=1) * plain.motion.reshape(-1, MOTION)[which, USE]
    assert used == pytest.approx(shares.max(), rel=1e-6)
    change = velocities(plain) - velocities(start)
    assert change[which].any(axis=0).all()
    # the small change of a velocity comes out as exactly as if there were no velocity to add it to
    assert np.abs(velocities(vector) - velocities(plain)).max() <= 8 * np.finfo(precision).eps * np.abs(change).max()
    for column in range(PLACE):
        assert close(*(grains.place.reshape(-1, PLACE)[:, column] for grains in (plain, vector)), precision)
    assert used_2 == pytest.approx(used, rel=1e-6)
