"""Bars of flesh for the cases, and where they come to rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, dia_array

from flowborne import SolidModel, Tissue
from flowborne.bodies import Flesh, add_flesh, flesh_of, static_forces, symmetric_factor

Array = NDArray[np.float64]
Vector = tuple[float, float, float]

SETTLED = 1e-7
"""A bar is at rest when a turn of Newton's method moves nothing by more than this of its length."""

TURNS = 400

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
    corners = [
        number[i : nx + i, j : ny + j, k : nz + k].ravel()
        for k in (0, 1)
        for j in (0, 1)
        for i in (0, 1)
    ]
    elements = np.stack(corners, axis=1)[:, SPLIT].reshape(-1, 4)
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), elements


@dataclass(frozen=True)
class Bar:
    """A clamped bar of flesh along x that bends in the plane z = 0 alone.

    model  of the bar
    flesh  of the model
    fixed  (nv,) dofs along z, which do not move
    share  (n,) of an even load on the end face that each vertex bears; they add up to 1
    """

    model: SolidModel
    flesh: Flesh
    fixed: NDArray[np.bool_]
    share: Array

    def end(self, q: Array) -> Array:
        """(3,) how far the middle of the end face has moved at positions q (nq,), m."""
        rest = self.flesh.rest
        middle = (self.share > 0.0) & (np.abs(rest[:, 1]) < 1e-9 * np.ptp(rest[:, 0]))
        return np.asarray((self.flesh.vertices(q) - rest)[middle].mean(axis=0))

    def turned(self, q: Array) -> float:
        """Angle that the end face has turned by, rad."""
        face = np.flatnonzero(self.share)
        height, now = self.flesh.rest[face, 1], self.flesh.vertices(q)[face]
        top, bottom = (np.isclose(height, edge) for edge in (height.max(), height.min()))
        across = now[top].mean(axis=0) - now[bottom].mean(axis=0)
        return float(np.arctan2(-across[0], across[1]))

    def load(self, force: Vector) -> Array:
        """(nv,) generalised force of a dead load on the end face, N."""
        pushed = np.outer(self.share, force).ravel()
        return np.asarray(self.flesh.jacobian(self.model.mj.qpos0).T @ pushed)


def tetrahedral_bar(
    cells: tuple[int, int],
    size: tuple[float, float],
    tissue: Tissue,
    gravity: Vector,
    root: Callable[[Array], Array],
) -> Bar:
    """A bar one cell thick in z, six tetrahedra to a cell, held where it starts.

    root  x at which the bar starts, at heights y (n,)
    """
    points, elements = bar_mesh((*cells, 1), (*size, size[0] / cells[0]))
    held = points[:, 0] == 0.0
    points[:, 0] += root(points[:, 1]) * (1.0 - points[:, 0] / size[0])
    spec = mujoco.MjSpec()
    add_flesh(spec, "bar", points, elements, tissue, ["world" if h else "" for h in held])
    return _bar(spec, gravity, _composite([1.0, 1.0], cells[1]), [1.0, 1.0])


QUADRATIC = """<mujoco><worldbody><flexcomp name="bar" type="grid" dim="3" dof="quadratic"
count="{points}" cellcount="{cells}" spacing="{spacing}" pos="{middle} 0 0" mass="{mass}"
radius="{radius}"><elasticity young="{young}" poisson="{poisson}" damping="{damping}"/>
<contact selfcollide="none" contype="0" conaffinity="0"/><pin gridrange="0 0 0 0 {last} 2"/>
</flexcomp></worldbody></mujoco>"""


def quadratic_bar(
    cells: tuple[int, int], size: tuple[float, float], tissue: Tissue, gravity: Vector
) -> Bar:
    """A bar one cell thick in z that cells of 27 nodes carry, held at x = 0.

    MuJoCo shares all the mass that it is told among the nodes that are not held, so it is not told
    that of the held face, a sixth of a cell.
    """
    across = np.array([*cells, 1])
    lengths = np.array([*size, size[0] / cells[0]])
    mass = tissue.density * lengths.prod() * (1.0 - 1.0 / (6.0 * cells[0]))
    text = QUADRATIC.format(
        points=_words(2 * across + 1),
        cells=_words(across),
        spacing=_words(0.5 * lengths / across),
        middle=0.5 * size[0],
        mass=mass,
        radius=1e-3 * lengths.min(),
        young=tissue.young,
        poisson=tissue.poisson,
        damping=tissue.damping,
        last=2 * cells[1],
    )
    simpson = [1.0, 4.0, 1.0]
    spec = mujoco.MjSpec.from_string(text)
    return _bar(spec, gravity, _composite(simpson, cells[1]), simpson)


IN_SLAB = """<mujoco><default><geom contype="0" conaffinity="0"/></default><worldbody>{beside}
<flexcomp name="bar" type="grid" dim="3" dof="quadratic" count="{points}" cellcount="{cells}"
spacing="{spacing}" pos="{middle}" mass="{mass}" radius="{radius}">
<elasticity young="{young}" poisson="{poisson}" damping="{damping}"/>
<contact selfcollide="none" contype="0" conaffinity="0"/><pin gridrange="0 0 0 2 {last} 2"/>
</flexcomp></worldbody></mujoco>"""

SLICE = 0.01
"""Depth of a slab's bar, m: it is as stiff and as heavy as a metre would be. The fluid of a slab
pushes the vertices at z = 0 alone, and the middle of a deep bar would give way to it."""


def bar_in_slab(
    cells: tuple[int, int],
    size: tuple[float, float],
    end: tuple[float, float],
    tissue: Tissue,
    beside: str,
) -> SolidModel:
    """A bar along x in a slab that cells of 27 nodes carry, one thick in z, and what it hangs on.

    cells   of its free part, along and across; one more, all of it held, is on its near side
    size    length and thickness of the free part, m
    end     middle of its end, m
    beside  MJCF of the world body's other elements
    """
    across = np.array([cells[0] + 1, cells[1], 1])
    lengths = np.array([size[0] * across[0] / cells[0], size[1], SLICE])
    mass = tissue.density * size[0] * size[1] * (1.0 - 1.0 / (6.0 * cells[0]))
    text = IN_SLAB.format(
        beside=beside,
        points=_words(2 * across + 1),
        cells=_words(across),
        spacing=_words(0.5 * lengths / across),
        middle=_words(np.array([end[0] - 0.5 * lengths[0], end[1], 0.0])),
        mass=mass,
        radius=1e-3 * lengths.min(),
        young=tissue.young / SLICE,
        poisson=tissue.poisson,
        damping=tissue.damping,
        last=2 * cells[1],
    )
    return SolidModel.with_flesh(
        mujoco.MjSpec.from_string(text), slab=True, gravity=(0.0, 0.0, 0.0)
    )


def equilibrium(bar: Bar, applied: Array, start: Array | None = None) -> Array:
    """(nq,) positions at which the bar is at rest under generalised forces (nv,) and its weight.

    Newton's method with MuJoCo's stiffness, damped where a step would raise the energy. It
    converges linearly, as that stiffness is not the derivative of compressed elements' forces.

    start   (nq,) positions to start from; at rest when None
    raises  ArithmeticError when it does not settle
    """
    model, free = bar.model, np.flatnonzero(~bar.fixed)
    room = SETTLED * float(np.ptp(bar.flesh.rest[:, 0]))
    q, damping = np.array(model.mj.qpos0 if start is None else start), 0.0
    K, force = static_forces(model, q, applied)
    for _ in range(TURNS):
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
    raise ArithmeticError(f"the bar does not come to rest in {TURNS} turns of Newton's method")


def _bar(spec: mujoco.MjSpec, gravity: Vector, along_y: list[float], along_z: list[float]) -> Bar:
    model = SolidModel.with_flesh(spec, gravity=gravity)
    flesh = flesh_of(model)
    face = np.flatnonzero(np.isclose(flesh.rest[:, 0], flesh.rest[:, 0].max()))
    ordered = face[np.lexsort((flesh.rest[face, 2].round(9), flesh.rest[face, 1].round(9)))]
    share = np.zeros(len(flesh.rest))
    share[ordered] = np.outer(along_y, along_z).ravel()
    fixed = model.mj.jnt_axis[model.mj.dof_jntid, 2] > 0.5
    return Bar(model, flesh, fixed, share / share.sum())


def _composite(rule: list[float], cells: int) -> list[float]:
    """Weights of a quadrature rule with points on both ends, cell after cell."""
    weights = np.zeros((len(rule) - 1) * cells + 1)
    for i in range(cells):
        weights[(len(rule) - 1) * i :][: len(rule)] += rule
    return list(weights)


def _words(values: Array | NDArray[np.int64]) -> str:
    return " ".join(f"{value:.17g}" for value in values)
