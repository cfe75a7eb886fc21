"""In which order the dofs of bones and flesh are eliminated: found once for each model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, csr_array

from flowborne.solids.flesh import Flesh
from flowborne.solids.model import SolidModel
from flowborne.solvers.cholesky import Ordering, ordering_of


def ordered(model: SolidModel, free: NDArray[np.int64]) -> Ordering:
    """Ordering of A (see `flesh_dynamics`) for the free dofs (nf,), whatever the pose."""
    found = model.orderings
    key = free.tobytes()
    if key not in found:
        found[key] = ordering_of(csc_array(pattern(model)[free][:, free]))
    return found[key]


def pattern(model: SolidModel) -> csr_array:
    """(nv, nv) ones where two dofs can act on each other: those of a chain, of a tendon, and those
    that move nodes of one element."""
    assert model.flesh is not None
    groups = [moving(model, model.flesh), chains(model), tendons(model)]
    return csr_array(sum(g.T @ g for g in groups) > 0).astype(np.float64)


def moving(model: SolidModel, flesh: Flesh) -> csr_array:
    """(elements, nv) which dofs move an element."""
    node, dof = flesh.moved
    moves = _ones(node, dof, (len(flesh.body), model.nv))
    count, corners = flesh.elements.shape
    of = np.repeat(np.arange(count), corners)
    return _ones(of, flesh.elements.ravel(), (count, len(flesh.body))) @ moves


def chains(model: SolidModel) -> csr_array:
    """(nv, nv) which dofs each dof lies behind on its way to the world, and itself."""
    parent, nv = model.mj.dof_parentid, model.nv
    pairs = []
    for dof in range(nv):
        above = dof
        while above >= 0:
            pairs.append((dof, above))
            above = int(parent[above])
    behind, before = np.array(pairs, np.int64).reshape(-1, 2).T
    return _ones(behind, before, (nv, nv))


def tendons(model: SolidModel) -> csr_array:
    """(tendons, nv) which dofs move a tendon."""
    mj = model.mj
    start = np.concatenate([[0], np.cumsum(mj.ten_J_rownnz)])
    values = np.ones(int(start[-1]))
    return csr_array((values, mj.ten_J_colind[: len(values)], start), (mj.ntendon, model.nv))


def _ones(row: NDArray[np.int64], column: NDArray[np.int64], shape: tuple[int, int]) -> csr_array:
    return coo_array((np.ones(len(row)), (row, column)), shape=shape).tocsr()
