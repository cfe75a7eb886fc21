"""The flesh of a model: its vertices, elements and surface, and where they are."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, coo_array, csr_array, diags_array, eye_array, kron
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

from flowborne.shapes.thickness import thinnest
from flowborne.solids.cage import node_weights
from flowborne.solids.mjcf import element_name, rest_poses
from flowborne.solids.scratch import Compiled, Scratch, scratch
from flowborne.solids.tissue import right_handed, volumes
from flowborne.solids.twists import cross, twists_about_origin

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Jointed(Compiled, Protocol):
    """What flesh asks of the model that it is a part of; see `SolidModel`."""

    slab: bool
    nv: int
    dof_root: Indices


@dataclass(frozen=True)
class Flesh:
    """What of a model is flesh. A point rides on a body of its own, or on the bone that holds it.

    model       the model
    names       of its fleshes
    body        (np,) body that each point rides on
    offset      (np, 3) the point in that body's frame, m
    weights     (n, np) that make vertices of points: the identity for tetrahedra, interpolation
                for flesh that a grid of cells carries
    rest        (n, 3) vertices at rest, m
    elements    (m, 4) tetrahedra of vertices, right-handed
    surface     (k, 3) triangles of vertices, outward; none around a bone that is all inside
    of_surface  (k,) number of the flesh in `names` that each belongs to
    of_element  (m,) the same of elements
    dofs        (nv,) dofs that move points of flesh alone; the others are those of bones
    moved       (2, k) pairs of a point and a dof that moves it
    carried     (n, nbody) share of each bone in carrying a vertex, from 0 to 1, together 1
    """

    model: Jointed
    names: tuple[str, ...]
    body: Indices
    offset: Array
    weights: csr_array
    rest: Array
    elements: Indices
    surface: Indices
    of_surface: Indices
    of_element: Indices
    dofs: NDArray[np.bool_]
    moved: Indices
    carried: Array

    def vertices(self, q: Array) -> Array:
        """(n, 3) places of the vertices at positions q (nq,), m."""
        s = scratch(self.model)
        s.place(q)
        return self.placed(s)

    def jacobian(self, q: Array) -> csr_array:
        """(3n, nv) sparse, from v to the velocities of the vertices, x y z of each in turn."""
        s = scratch(self.model)
        s.place(q)
        return self.moving(s)

    def placed(self, s: Scratch) -> Array:
        """(n, 3) the vertices where `s` has been placed, m."""
        return np.asarray(self.weights @ self._points(s))

    def moving(self, s: Scratch) -> csr_array:
        """(3n, nv) `jacobian` where `s` has been placed."""
        places = self._points(s)
        twists = twists_about_origin(s.cdof, s.subtree_com[self.model.dof_root])
        point, dof = self.moved
        velocity = twists[dof, :3] + cross(twists[dof, 3:], places[point])
        row = (3 * point[:, None] + np.arange(3)).ravel()
        shape = (3 * len(places), self.model.nv)
        points = csr_array((velocity.ravel(), (row, np.repeat(dof, 3))), shape=shape)
        points.eliminate_zeros()
        return csr_array(self.spread @ points)

    def of_vertices(self, velocity: Array) -> Array:
        """(nv,) velocity of the free points from that of vertices (n, 3), each point being one."""
        carried = self.weights.T @ velocity / self.weights.sum(axis=0)[:, None]
        point, dof = self.moved
        own = self.dofs[dof]
        spread = np.zeros(self.model.nv)
        axis = self.model.mj.jnt_axis[self.model.mj.dof_jntid[dof[own]]]
        spread[dof[own]] = (axis * carried[point[own]]).sum(axis=1)
        return spread

    def _points(self, s: Scratch) -> Array:
        """(np, 3) the points where `s` has been placed."""
        return _placed(s.xpos, s.xmat.reshape(-1, 3, 3), self.body, self.offset)

    @cached_property
    def places(self) -> NDArray[np.bool_]:
        """(nq,) places in q of points of flesh alone."""
        mj = self.model.mj
        own = np.zeros(mj.nq, bool)
        own[mj.jnt_qposadr[mj.dof_jntid[self.dofs]]] = True
        return own

    @cached_property
    def spread(self) -> csr_array:
        """(3n, 3np) `weights` for each of three components.

        In a slab a vertex has the mean velocity of its column along z, and what pushes it pushes
        the whole column.
        """
        weights = self.weights
        if self.model.slab:
            _, column = np.unique(self.rest[:, :2].round(9), axis=0, return_inverse=True)
            one = np.ones(len(column))
            members = csr_array((one, (np.arange(len(column)), column.ravel())))
            weights = csr_array(
                members @ diags_array(1.0 / members.sum(axis=0)) @ members.T @ weights
            )
        return csr_array(kron(weights, eye_array(3), format="csr"))

    @cached_property
    def thickness(self) -> tuple[float, ...]:
        """Of each flesh at rest but for its rims, m."""
        every = range(len(self.names))
        skins = [self.surface[self.of_surface == f] for f in every]
        return tuple(thinnest(self.rest, skin, self.model.slab) for skin in skins)

    def volume_ratios(self, vertices: Array) -> Array:
        """(m,) det F of each element: its volume over that at rest, negative when inside out."""
        return volumes(vertices, self.elements) / volumes(self.rest, self.elements)


def flesh_of(model: Jointed) -> Flesh:
    """The flesh of a model that has some. Raises ValueError when it has none."""
    mj = model.mj
    if mj.nflex == 0:
        raise ValueError("the model has no flesh. Give it a flex of tetrahedra.")
    caged = [bool(mj.flex_interp[f]) for f in range(mj.nflex)]
    parts = [_points(mj, f) if caged[f] else _own(mj, f) for f in range(mj.nflex)]
    body = np.concatenate([p[0] for p in parts]).astype(np.int64)
    offset = np.concatenate([p[1] for p in parts])
    weights = csr_array(block_diag([p[2] for p in parts], format="csr"))
    position, rotation, _, _ = rest_poses(mj)
    rest = np.asarray(weights @ _placed(position, rotation, body, offset))
    elements = [_elements(mj, f, rest) for f in range(mj.nflex)]
    free = points_of_flesh(mj)
    surfaces = [outer_surface(rest, e) for e in elements]
    every = np.concatenate(elements)
    return Flesh(
        model,
        tuple(element_name(mj, mujoco.mjtObj.mjOBJ_FLEX, f) for f in range(mj.nflex)),
        body,
        offset,
        weights,
        rest,
        every,
        np.concatenate(surfaces),
        np.repeat(np.arange(mj.nflex), [len(t) for t in surfaces]),
        np.repeat(np.arange(mj.nflex), [len(e) for e in elements]),
        _flesh_dofs(mj),
        _moved(mj, body),
        np.asarray(weights @ _carried(mj, rest, every, weights, np.where(free[body], -1, body))),
    )


def points_of_flesh(mj: mujoco.MjModel) -> NDArray[np.bool_]:
    """(nbody of MuJoCo,) bodies that are a point of flesh and nothing else."""
    holding = np.zeros(mj.nbody, bool)
    holding[mj.flex_vertbodyid[mj.flex_vertbodyid >= 0]] = True
    holding[mj.flex_nodebodyid[mj.flex_nodebodyid >= 0]] = True
    sliding = np.zeros(mj.nbody, np.int64)
    slides = mj.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
    np.add.at(sliding, mj.jnt_bodyid[slides], 1)
    own = (mj.body_geomnum == 0) & (mj.body_dofnum > 0) & (sliding == mj.body_dofnum)
    return np.asarray(holding & own)


def surface_of(elements: Indices) -> Indices:
    """(k, 3) the faces of right-handed tetrahedra (m, 4) that only one has, turned outward."""
    corners = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
    faces = elements[:, corners].reshape(-1, 3)
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    return np.asarray(faces[np.sort(first[count == 1])])


def outer_surface(points: Array, elements: Indices) -> Indices:
    """(k, 3) outward triangles around tetrahedra (m, 4) of points (n, 3), those of holes left out.

    What flesh encloses, bones for the most part, counts as inside.
    """
    triangles = surface_of(elements)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]])
    count = len(points)
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    sheet = connected_components(graph, directed=False)[1][triangles[:, 0]]
    enclosed = np.bincount(sheet, np.linalg.det(points[triangles]))
    return np.asarray(triangles[enclosed[sheet] > 0.0])


def _placed(position: Array, rotation: Array, body: Indices, offset: Array) -> Array:
    return np.asarray(position[body] + np.einsum("nij,nj->ni", rotation[body], offset))


def _own(mj: mujoco.MjModel, flex: int) -> tuple[Indices, Array, csr_array]:
    first, count = mj.flex_vertadr[flex], mj.flex_vertnum[flex]
    chosen = slice(first, first + count)
    return mj.flex_vertbodyid[chosen], mj.flex_vert[chosen], eye_array(count, format="csr")


def _points(mj: mujoco.MjModel, flex: int) -> tuple[Indices, Array, csr_array]:
    first, count = mj.flex_nodeadr[flex], mj.flex_nodenum[flex]
    chosen = slice(first, first + count)
    return mj.flex_nodebodyid[chosen], mj.flex_node[chosen], node_weights(mj, flex)


def _elements(mj: mujoco.MjModel, flex: int, rest: Array) -> Indices:
    """The tetrahedra of a flex; MuJoCo's compiler turns them left-handed."""
    first, count = mj.flex_elemdataadr[flex], mj.flex_elemnum[flex]
    corners = mj.flex_elem[first : first + 4 * count].reshape(-1, 4)
    return right_handed(rest, np.asarray(corners + mj.flex_vertadr[flex], dtype=np.int64))


def _flesh_dofs(mj: mujoco.MjModel) -> NDArray[np.bool_]:
    """Dofs of points of flesh that hang on the world."""
    hung = points_of_flesh(mj) & (mj.body_parentid == 0)
    return np.asarray(hung[mj.dof_bodyid])


def _moved(mj: mujoco.MjModel, body: Indices) -> Indices:
    """(2, k) pairs of a point, riding on `body` (np,), and a dof that moves it."""
    chains: list[list[int]] = [[]]
    for b in range(1, mj.nbody):
        first = int(mj.body_dofadr[b])
        chains.append(
            chains[mj.body_parentid[b]] + [first + n for n in range(int(mj.body_dofnum[b]))]
        )
    pairs = [(point, dof) for point, b in enumerate(body) for dof in chains[b]]
    return np.array(pairs, np.int64).reshape(-1, 2).T


def _carried(
    mj: mujoco.MjModel, rest: Array, elements: Indices, weights: csr_array, bone: Indices
) -> Array:
    """(np, bones) share of each bone in carrying a point: harmonic along the elements' edges.

    bone  (np,) bone that holds the point, -1 for none; points that no bone is joined to are the
          world's
    """
    bones = int((~points_of_flesh(mj)).sum())
    pairs = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
    edges = np.unique(np.sort(elements[:, pairs].reshape(-1, 2), axis=1), axis=0)
    strength = 1.0 / np.square(rest[edges[:, 0]] - rest[edges[:, 1]]).sum(axis=1)
    count = len(rest)
    links = coo_array((strength, (edges[:, 0], edges[:, 1])), shape=(count, count)).tocsr()
    links = links + links.T
    laplacian = csr_array(weights.T @ (diags_array(links.sum(axis=1)) - links) @ weights)
    held, free = np.flatnonzero(bone >= 0), np.flatnonzero(bone < 0)
    share = np.zeros((len(bone), bones))
    share[held, bone[held]] = 1.0
    if free.size and held.size:
        _, label = connected_components(laplacian, directed=False)
        loose = free[~np.isin(label[free], label[held])]
        share[loose, 0] = 1.0
        free = np.setdiff1d(free, loose)
        given = np.setdiff1d(np.arange(len(bone)), free)
        right = -(laplacian[free][:, given] @ share[given])
        found = spsolve(laplacian[free][:, free].tocsc(), right)
        share[free] = np.clip(np.asarray(found).reshape(len(free), bones), 0.0, 1.0)
        share[free] /= share[free].sum(axis=1, keepdims=True)
    elif free.size:
        share[free, 0] = 1.0
    return share
