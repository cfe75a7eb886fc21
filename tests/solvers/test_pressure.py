"""The pressure solve against dense linear algebra, and how it converges."""

from dataclasses import replace

import numpy as np
import pytest

from flowborne.solvers.mobility import dense_mobility
from flowborne.solvers.pressure import NO_TERM, LowRankTerm, PressureSystem


def random_weights(shape, sides, seed=0, blocked=0.3):
    """Face weights with cut and closed faces; sides: 'closed', 'open' or 'periodic' per axis."""
    rng = np.random.default_rng(seed)
    weights = []
    for axis in range(3):
        size = list(shape)
        size[axis] += 1
        w = rng.uniform(0.01, 1.0, size) * (rng.uniform(size=size) > blocked)
        ends = np.moveaxis(w, axis, 0)
        if sides[axis] == "closed" or shape[axis] == 1:
            ends[0] = ends[-1] = 0.0
        elif sides[axis] == "open":
            ends[0], ends[-1] = 0.0, 2.0 * ends[-1]
        else:
            ends[-1] = ends[0]
        weights.append(w)
    return weights


def laplacian(weights, periodic):
    """Dense K from face weights, entry by entry."""
    shape = weights[1].shape[0], weights[0].shape[1], weights[0].shape[2]
    index = np.arange(np.prod(shape)).reshape(shape)
    K = np.zeros((index.size, index.size))
    for axis in range(3):
        n = shape[axis]
        w, cells = np.moveaxis(weights[axis], axis, 0), np.moveaxis(index, axis, 0)
        for f in range(n + 1):
            a, b = cells[f - 1], cells[f % n]
            for a_c, b_c, v in zip(a.ravel(), b.ravel(), w[f].ravel(), strict=True):
                if 0 < f < n or (periodic[axis] and f == 0):
                    K[a_c, a_c] += v
                    K[b_c, b_c] += v
                    K[a_c, b_c] -= v
                    K[b_c, a_c] -= v
                elif not periodic[axis]:
                    c = b_c if f == 0 else a_c
                    K[c, c] += v
    return K


def random_term(shape, bodies, seed=1, rank=None):
    """Rows on a third of the cells, some cells with two; A^-1 of the given rank."""
    rng = np.random.default_rng(seed)
    k = 6 * bodies
    cells = np.sort(rng.choice(np.prod(shape), np.prod(shape) // 3))
    columns = (6 * rng.integers(0, bodies, cells.size)[:, None] + np.arange(6)).ravel()
    half = rng.standard_normal((k, k if rank is None else rank))
    rows = cells, 6 * np.arange(cells.size + 1), columns, rng.standard_normal(columns.size)
    return LowRankTerm(rows, dense_mobility(half @ half.T))


def row_matrix(term, cells):
    """Dense J."""
    J = np.zeros((cells, term.mobility.size))
    at, start, columns, values = term.rows
    for n, cell in enumerate(at):
        for e in range(start[n], start[n + 1]):
            J[cell, columns[e]] += values[e]
    return J


def dense_solution(weights, periodic, term, rhs):
    """Least-norm solution over the active cells; rhs as far as it is in the range; the matrix."""
    K = laplacian(weights, periodic)
    active = np.diag(K) > 0.0
    J = row_matrix(term, active.size)
    A = (K + J @ term.mobility.times(J).T)[np.ix_(active, active)]
    inverse = np.linalg.pinv(A, rcond=1e-11, hermitian=True)
    p = np.zeros(active.size)
    p[active] = inverse @ rhs.ravel()[active]
    return p.reshape(rhs.shape), A, active


def rounding(A, solution, rhs):
    """|rhs - A p| / |rhs| that rounding leaves of the exact solution, in units of one rounding of
    A p: no solver, the dense one included, can promise less."""
    largest = np.linalg.norm(A, 2) * np.linalg.norm(solution)
    return np.finfo(float).eps * largest / np.linalg.norm(rhs)


CASES = [
    ((7, 5, 6), ("closed", "closed", "closed")),
    ((9, 11, 1), ("closed", "closed", "closed")),
    ((9, 12, 1), ("closed", "open", "closed")),
    ((6, 5, 7), ("periodic", "open", "closed")),
    ((5, 6, 4), ("periodic", "periodic", "periodic")),
    ((8, 5, 1), ("periodic", "closed", "closed")),
    ((2, 3, 2), ("closed", "periodic", "open")),
    ((1, 9, 1), ("closed", "open", "closed")),
]


@pytest.mark.parametrize(("shape", "sides"), CASES)
@pytest.mark.parametrize("blocked", [0.0, 0.35, 0.7])
@pytest.mark.parametrize("bodies", [0, 2])
def test_solution_equals_dense_least_norm_solution(shape, sides, blocked, bodies):
    """Cut cells, isolated pockets and solid cells at random; regions joined by bodies."""
    weights = random_weights(shape, sides, blocked=blocked)
    periodic = tuple(side == "periodic" for side in sides)
    term = random_term(shape, bodies) if bodies else NO_TERM
    rhs = np.random.default_rng(2).standard_normal(shape)
    expected, A, _ = dense_solution(weights, periodic, term, rhs)
    found = PressureSystem(weights, periodic).solve(rhs, None, term, tolerance=1e-12)
    assert found.residual <= max(1e-11, rounding(A, expected, rhs))
    condition = np.linalg.cond(A) if not len(A) else np.linalg.norm(np.linalg.pinv(A, 1e-11), 2)
    error = np.abs(found.pressure - expected).max()
    assert error <= 1e-10 * condition * np.linalg.norm(rhs)


@pytest.mark.parametrize(("shape", "sides"), [CASES[2], CASES[3]])
def test_a_dense_term_belongs_to_the_matrix(shape, sides):
    """Between random cells; one of its vectors takes away as much as K leaves positive."""
    weights, rng = random_weights(shape, sides, blocked=0.0), np.random.default_rng(3)
    K, term = laplacian(weights, tuple(s == "periodic" for s in sides)), random_term(shape, 2)
    cells = rng.choice(len(K), len(K) // 2)
    vectors, U = rng.standard_normal((2, cells.size)), np.zeros((len(K), 2))
    np.add.at(U, cells, vectors.T)
    strengths = np.array([1.0, -0.5 / (U[:, 1] @ np.linalg.solve(K, U[:, 1]))])
    J, rhs = row_matrix(term, len(K)), rng.standard_normal(shape)
    A = K + U * strengths @ U.T + J @ term.mobility.times(J).T
    beyond = cells, vectors, strengths
    system = PressureSystem(weights, tuple(s == "periodic" for s in sides), beyond=beyond)
    found = system.solve(rhs, None, term, tolerance=1e-12)
    expected = np.linalg.solve(A, rhs.ravel()).reshape(shape)
    np.testing.assert_allclose(found.pressure, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("sides", [("closed", "closed", "closed"), ("periodic", "open", "closed")])
@pytest.mark.parametrize(("strength", "rank"), [(1e4, None), (1e4, 3), (1e-4, None), (1.0, 1)])
def test_light_heavy_and_jointed_bodies(sides, strength, rank):
    """Responses from nearly none to that of bodies far lighter than the fluid, and of low rank."""
    shape = (7, 9, 6)
    weights = random_weights(shape, sides)
    periodic = tuple(side == "periodic" for side in sides)
    plain = random_term(shape, 2, rank=rank)
    term = replace(plain, mobility=dense_mobility(strength * plain.mobility.arrays[0]))
    rhs = np.random.default_rng(3).standard_normal(shape)
    expected, A, _ = dense_solution(weights, periodic, term, rhs)
    found = PressureSystem(weights, periodic).solve(rhs, None, term, tolerance=1e-9)
    assert found.residual <= max(1e-9, rounding(A, expected, rhs))
    assert found.iterations <= 40
    error = np.abs(found.pressure - expected).max()
    assert error <= 1e-8 * np.linalg.norm(np.linalg.pinv(A, 1e-11), 2) * np.linalg.norm(rhs)


def channel(n, low=0, high=0):
    """Straight closed channel (3n, n, 1) whose middle third is a plug; weights and its term.

    low, high  face weight of the channel's ends
    """
    shape = (3 * n, n, 1)
    weights = [np.ones((3 * n + 1, n, 1)), np.ones((3 * n, n + 1, 1)), np.zeros((3 * n, n, 2))]
    weights[0][n : 2 * n + 1] = 0.0
    weights[1][n : 2 * n] = 0.0
    weights[0][0], weights[0][-1] = low, high
    weights[1][:, 0] = weights[1][:, -1] = 0.0
    index = np.arange(3 * n * n).reshape(shape)
    cells = np.concatenate([index[n - 1].ravel(), index[2 * n].ravel()])
    values = np.repeat([1.0, -1.0], n)
    mobility = np.zeros((6, 6))
    mobility[0, 0] = 2.0
    rows = np.arange(2 * n + 1)
    columns = np.zeros(2 * n, np.int64)
    return weights, LowRankTerm((cells, rows, columns, values), dense_mobility(mobility))


def test_plug_between_closed_cavities_shares_one_constant():
    """Pushed from both sides by what flows in, it settles so that the cavities agree."""
    weights, term = channel(8)
    rhs = np.zeros((24, 8, 1))
    rhs[2, 3, 0], rhs[20, 5, 0] = 1.0, -1.0
    expected, _, _ = dense_solution(weights, (False,) * 3, term, rhs)
    system = PressureSystem(weights)
    found = system.solve(rhs, None, term, tolerance=1e-12)
    assert system.regions == 2
    assert found.converged
    np.testing.assert_allclose(found.pressure, expected, atol=1e-10)
    impulse = found.pressure[7].sum() - found.pressure[16].sum()
    assert 2.0 * impulse * 8 == pytest.approx(1.0, abs=1e-10)  # the plug makes room for what enters


def test_plug_between_a_cavity_and_an_open_side():
    """The cavity's pressure is held by the plug alone."""
    weights, term = channel(8, high=2.0)
    rhs = np.zeros((24, 8, 1))
    rhs[2, 3, 0] = 1.0
    expected, _, _ = dense_solution(weights, (False,) * 3, term, rhs)
    found = PressureSystem(weights).solve(rhs, None, term, tolerance=1e-12)
    assert found.converged
    np.testing.assert_allclose(found.pressure, expected, atol=1e-10)


def disc_in_box(n, open_side=True):
    """Disc of radius 0.2 in a unit square; faces cut in proportion to the signed distance."""
    weights = []
    for axis in range(2):
        x = (np.arange(n + (axis == 0)) + 0.5 * (axis != 0)) / n
        y = (np.arange(n + (axis == 1)) + 0.5 * (axis != 1)) / n
        distance = np.hypot(x[:, None] - 0.45, y[None, :] - 0.5) - 0.2
        w = np.clip(distance * n + 0.5, 0.0, 1.0)[:, :, None]
        ends = np.moveaxis(w, axis, 0)
        ends[0] = ends[-1] = 0.0
        weights.append(w)
    if open_side:
        weights[0][-1] = 2.0
    return [*weights, np.zeros((n, n, 2))]


def disc_term(weights, n, mass):
    """The disc moves along x with this mass, the fluid's density being 1."""
    closed = 1.0 - np.clip(weights[0], 0.0, 1.0)
    closed[0] = closed[-1] = 0.0
    values = (np.diff(closed, axis=0) / n).ravel()
    cells = np.flatnonzero(values)
    rows = np.arange(cells.size + 1)
    mobility = np.zeros((6, 6))
    mobility[0, 0] = 1.0 / mass
    columns = np.zeros(cells.size, np.int64)
    return LowRankTerm((cells, rows, columns, values[cells]), dense_mobility(mobility))


def stream(n):
    """Right-hand side with all wavelengths in it and mean 0."""
    x = (np.arange(n) + 0.5) / n
    rhs = np.cos(7 * x)[:, None, None] + 0.1 * np.random.default_rng(5).standard_normal((n, n, 1))
    return rhs - rhs.mean()


@pytest.mark.parametrize("open_side", [True, False])
def test_iterations_stay_flat_as_the_grid_is_refined(open_side):
    counts = []
    for n in (32, 64, 128, 256):
        system = PressureSystem(disc_in_box(n, open_side))
        found = system.solve(stream(n), tolerance=1e-5)
        assert found.converged
        counts.append(found.iterations)
    assert max(counts) <= min(1.5 * counts[0], 10), counts


def test_iterations_do_not_depend_on_how_light_the_body_is():
    n = 64
    weights = disc_in_box(n)
    system = PressureSystem(weights)
    counts = []
    for mass in (1e3, 1.0, 1e-2, 1e-4):
        term = disc_term(weights, n, mass)
        found = system.solve(stream(n), None, term, tolerance=1e-9)
        assert found.converged
        counts.append(found.iterations)
    assert max(counts) - min(counts) <= 2, counts


@pytest.mark.parametrize("n", [64, 256])
def test_iterations_with_a_thin_plate(n):
    """A slanted plate across most of the domain, shut and thinner than a cell."""
    x = (np.arange(n) + 0.5) / n - 0.5
    along = np.cos(0.35) * x[:, None] + np.sin(0.35) * x[None, :]
    above = np.cos(0.35) * x[None, :] - np.sin(0.35) * x[:, None] > 0.0
    plate = np.abs(along) < 0.4
    weights = [np.ones((n + 1, n, 1)), np.ones((n, n + 1, 1)), np.zeros((n, n, 2))]
    weights[0][1:-1, :, 0][(above[1:] != above[:-1]) & plate[1:]] = 0.0
    weights[1][:, 1:-1, 0][(above[:, 1:] != above[:, :-1]) & plate[:, 1:]] = 0.0
    weights[0][0] = weights[0][-1] = 2.0
    weights[1][:, 0] = weights[1][:, -1] = 0.0
    found = PressureSystem(weights).solve(stream(n), tolerance=1e-9)
    assert found.converged
    assert found.iterations <= 20


def test_a_good_guess_pays_off():
    n = 64
    system = PressureSystem(disc_in_box(n))
    rhs = stream(n)
    cold = system.solve(rhs, tolerance=1e-8)
    assert system.solve(rhs, cold.pressure, tolerance=1e-8).iterations == 0
    near = system.solve(rhs * (1.0 + 1e-5 * np.cos(rhs)), cold.pressure, tolerance=1e-8)
    assert near.iterations <= cold.iterations // 2 + 1
    assert near.residual <= 1e-8


def test_nothing_to_solve_gives_zero():
    system = PressureSystem(disc_in_box(16))
    found = system.solve(np.zeros((16, 16, 1)), np.ones((16, 16, 1)))
    assert found.converged
    assert found.iterations == 0
    assert not found.pressure.any()


def test_systems_of_one_shape_do_not_disturb_each_other():
    """Buffers are lent again only when their system is gone."""
    n = 32
    first = PressureSystem(disc_in_box(n))
    expected = first.solve(stream(n)).pressure
    PressureSystem(disc_in_box(n, open_side=False)).solve(stream(n))
    second = PressureSystem(disc_in_box(n, open_side=False))
    around = [w.copy() for w in disc_in_box(n)]
    around[0][0] = around[0][-1] = around[1][:, 0] = around[1][:, -1] = 1.0
    PressureSystem(around, (True, True, False)).solve(stream(n))
    np.testing.assert_array_equal(first.solve(stream(n)).pressure, expected)
    again = PressureSystem(disc_in_box(n))
    np.testing.assert_array_equal(again.solve(stream(n)).pressure, expected)
    assert second.regions == 1


def test_one_cell_along_x_in_three_dimensions_is_refused():
    weights = (np.ones((2, 4, 4)), np.ones((1, 5, 4)), np.ones((1, 4, 5)))
    with pytest.raises(ValueError, match="1 x 4 x 4 cells is one cell thick along x"):
        PressureSystem(weights)


@pytest.mark.parametrize("shape", [(9, 8, 1), (5, 6, 7)])
def test_a_solution_is_not_touched_by_the_next_solve(shape):
    system = PressureSystem(random_weights(shape, ("open", "closed", "closed")))
    rng = np.random.default_rng(6)
    first = system.solve(rng.standard_normal(shape)).pressure
    kept = first.copy()
    system.solve(rng.standard_normal(shape))
    np.testing.assert_array_equal(first, kept)
