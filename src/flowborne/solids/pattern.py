"""Places of the entries of matrices between the dofs of bones and flesh, the same for all poses."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.sparse import coo_array, csr_array

from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.kernels.elastic import congruent


@dataclass(frozen=True)
class Pattern:
    """Two dofs can couple when they move nodes of one element, in a chain, or by a tendon.

    matrix    (nv, nv) ones there; columns ascend
    diagonal  (nv,) places of the diagonal in its values
    mass      (nv, nv) entries of the mass matrix: each is its index in MuJoCo's
    of_mass   (k,) places of these entries
    bones     (m,) dofs of bones
    """

    matrix: csr_array
    diagonal: Integers
    mass: csr_array
    of_mass: Integers
    bones: Integers

    def filled(self, values: Array) -> csr_array:
        """(nv, nv) matrix of these values."""
        return csr_array((values, self.matrix.indices, self.matrix.indptr), self.matrix.shape)

    def congruence(self, K: csr_array, J: csr_array) -> Array:
        """Values of J^T K J for a stiffness K (3np, 3np) of nodes and J (3np, nv) from v to their
        velocities."""
        values = np.zeros(self.matrix.nnz)
        stiff, moving = (K.indptr, K.indices, K.data), (J.indptr, J.indices, J.data)
        congruent(values, self.matrix.indptr, self.matrix.indices, stiff, moving, self.bones)
        return values

    def places(self, row: Integers, column: Integers) -> Integers:
        """Places of entries in the values."""
        return _places(self.matrix, row, column)


def pattern_of(mj: mujoco.MjModel, elements: csr_array, bones: Mask) -> Pattern:
    """Of a model.

    elements  (m, nv) which dofs move an element
    bones     (nv,) which dofs are those of bones
    """
    groups = [elements, chains(mj), tendons(mj)]
    matrix = csr_array(sum(g.T @ g for g in groups) > 0).astype(np.float64)
    matrix.sort_indices()
    row, column = np.repeat(np.arange(mj.nv), mj.M_rownnz), mj.M_colind
    entry, off = np.arange(row.size), row != column
    above = np.append(row, column[off]), np.append(column, row[off])
    mass = csr_array((np.append(entry, entry[off]), above), matrix.shape)
    own, every = np.flatnonzero(bones), np.arange(mj.nv)
    of_mass = _places(matrix, np.repeat(every, np.diff(mass.indptr)), mass.indices)
    return Pattern(matrix, _places(matrix, every, every), mass, of_mass, own)


def _places(matrix: csr_array, row: Integers, column: Integers) -> Integers:
    count = matrix.shape[0]
    known = np.repeat(np.arange(count), np.diff(matrix.indptr)) * count + matrix.indices
    return np.searchsorted(known, row * count + column)


def incidence(elements: Integers, moved: Integers, shape: tuple[int, int]) -> csr_array:
    """(m, nv) which dofs move an element, of the pairs `moved` of a node and a dof that moves it.

    shape  (np, nv)
    """
    count, corners = elements.shape
    of = np.repeat(np.arange(count), corners)
    return _ones(of, elements.ravel(), (count, shape[0])) @ _ones(moved[0], moved[1], shape)


def chains(mj: mujoco.MjModel) -> csr_array:
    """(nv, nv) for each dof, itself and the dofs between it and the world."""
    parent, nv = mj.dof_parentid, mj.nv
    pairs = []
    for dof in range(nv):
        above = dof
        while above >= 0:
            pairs.append((dof, above))
            above = int(parent[above])
    behind, before = np.array(pairs, np.int64).reshape(-1, 2).T
    return _ones(behind, before, (nv, nv))


def tendons(mj: mujoco.MjModel) -> csr_array:
    """(tendons, nv) which dofs move a tendon."""
    start = np.concatenate([[0], np.cumsum(mj.ten_J_rownnz)])
    values = np.ones(int(start[-1]))
    return csr_array((values, mj.ten_J_colind[: len(values)], start), (mj.ntendon, mj.nv))


def _ones(row: Integers, column: Integers, shape: tuple[int, int]) -> csr_array:
    return coo_array((np.ones(len(row)), (row, column)), shape=shape).tocsr()
