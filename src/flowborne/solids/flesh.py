"""The flesh of a model: its vertices, elements and surface, and where they are."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csr_array, eye_array, kron

from flowborne.solids.cage import node_weights
from flowborne.solids.mjcf import element_name, rest_poses
from flowborne.solids.model import SolidModel
from flowborne.solids.momentum import dof_twists
from flowborne.solids.scratch import scratch
from flowborne.solids.tissue import volumes

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


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
    surface     (k, 3) triangles of vertices, outward
    of_element  (m,) number of the flesh in `names`
    dofs        (nv,) dofs that move points of flesh alone; the others are those of bones
    moved       (2, k) pairs of a point and a dof that moves it
    """

    model: SolidModel
    names: tuple[str, ...]
    body: Indices
    offset: Array
    weights: csr_array
    rest: Array
    elements: Indices
    surface: Indices
    of_element: Indices
    dofs: NDArray[np.bool_]
    moved: Indices

    def points(self, q: Array) -> Array:
        """(np, 3) places of the points at positions q (nq,), m."""
        s = scratch(self.model)
        s.place(q)
        return _placed(s.xpos, s.xmat.reshape(-1, 3, 3), self.body, self.offset)

    def vertices(self, q: Array) -> Array:
        """(n, 3) places of the vertices at positions q (nq,), m."""
        return np.asarray(self.weights @ self.points(q))

    def jacobian(self, q: Array) -> csr_array:
        """(3n, nv) sparse, from v to the velocities of the vertices, x y z of each in turn."""
        places = self.points(q)
        s = scratch(self.model)
        twists = dof_twists(self.model, s)
        point, dof = self.moved
        velocity = twists[dof, :3] + np.cross(twists[dof, 3:], places[point])
        row = (3 * point[:, None] + np.arange(3)).ravel()
        shape = (3 * len(places), self.model.nv)
        carried = csr_array((velocity.ravel(), (row, np.repeat(dof, 3))), shape=shape)
        return csr_array(kron(self.weights, eye_array(3), format="csr") @ carried)

    def volume_ratios(self, vertices: Array) -> Array:
        """(m,) det F of each element: its volume over that at rest, negative when inside out."""
        return volumes(vertices, self.elements) / volumes(self.rest, self.elements)


def flesh_of(model: SolidModel) -> Flesh:
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
    return Flesh(
        model,
        tuple(element_name(mj, mujoco.mjtObj.mjOBJ_FLEX, f) for f in range(mj.nflex)),
        body,
        offset,
        weights,
        rest,
        np.concatenate(elements),
        np.concatenate([surface_of(e) for e in elements]),
        np.repeat(np.arange(mj.nflex), [len(e) for e in elements]),
        _flesh_dofs(model, body),
        np.stack(np.nonzero(model.moves[body])),
    )


def surface_of(elements: Indices) -> Indices:
    """(k, 3) the faces of right-handed tetrahedra (m, 4) that only one has, turned outward."""
    corners = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
    faces = elements[:, corners].reshape(-1, 3)
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    return np.asarray(faces[np.sort(first[count == 1])])


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
    elements = np.asarray(corners + mj.flex_vertadr[flex], dtype=np.int64)
    left = volumes(rest, elements) < 0.0
    elements[left] = elements[left][:, [0, 1, 3, 2]]
    return elements


def _flesh_dofs(model: SolidModel, body: Indices) -> NDArray[np.bool_]:
    """Dofs of bodies that carry a point of flesh, hang on the world and slide along its axes."""
    mj = model.mj
    hung = (mj.body_parentid[body] == 0) & (mj.body_dofnum[body] > 0)
    own = np.zeros(model.nbody, bool)
    own[body[hung & (mj.body_geomnum[body] == 0)]] = True
    slides = mj.jnt_type[mj.dof_jntid] == mujoco.mjtJoint.mjJNT_SLIDE
    return np.asarray(own[model.dof_body] & slides)
