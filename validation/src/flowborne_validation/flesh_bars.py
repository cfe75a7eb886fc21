"""Bars of flesh for the cases, made from a model and a table, and their equilibrium."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, dia_array

from flowborne import Array, SolidModel
from flowborne.bodies import (
    Flesh,
    FleshMesh,
    FleshTable,
    grow,
    mesh_bytes,
    read_spec,
    static_forces,
    symmetric_factor,
)
from flowborne_validation.worlds import Vector

Root = Callable[[Array], Array]

SETTLED = 1e-7
"""Largest displacement in an iteration of Newton's method for a bar at rest, over its length."""

MAX_ITERATIONS = 400

SPLIT = np.array(
    [[0, 1, 3, 7], [0, 5, 1, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 6, 4, 7]]
)
"""Six right-handed tetrahedra of a cell whose corner b is at (b & 1, b >> 1 & 1, b >> 2)."""


def bar_mesh(
    cells: tuple[int, int, int], size: tuple[float, float, float]
) -> tuple[Array, NDArray[np.int64]]:
    """Points (n, 3) and tetrahedra (m, 4) of a bar from x = 0, its axis along x, six to a cell."""
    nx, ny, nz = cells
    x, y, z = np.meshgrid(
        np.linspace(0.0, size[0], nx + 1),
        np.linspace(-0.5 * size[1], 0.5 * size[1], ny + 1),
        np.linspace(-0.5 * size[2], 0.5 * size[2], nz + 1),
        indexing="ij",
    )
    number = np.arange((nx + 1) * (ny + 1) * (nz + 1)).reshape(nx + 1, ny + 1, nz + 1)
    boxes = [
        number[i : nx + i, j : ny + j, k : nz + k].ravel()
        for k in (0, 1)
        for j in (0, 1)
        for i in (0, 1)
    ]
    elements = np.stack(boxes, axis=1)[:, SPLIT].reshape(-1, 4)
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), elements


def flat_mesh(cells: tuple[int, int], size: tuple[float, float]) -> tuple[Array, NDArray[np.int64]]:
    """Points (n, 3) and triangles (m, 3) of a bar in the plane z = 0, as `bar_mesh`, two to a
    cell."""
    x, y = np.meshgrid(
        np.linspace(0.0, size[0], cells[0] + 1),
        np.linspace(-0.5 * size[1], 0.5 * size[1], cells[1] + 1),
        indexing="ij",
    )
    number = np.arange(x.size).reshape(x.shape)
    a, b = number[:-1, :-1].ravel(), number[1:, :-1].ravel()
    c, d = number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    elements = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1), elements


@dataclass(frozen=True)
class Bar:
    """A clamped bar of flesh along x that bends in the plane z = 0 only.

    model  of the bar
    flesh  of the model
    fixed  (nv,) whether a dof is along z and does not move
    share  (n,) share of each vertex in a uniform load on the end face; the sum is 1
    """

    model: SolidModel
    flesh: Flesh
    fixed: NDArray[np.bool_]
    share: Array

    def end(self, q: Array) -> Array:
        """(3,) displacement of the middle of the end face at positions q (nq,), m."""
        rest = self.flesh.rest
        middle = self._face() & (np.abs(rest[:, 1]) < 1e-9 * np.ptp(rest[:, 0]))
        return np.asarray((self.flesh.vertices(q) - rest)[middle].mean(axis=0))

    def turned(self, q: Array) -> float:
        """Rotation of the end face, rad."""
        face = np.flatnonzero(self._face())
        height, now = self.flesh.rest[face, 1], self.flesh.vertices(q)[face]
        top, bottom = (np.isclose(height, edge) for edge in (height.max(), height.min()))
        across = now[top].mean(axis=0) - now[bottom].mean(axis=0)
        return float(np.arctan2(-across[0], across[1]))

    def load(self, force: Vector) -> Array:
        """(nv,) generalised force of a dead load on the end face, N."""
        pushed = np.outer(self.share, force).ravel()
        return np.asarray(self.flesh.jacobian(self.model.mj.qpos0).T @ pushed)

    def _face(self) -> NDArray[np.bool_]:
        x = self.flesh.rest[:, 0]
        return np.isclose(x, x.max())


def bar_of(
    cells: Sequence[int],
    size: tuple[float, float],
    tissue: FleshTable,
    gravity: Vector,
    root: Root = np.zeros_like,
) -> Bar:
    """A bar that is held at its root.

    cells   along length and thickness in a slab; and along the depth, with cells as deep as long
    tissue  table of its material
    root    x of the root at heights y (n,)
    """
    if len(cells) == 2:
        points, elements = flat_mesh((cells[0], cells[1]), size)
    else:
        depth = cells[2] * size[0] / cells[0]
        points, elements = bar_mesh((cells[0], cells[1], cells[2]), (*size, depth))
    held = points[:, 0] == 0.0
    points[:, 0] += root(points[:, 1]) * (1.0 - points[:, 0] / size[0])
    mesh = FleshMesh(points, elements, tuple("clamp" if h else "" for h in held))
    model = grown_from(mesh, tissue, "", gravity)
    flesh = model.flesh
    assert flesh is not None
    fixed = model.mj.jnt_axis[model.mj.dof_jntid, 2] > 0.5
    return Bar(model, flesh, fixed, _end_share(flesh))


def grown_from(mesh: FleshMesh, tissue: FleshTable, others: str, gravity: Vector) -> SolidModel:
    """A model with the flesh of a table and a mesh that the fixed body "clamp" holds.

    others  MJCF of other elements of the world body
    """
    slab = mesh.elements.shape[1] == 3
    clamp = f'<mujoco><worldbody>{others}<body name="clamp"/></worldbody></mujoco>'
    spec = read_spec(clamp)
    with TemporaryDirectory() as folder:
        (Path(folder) / "bar.npz").write_bytes(mesh_bytes(mesh, ""))
        grown = grow(spec, (tissue,), Path(folder))
    return SolidModel.with_flesh(spec, grown, slab=slab, gravity=gravity)


def tissue_table(young: float, poisson: float, density: float, damping: float = 0.0) -> FleshTable:
    """Table of a St. Venant-Kirchhoff material, undamped by default."""
    return FleshTable(
        name="bar",
        bones=("clamp",),
        mesh="bar.npz",
        young=young,
        poisson=poisson,
        density=density,
        damping=damping,
        law="st-venant-kirchhoff",
    )


def equilibrium(bar: Bar, applied: Array, start: Array | None = None) -> Array:
    """(nq,) positions of the bar at rest under generalised forces (nv,) and its weight.

    Newton's method, damped where a step would raise the energy. It converges linearly, as the
    stiffness is not the derivative of the forces of compressed elements.

    start   (nq,) positions to start from; at rest when None
    raises  ArithmeticError when it does not settle
    """
    model, free = bar.model, np.flatnonzero(~bar.fixed)
    room = SETTLED * float(np.ptp(bar.flesh.rest[:, 0]))
    q, damping = np.array(model.mj.qpos0 if start is None else start), 0.0
    K, force = static_forces(model, q, applied)
    for _ in range(MAX_ITERATIONS):
        within = csc_array(K[free][:, free])
        scale = dia_array((within.diagonal(), 0), shape=within.shape)
        move = np.zeros(model.nv)
        move[free] = symmetric_factor(csc_array(within + damping * scale)).solve(force[free])
        ahead = model.integrate(q, move, 1.0)
        there, later = static_forces(model, ahead, applied)
        small = bool(np.abs(move).max() < room)
        if not small and not move @ (force + later) > 0.0:
            damping = max(4.0 * damping, 1e-6)
            continue
        q, K, force = ahead, there, later
        if small and damping == 0.0:
            return q
        damping = 0.25 * damping if damping > 1e-7 else 0.0
    raise ArithmeticError(
        f"the bar does not come to rest in {MAX_ITERATIONS} iterations of Newton's method"
    )


def _end_share(flesh: Flesh) -> Array:
    """(n,) consistent nodal loads: Simpson's rule on edges, a third at each middle on triangles."""
    x, share = flesh.rest[:, 0], np.zeros(len(flesh.rest))
    at_end = np.isclose(x, x.max())
    for element in flesh.elements:
        nodes = element[at_end[element]]
        apex = np.isin(nodes, element[: 3 if len(element) == 6 else 4])
        if apex.sum() == 2 and len(element) == 6:
            (a, b), (m,) = nodes[apex], nodes[~apex]
            share[[a, b, m]] += np.linalg.norm(flesh.rest[a] - flesh.rest[b]) * np.array([1, 1, 4])
        elif apex.sum() == 3:
            a, b, c = flesh.rest[nodes[apex]]
            share[nodes[~apex]] += np.linalg.norm(np.cross(b - a, c - a))
    return share / share.sum()
