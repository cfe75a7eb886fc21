"""Elastic energy of elements, and what follows from it: forces on their nodes and stiffness.

The deformation gradient at a quadrature point of an element is F = I + sum over nodes a of
u_a (x) grad N_a. Energy per volume, with Lame's constants mu and lambda, J = det F and
E = (F^T F - I) / 2:

    St. Venant-Kirchhoff  lambda/2 tr(E)^2 + mu tr(E^2)
    stable neo-Hookean    mu/2 (tr(F^T F) - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2

The second is that of Smith, De Goes and Kim 2018 without its logarithm. Stiffness is the second
derivative without its negative eigenvalues at each quadrature point, which are known from the
singular values of F (Smith, De Goes and Kim 2019). Elements are a tuple: nodes (m, k), gradients
(m, q, k, 3) in 1/m, volumes of quadrature points (m, q) in m^3, Lame's constants mu and lambda at
them (m, q, 2) in Pa, laws (m,).
"""

from __future__ import annotations

import numpy as np

from flowborne.kernels.arrays import Array, Indices, Integers
from flowborne.kernels.jit import kernel

Elements = tuple[Integers, Array, Array, Array, Integers]
Sparse = tuple[Indices, Indices, Array]
"""A matrix by rows: where they begin, columns, values."""

SAINT_VENANT_KIRCHHOFF, STABLE_NEO_HOOKEAN = 0, 1

SWEEPS = 12
"""Most sweeps of Jacobi's method, which needs four or five."""

LANES = 4
"""Nodes of an element that are worked on together, so that the compiler makes vector code."""


@kernel
def deformation(shift: Array, nodes: Integers, gradients: Array, F: Array) -> None:
    """Fill F (3, 3) from displacements (n, 3) and the gradients (k, 3) of one point."""
    for i in range(3):
        for j in range(3):
            F[i, j] = 1.0 if i == j else 0.0
            for a in range(nodes.size):
                F[i, j] += shift[nodes[a], i] * gradients[a, j]


@kernel
def cofactor(F: Array, C: Array) -> float:
    """Fill C (3, 3) with the derivative of det F, and give det F."""
    for i in range(3):
        for j in range(3):
            k, n, m, o = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
            C[i, j] = F[k, m] * F[n, o] - F[k, o] * F[n, m]
    return F[0, 0] * C[0, 0] + F[0, 1] * C[0, 1] + F[0, 2] * C[0, 2]


@kernel
def stress(F: Array, mu: float, lame: float, law: int, work: Array, P: Array) -> None:
    """Fill P (3, 3), the first Piola-Kirchhoff stress at F (3, 3); `work` (3, 3) is overwritten."""
    if law == STABLE_NEO_HOOKEAN:
        slope = (lame + mu) * (cofactor(F, work) - 1.0) - mu
        for i in range(3):
            for j in range(3):
                P[i, j] = mu * F[i, j] + slope * work[i, j]
        return
    trace = 0.0
    for i in range(3):
        for j in range(3):
            work[i, j] = F[0, i] * F[0, j] + F[1, i] * F[1, j] + F[2, i] * F[2, j]
        work[i, i] -= 1.0
        trace += work[i, i]
    for i in range(3):
        for j in range(3):
            P[i, j] = 0.5 * lame * trace * F[i, j]
            for k in range(3):
                P[i, j] += mu * F[i, k] * work[k, j]


@kernel
def elastic_forces(shift: Array, elements: Elements) -> Array:
    """(n, 3) forces on nodes that are displaced by (n, 3) m, N."""
    nodes, gradients, volumes, moduli, laws = elements
    force = np.zeros(shift.shape)
    F, work, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for e in range(nodes.shape[0]):
        for q in range(volumes.shape[1]):
            deformation(shift, nodes[e], gradients[e, q], F)
            stress(F, moduli[e, q, 0], moduli[e, q, 1], laws[e], work, P)
            for a in range(nodes.shape[1]):
                for i in range(3):
                    for j in range(3):
                        force[nodes[e, a], i] -= volumes[e, q] * P[i, j] * gradients[e, q, a, j]
    return force


@kernel
def elastic_energy(shift: Array, elements: Elements) -> float:
    """Elastic energy, J, of nodes that are displaced by (n, 3) m."""
    nodes, gradients, volumes, moduli, laws = elements
    F, C = np.empty((3, 3)), np.empty((3, 3))
    total = 0.0
    for e in range(nodes.shape[0]):
        for q in range(volumes.shape[1]):
            mu, lame = moduli[e, q]
            deformation(shift, nodes[e], gradients[e, q], F)
            J = cofactor(F, C)
            trace, square = 0.0, 0.0
            for i in range(3):
                for j in range(3):
                    c = F[0, i] * F[0, j] + F[1, i] * F[1, j] + F[2, i] * F[2, j]
                    c -= 1.0 if i == j else 0.0
                    trace += 0.5 * c if i == j else 0.0
                    square += 0.25 * c * c
            if laws[e] == STABLE_NEO_HOOKEAN:
                density = mu * trace - mu * (J - 1.0) + 0.5 * (lame + mu) * (J - 1.0) ** 2
            else:
                density = 0.5 * lame * trace**2 + mu * square
            total += volumes[e, q] * density
    return total


@kernel
def volume_ratios(shift: Array, elements: Elements) -> Array:
    """(m,) least det F of each element's quadrature points."""
    nodes, gradients, volumes, _, _ = elements
    F, C = np.empty((3, 3)), np.empty((3, 3))
    least = np.full(nodes.shape[0], np.inf)
    for e in range(nodes.shape[0]):
        for q in range(volumes.shape[1]):
            deformation(shift, nodes[e], gradients[e, q], F)
            least[e] = min(least[e], cofactor(F, C))
    return least


@kernel
def diagonalise(A: Array, V: Array) -> None:
    """Turn a symmetric A (3, 3) into V^T A V, which is diagonal, by Jacobi's rotations."""
    for i in range(3):
        for j in range(3):
            V[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        off = abs(A[0, 1]) + abs(A[0, 2]) + abs(A[1, 2])
        if off <= 1e-16 * (abs(A[0, 0]) + abs(A[1, 1]) + abs(A[2, 2])):
            return
        for p in range(2):
            for q in range(p + 1, 3):
                if A[p, q] == 0.0:
                    continue
                theta = 0.5 * (A[q, q] - A[p, p]) / A[p, q]
                t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
                t = -t if theta < 0.0 else t
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    x, y = A[k, p], A[k, q]
                    A[k, p], A[k, q] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = A[p, k], A[q, k]
                    A[p, k], A[q, k] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = V[k, p], V[k, q]
                    V[k, p], V[k, q] = c * x - s * y, s * x + c * y


@kernel
def singular_values(F: Array, U: Array, V: Array, sigma: Array) -> None:
    """F = U diag(sigma) V^T with rotations U and V (3, 3); the last of sigma (3,), which is the
    smallest, is negative where det F is."""
    A = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            A[i, j] = F[0, i] * F[0, j] + F[1, i] * F[1, j] + F[2, i] * F[2, j]
    diagonalise(A, V)
    for i in range(2):  # the largest first
        for j in range(2 - i):
            if A[j, j] < A[j + 1, j + 1]:
                A[j, j], A[j + 1, j + 1] = A[j + 1, j + 1], A[j, j]
                for k in range(3):
                    V[k, j], V[k, j + 1] = V[k, j + 1], -V[k, j]
    for i in range(3):
        for j in range(3):
            U[i, j] = F[i, 0] * V[0, j] + F[i, 1] * V[1, j] + F[i, 2] * V[2, j]
    sigma[0] = np.sqrt(U[0, 0] ** 2 + U[1, 0] ** 2 + U[2, 0] ** 2)
    if sigma[0] == 0.0:
        sigma[:] = 0.0
        U[:] = V
        return
    for i in range(3):
        U[i, 0] /= sigma[0]
    share = U[0, 0] * U[0, 1] + U[1, 0] * U[1, 1] + U[2, 0] * U[2, 1]
    for i in range(3):
        U[i, 1] -= share * U[i, 0]
    sigma[1] = np.sqrt(U[0, 1] ** 2 + U[1, 1] ** 2 + U[2, 1] ** 2)
    if sigma[1] <= 1e-12 * sigma[0]:
        k = int(np.argmin(np.abs(U[:, 0])))
        U[:, 1] = -U[k, 0] * U[:, 0]
        U[k, 1] += 1.0
        U[:, 1] /= np.sqrt(U[0, 1] ** 2 + U[1, 1] ** 2 + U[2, 1] ** 2)
    else:
        for i in range(3):
            U[i, 1] /= sigma[1]
    x, y, z = U[0, 2], U[1, 2], U[2, 2]
    U[0, 2] = U[1, 0] * U[2, 1] - U[2, 0] * U[1, 1]
    U[1, 2] = U[2, 0] * U[0, 1] - U[0, 0] * U[2, 1]
    U[2, 2] = U[0, 0] * U[1, 1] - U[1, 0] * U[0, 1]
    sigma[2] = x * U[0, 2] + y * U[1, 2] + z * U[2, 2]


@kernel
def principal_moduli(sigma: Array, mu: float, lame: float, law: int, H: Array, R: Array) -> None:
    """Second derivatives of the energy along singular values (3,), without negative eigenvalues.

    H  (3, 3) filled with those of stretches among each other
    R  (3, 3) filled with those of dF_ij by itself above the diagonal and by dF_ji below it
    """
    square = sigma[0] ** 2 + sigma[1] ** 2 + sigma[2] ** 2
    J = sigma[0] * sigma[1] * sigma[2]
    slope = (lame + mu) * (J - 1.0) - mu
    pull = 0.5 * lame * (square - 3.0) - mu
    for i in range(3):
        for j in range(i, 3):
            k, s, t = 3 - i - j, sigma[i], sigma[j]
            if i == j and law == STABLE_NEO_HOOKEAN:
                H[i, i] = mu + (lame + mu) * (sigma[(i + 1) % 3] * sigma[(i + 2) % 3]) ** 2
            elif i == j:
                H[i, i] = pull + (3.0 * mu + lame) * s * s
            elif law == STABLE_NEO_HOOKEAN:
                H[i, j] = (lame + mu) * s * t * sigma[k] ** 2 + slope * sigma[k]
                turn, shear = mu + slope * sigma[k], mu - slope * sigma[k]
            else:
                H[i, j] = lame * s * t
                turn = pull + mu * (s * s - s * t + t * t)
                shear = pull + mu * (s * s + s * t + t * t)
            if i != j:
                H[j, i] = H[i, j]
                turn, shear = max(turn, 0.0), max(shear, 0.0)
                R[i, j], R[j, i] = 0.5 * (shear + turn), 0.5 * (shear - turn)
    axes = np.empty((3, 3))
    diagonalise(H, axes)
    x, y, z = max(H[0, 0], 0.0), max(H[1, 1], 0.0), max(H[2, 2], 0.0)
    for i in range(3):
        for j in range(3):
            first, second = axes[i, 0] * x * axes[j, 0], axes[i, 1] * y * axes[j, 1]
            H[i, j] = first + second + axes[i, 2] * z * axes[j, 2]


@kernel
def turned_moduli(U: Array, H: Array, R: Array, D: Array) -> None:
    """Fill D (3, 3, 3, 3), d2(energy) / dF_mj dF_nl with rows of F turned by U (3, 3)."""
    for m in range(3):
        for j in range(3):
            for n in range(3):
                for o in range(3):
                    D[m, j, n, o] = U[m, j] * H[j, o] * U[n, o]
                    if j != o:
                        across = R[o, j] if o > j else R[j, o]
                        D[m, j, n, o] += U[m, o] * across * U[n, j]
                    else:
                        for i in range(3):
                            if i != j:
                                own = R[i, j] if i < j else R[j, i]
                                D[m, j, n, o] += U[m, i] * own * U[n, i]


@kernel
def add_stiffness(
    shift: Array, elements: Elements, slot: Integers, stride: Integers, values: Array
) -> None:
    """Add the stiffness of nodes that are displaced by (n, 3) m to a sparse matrix, N/m.

    slot    (m, k, k) where in `values` the block of two nodes of an element begins
    stride  (n,) entries in a row of a node
    """
    nodes, gradients, volumes, moduli, laws = elements
    count = nodes.shape[1]
    padded = (count + LANES - 1) // LANES * LANES
    F, U, V = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    H, R, sigma = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    D, g, half = np.empty((3, 3, 3, 3)), np.zeros((3, padded)), np.empty((3, 3, 3, padded))
    block = np.empty((count, 3, 3, padded))
    for e in range(nodes.shape[0]):
        block[:] = 0.0
        for q in range(volumes.shape[1]):
            deformation(shift, nodes[e], gradients[e, q], F)
            singular_values(F, U, V, sigma)
            principal_moduli(sigma, moduli[e, q, 0], moduli[e, q, 1], laws[e], H, R)
            turned_moduli(U, H, R, D)
            for a in range(count):
                x, y, z = gradients[e, q, a]
                for j in range(3):
                    g[j, a] = x * V[0, j] + y * V[1, j] + z * V[2, j]
            add_blocks(block, half, D, g, volumes[e, q])
        for a in range(count):
            for b in range(a, count):
                above, below = slot[e, a, b], slot[e, b, a]
                across, along = stride[nodes[e, a]], stride[nodes[e, b]]
                for m in range(3):
                    for n in range(3):
                        values[np.uint64(above + m * across + n)] += block[a, m, n, b]
                        if a != b:
                            values[np.uint64(below + n * along + m)] += block[a, m, n, b]


@kernel
def congruent(
    values: Array, start: Indices, column: Indices, K: Sparse, J: Sparse, bones: Integers
) -> None:
    """Add J^T K J for a symmetric K to the entries of a symmetric sparse matrix that has them.

    values, start, column  rows of the matrix, whose columns ascend
    bones                  (m,) unknowns that move many rows of J, in which no other has an entry
    """
    n, count = start.size - 1, bones.size
    number, total = np.full(n, -1), np.zeros(n)  # total: a row of K J
    number[bones] = np.arange(count)
    held = np.empty(J[0].size - 1, np.bool_)
    for i in range(held.size):
        held[i] = J[0][i] == J[0][i + 1] or number[J[1][J[0][i]]] >= 0
    across = np.zeros((count, n))  # rows of bones
    for i in range(held.size):
        for e in range(K[0][i], K[0][i + 1]):
            j, x = K[1][e], K[2][e]
            if held[j] or not held[i]:
                for f in range(J[0][j], J[0][j + 1]):
                    total[J[1][f]] += x * J[2][f]
        for f in range(J[0][i], J[0][i + 1]):
            p, x = J[1][f], J[2][f]
            if held[i]:
                for b in bones:
                    across[number[p], b] += x * total[b]
                continue
            for e in range(start[p], start[p + 1]):
                values[e] += x * total[column[e]]
            for b in range(count):
                across[b, p] += x * total[bones[b]]
        for f in range(J[0][i], J[0][i + 1]):
            if not held[i]:
                for e in range(start[J[1][f]], start[J[1][f] + 1]):
                    total[column[e]] = 0.0
        total[bones] = 0.0
    for b in range(count):
        for e in range(start[bones[b]], start[bones[b] + 1]):
            values[e] += across[b, column[e]]


@kernel
def add_blocks(block: Array, half: Array, D: Array, g: Array, volume: float) -> None:
    """Add a point's part of the stiffness between nodes a and b >= a to block[a, m, n, b], N/m.

        volume  sum over j, o of  g[j, a] D[m, j, n, o] g[o, b]

    half  (3, 3, 3, k) is overwritten
    """
    g0, g1, g2 = g[0], g[1], g[2]
    for m in range(3):
        for n in range(3):
            for o in range(3):
                x, y, z = volume * D[m, 0, n, o], volume * D[m, 1, n, o], volume * D[m, 2, n, o]
                filled = half[m, n, o]
                for a in range(filled.size):
                    filled[a] = x * g0[a] + y * g1[a] + z * g2[a]
    for a in range(block.shape[0]):
        first = a // LANES * LANES
        b0, b1, b2 = g0[first:], g1[first:], g2[first:]
        for m in range(3):
            for n in range(3):
                x, y, z = half[m, n, 0, a], half[m, n, 1, a], half[m, n, 2, a]
                added = block[a, m, n, first:]
                for b in range(added.size):
                    added[b] += x * b0[b] + y * b1[b] + z * b2[b]
