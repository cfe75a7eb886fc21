"""The flesh of a model: its nodes, elements and skin at any pose, and inverted elements.

The skin is made of vertices. In three dimensions they are the nodes; in a slab each node in the
plane z = 0 has one vertex at either end of a prism of unit depth.

Method: docs/method/flesh.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, eye_array, vstack
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

from flowborne.base.phrases import location
from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.shapes.mesh import smooth_sheets
from flowborne.shapes.thickness import thinnest
from flowborne.solids.elasticity import Elasticity
from flowborne.solids.elements import measures, outer_surface, parts, prism, with_middles
from flowborne.solids.geoms import rest_poses
from flowborne.solids.pattern import Pattern, incidence, pattern_of
from flowborne.solids.scratch import Compiled, Scratch, cross, posed, twists_about_origin
from flowborne.solids.tissue.growth import Grown


@dataclass(frozen=True)
class Flesh:
    """The flesh of a model. A node is a separate body, or is fixed to the bone that holds it.

    model       the model
    slab        whether it is in the plane z = 0
    names       names of its fleshes
    body        (np,) body that each node is, or is fixed to
    offset      (np, 3) the node in that body's frame, m
    weights     (n, np) node of each vertex, and lift (n, 3), offset of the vertex from it, m
    rest        (n, 3) vertices at rest, m; the first are the nodes, apart from their lift
    elements    (m, 10) nodes of quadratic tetrahedra, or (m, 6) of triangles in a slab
    surface     (k, 3) triangles of vertices, outward; none around enclosed bones
    of_surface  (k,) number of the flesh in `names` of each triangle
    of_element  (m,) the same for elements
    dofs        (nv,) dofs that move only nodes; the others are those of bones
    moved       (2, k) pairs of a node and a dof that moves it
    carried     (n, nbody) share of each bone in the motion of a vertex, from 0 to 1, sum 1
    elasticity  forces between the nodes
    damping     s, Rayleigh's: the damping matrix is this times the stiffness matrix
    """

    model: Compiled
    slab: bool
    names: tuple[str, ...]
    body: Integers
    offset: Array
    weights: csr_array
    lift: Array
    rest: Array
    elements: Integers
    surface: Integers
    of_surface: Integers
    of_element: Integers
    dofs: Mask
    moved: Integers
    carried: Array
    elasticity: Elasticity
    damping: float

    def vertices(self, q: Array) -> Array:
        """(n, 3) positions of the vertices at q (nq,), m."""
        return self.placed(posed(self.model, q))

    def jacobian(self, q: Array) -> csr_array:
        """(3n, nv) sparse, from v to the velocities of the vertices, x y z of each in turn."""
        return self.moving(posed(self.model, q))

    def placed(self, s: Scratch) -> Array:
        """(n, 3) the vertices at the pose in `s`, m."""
        return np.asarray(self.weights @ self.nodes(s) + self.lift)

    def moving(self, s: Scratch) -> csr_array:
        """(3n, nv) `jacobian` at the pose in `s`."""
        return self._moving(s, self._vertex_entries)

    def nodes(self, s: Scratch) -> Array:
        """(np, 3) the nodes at the pose in `s`, m."""
        rotation = s.xmat.reshape(-1, 3, 3)[self.body]
        return np.asarray(s.xpos[self.body] + np.einsum("nij,nj->ni", rotation, self.offset))

    def moving_nodes(self, s: Scratch) -> csr_array:
        """(3np, nv) from v to the velocities of the nodes at the pose in `s`."""
        return self._moving(s, self._entries)

    def _moving(self, s: Scratch, entry: csr_array) -> csr_array:
        """Matrix of the velocities of the pairs `moved` that `entry` has the indices of."""
        twists = twists_about_origin(s.cdof, s.dof_centre())
        node, dof = self.moved
        velocity = twists[dof, :3] + cross(twists[dof, 3:], self.nodes(s)[node])
        data = velocity.ravel()[entry.data]
        return csr_array((data, entry.indices, entry.indptr), shape=entry.shape)

    @cached_property
    def _vertex_entries(self) -> csr_array:
        """(3n, nv) the same as `_entries` for the vertices."""
        return csr_array(self._entries[(3 * self.weights.indices[:, None] + np.arange(3)).ravel()])

    @cached_property
    def _entries(self) -> csr_array:
        """(3np, nv) the possible entries of `moving_nodes`: each is the index of its value in the
        velocities, x y z of the pairs `moved` one after the other. Free nodes move along axes."""
        node, dof = self.moved
        row = 3 * node[:, None] + np.arange(3)
        axis = self.model.mj.jnt_axis[self.model.mj.dof_jntid[dof]]
        pair, along = np.nonzero((axis != 0.0) | ~self.dofs[dof, None])
        shape = (3 * len(self.body), self.model.mj.nv)
        return csr_array((3 * pair + along, (row[pair, along], dof[pair])), shape=shape)

    @cached_property
    def pattern(self) -> Pattern:
        """Places of the entries of matrices between dofs."""
        shape = len(self.body), self.model.mj.nv
        moves = incidence(self.elements, self.moved, shape)
        return pattern_of(self.model.mj, moves, ~self.dofs)

    def of_vertices(self, velocity: Array) -> Array:
        """(nv,) velocity of the free nodes from that of the vertices (n, 3)."""
        carried = self.weights.T @ velocity / self.weights.sum(axis=0)[:, None]
        dof, node, axis = self._free
        spread = np.zeros(self.model.mj.nv)
        spread[dof] = (axis * carried[node]).sum(axis=1)
        return spread

    @cached_property
    def _free(self) -> tuple[Integers, Integers, Array]:
        """(k,) dofs of free nodes, (k,) the node that each moves, and (k, 3) along which axis."""
        node, dof = self.moved
        own = self.dofs[dof]
        return dof[own], node[own], self.model.mj.jnt_axis[self.model.mj.dof_jntid[dof[own]]]

    @cached_property
    def positions(self) -> Mask:
        """(nq,) the entries of q that belong to nodes of flesh."""
        mj = self.model.mj
        own = np.zeros(mj.nq, bool)
        own[mj.jnt_qposadr[mj.dof_jntid[self.dofs]]] = True
        return own

    @cached_property
    def thickness(self) -> tuple[float, ...]:
        """Thickness of each flesh at rest, without its rims, m."""
        return tuple(thinnest(self.rest, skin, self.slab) for skin in self.skins)

    @cached_property
    def sheets(self) -> Integers:
        """(k,) smooth sheet at rest of each triangle of the surface."""
        return smooth_sheets(self.rest, self.surface)

    @cached_property
    def skins(self) -> list[Integers]:
        """(m, 3) triangles of each flesh, outward."""
        return [self.surface[self.of_surface == f] for f in range(len(self.names))]

    @cached_property
    def outer(self) -> list[Integers]:
        """(k,) vertices of each skin."""
        return [np.unique(skin) for skin in self.skins]

    @cached_property
    def volumes(self) -> Array:
        """(n,) volume of flesh around each vertex at rest, m^3; m^2 in a slab."""
        nodes, linear = self.elasticity.rest, parts(self.elements)
        corners = linear.shape[1]
        share = np.repeat(measures(nodes, linear) / corners, corners)
        around = np.bincount(linear.ravel(), share, len(nodes))
        return np.asarray(self.weights @ (around / self.weights.sum(axis=0)))

    def volume_ratios(self, q: Array) -> Array:
        """(m,) least det F of each element, negative when inside out, at positions q (nq,)."""
        return self.elasticity.volume_ratios(self.nodes(posed(self.model, q)))


def flesh_of(model: Compiled, slab: bool, grown: Sequence[Grown]) -> Flesh:
    """The flesh of a model from the grown parts."""
    mj, position, rotation = model.mj, *rest_poses(model.mj)[:2]
    first = np.cumsum([0, *(len(g.nodes) for g in grown)])
    nodes = np.concatenate([g.nodes for g in grown])
    body = np.concatenate([bodies_of(mj, g) for g in grown])
    offset = np.einsum("nji,nj->ni", rotation[body], nodes - position[body])
    elements = [g.elements + start for g, start in zip(grown, first[:-1], strict=True)]
    every, count = np.concatenate(elements), len(nodes)
    moduli = np.concatenate([np.tile(g.tissue.moduli, (len(g.elements), 1)) for g in grown])
    laws = np.repeat([int(g.tissue.law) for g in grown], [len(e) for e in elements])
    weights, lift = csr_array(eye_array(count)), np.zeros((count, 3))
    surfaces = [outer_surface(nodes, parts(e)) for e in elements if not slab]
    if slab:
        weights = csr_array(vstack([weights, weights]))
        lift = np.repeat([[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]], count, axis=0)
        surfaces = [prism(parts(e), count) for e in elements]
    own = points_of_flesh(mj, grown)
    bones = int((~own).sum())
    carried = _carried(bones, nodes, parts(every), np.where(own[body], -1, body))
    return Flesh(
        model,
        slab,
        tuple(g.name for g in grown),
        body,
        offset,
        weights,
        lift,
        np.asarray(weights @ nodes + lift),
        every,
        np.concatenate(surfaces),
        np.repeat(np.arange(len(grown)), [len(t) for t in surfaces]),
        np.repeat(np.arange(len(grown)), [len(e) for e in elements]),
        own[mj.dof_bodyid],
        _moved(mj, body),
        np.asarray(weights @ carried),
        Elasticity(nodes, every, moduli, laws),
        grown[0].tissue.damping,
    )


def points_of_flesh(mj: mujoco.MjModel, grown: Sequence[Grown]) -> Mask:
    """(nbody of MuJoCo,) bodies that are free nodes of flesh."""
    own = np.zeros(mj.nbody, bool)
    for g in grown:
        own[bodies_of(mj, g)[g.free]] = True
    return own


def bodies_of(mj: mujoco.MjModel, grown: Grown) -> Integers:
    """(n,) MuJoCo's numbers of the bodies that nodes are, or are fixed to."""
    number = {name: mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_BODY, name) for name in grown.bodies}
    return np.array([number[name] for name in grown.bodies], np.int64)


def _moved(mj: mujoco.MjModel, body: Integers) -> Integers:
    """(2, k) pairs of a node, fixed to `body` (np,), and a dof that moves it."""
    chains: list[list[int]] = [[]]
    for b in range(1, mj.nbody):
        first, count = int(mj.body_dofadr[b]), int(mj.body_dofnum[b])
        chains.append([*chains[mj.body_parentid[b]], *range(first, first + count)])
    pairs = [(point, dof) for point, b in enumerate(body) for dof in chains[b]]
    return np.array(pairs, np.int64).reshape(-1, 2).T


def _carried(bones: int, rest: Array, simplices: Integers, bone: Integers) -> Array:
    """(np, bones) share of each bone in the motion of a node, harmonic along the edges.

    bone  (np,) bone that holds the node, -1 for none; nodes that are connected to no bone belong to
          the world
    """
    count = len(rest)
    one, other = with_middles(count, simplices)[0].T
    strength = 1.0 / np.square(rest[one] - rest[other]).sum(axis=1)
    links = coo_array((strength, (one, other)), shape=(count, count)).tocsr()
    links = links + links.T
    laplacian = csr_array(diags_array(links.sum(axis=1)) - links)
    held, free = np.flatnonzero(bone >= 0), np.flatnonzero(bone < 0)
    share = np.zeros((len(bone), bones))
    share[held, bone[held]] = 1.0
    _, label = connected_components(laplacian, directed=False)
    loose = free[~np.isin(label[free], label[held])]
    share[loose, 0] = 1.0
    free = np.setdiff1d(free, loose)
    if free.size:
        given = np.setdiff1d(np.arange(count), free)
        right = -(laplacian[free][:, given] @ share[given])
        found = spsolve(laplacian[free][:, free].tocsc(), right)
        share[free] = np.clip(np.asarray(found).reshape(len(free), bones), 0.0, 1.0)
        share[free] /= share[free].sum(axis=1, keepdims=True)
    return share


@dataclass(frozen=True)
class Inversion:
    """Elements with det F <= 0: they are inside out.

    A St. Venant-Kirchhoff material softens under compression. Below 1/sqrt(3) of its length it
    collapses, and its mirror image is at rest, so an inverted element can stay inverted.

    elements  (k,) numbers of the elements, ascending
    of        number of all elements
    ratio     the smallest det F
    worst     where it is, in words
    """

    elements: Integers
    of: int
    ratio: float
    worst: str

    def sentence(self) -> str:
        """A message for the user, without a full stop."""
        return (
            f"{len(self.elements)} of {self.of} elements of flesh are inside out, the worst "
            f"{self.worst}. Take shorter steps, stiffen the flesh, or give it larger elements there"
        )


def inversion(flesh: Flesh, q: Array) -> Inversion | None:
    """The inverted elements at positions q (nq,); None without any."""
    ratios = flesh.volume_ratios(q)
    wrong = np.flatnonzero(~(ratios > 0.0))
    if wrong.size == 0:
        return None
    worst = int(wrong[np.argmin(ratios[wrong])])
    ratio, name = float(ratios[worst]), flesh.names[int(flesh.of_element[worst])]
    middle = flesh.vertices(q)[flesh.elements[worst]].mean(axis=0)
    where = f"in '{name}' at {location(middle)} with det F = {ratio:.3g} (element {worst})"
    return Inversion(wrong, len(ratios), ratio, where)
