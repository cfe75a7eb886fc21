"""Growing flesh onto the bones of an MJCF model: quadratic elements, held by bones at nodes.

Linear tetrahedra lock: one layer of them across a bending skin is several times too stiff, the more
so the closer Poisson's ratio is to 1/2. A node that no bone holds becomes a separate body that
slides freely in the world. As a child of a bone it would move in the frame of the bone, and the row
and column of the bone would be full in both the mass and the stiffness matrix.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import mujoco
import numpy as np

from flowborne.base.arguments import NOT_NEGATIVE, POSITIVE, check
from flowborne.base.errors import SceneError
from flowborne.base.phrases import location
from flowborne.kernels import elastic
from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.solids.elements import lumped, measures, with_middles
from flowborne.solids.geoms import rest_poses, rotation_of
from flowborne.solids.mjcf import ARENA, compiled_quietly

WORLD = "world"

NODES_PER_ATTACH = 250
"""Nodes that are added to a model at once: MuJoCo searches the whole model at each addition."""

LEAST_INERTIA = 1e-12
"""MuJoCo refuses moving bodies of less than 1e-15 kg m^2, even those that only slide."""


class Law(IntEnum):
    """The law of stress and strain; all agree for small strains. See kernels.elastic.

    SAINT_VENANT_KIRCHHOFF  collapses under strong compression, and may stay inverted
    STABLE_NEO_HOOKEAN      recovers from inversion
    """

    SAINT_VENANT_KIRCHHOFF = elastic.SAINT_VENANT_KIRCHHOFF
    STABLE_NEO_HOOKEAN = elastic.STABLE_NEO_HOOKEAN


@dataclass(frozen=True)
class Tissue:
    """An elastic material.

    young    N/m^2
    poisson  from 0 to below 0.5
    density  kg/m^3
    damping  s, Rayleigh's: the damping matrix is this times the stiffness matrix
    raises   SceneError for other numbers
    """

    young: float
    poisson: float
    density: float
    damping: float = 0.0
    law: Law = Law.SAINT_VENANT_KIRCHHOFF

    def __post_init__(self) -> None:
        check(self, young=POSITIVE, density=POSITIVE, damping=NOT_NEGATIVE, poisson=NOT_NEGATIVE)
        if self.poisson >= 0.5:
            raise SceneError(f"poisson is {self.poisson:g}; give a number from 0 to below 0.5")

    @property
    def moduli(self) -> tuple[float, float]:
        """Lame's constants mu and lambda, N/m^2."""
        mu = 0.5 * self.young / (1.0 + self.poisson)
        return mu, 2.0 * mu * self.poisson / (1.0 - 2.0 * self.poisson)


@dataclass(frozen=True)
class Grown:
    """Flesh with nodes that are bodies of a model, or are fixed to them.

    name      of the flesh
    nodes     (n, 3) at rest in world axes, m: the points of the mesh, then middles of edges
    elements  (m, 10) nodes of tetrahedra, or (m, 6) of triangles in a slab
    bodies    n names of the bodies that the nodes are, or are fixed to
    free      (n,) nodes that are separate bodies
    tissue    its material
    """

    name: str
    nodes: Array
    elements: Integers
    bodies: tuple[str, ...]
    free: Mask
    tissue: Tissue


def add_flesh(
    spec: mujoco.MjSpec,
    name: str,
    points: Array,
    simplices: Integers,
    tissue: Tissue,
    holders: Sequence[str],
) -> Grown:
    """Add flesh to a model, for `SolidModel.with_flesh`; its mass is lumped to its nodes.

    points     (n, 3) at rest, in world axes, m; z = 0 in a slab
    simplices  (m, 4) points of each tetrahedron, or (m, 3) of each triangle in a slab, of positive
               volume or area; the middles of their edges become nodes
    holders    n names: the body that holds the point, "" for none. A body that holds both ends of
               an edge holds its middle. A body gets the mass of the nodes that it holds
    raises     ValueError for an element without volume, and for an unknown holder
    """
    volume = measures(points, simplices)
    if not volume.min() > 0.0:
        worst = int(volume.argmin())
        middle, slab = points[simplices[worst]].mean(axis=0), simplices.shape[1] == 3
        raise ValueError(
            f"flesh '{name}': element {worst} at {location(middle)} has the "
            f"{'area' if slab else 'volume'} {volume[worst]:g} m^{2 if slab else 3}. "
            "Order its corners right-handed, or leave it out."
        )
    edges, elements = with_middles(len(points), simplices)
    nodes = np.concatenate([points, points[edges].mean(axis=1)])
    both = [holders[a] if holders[a] == holders[b] else "" for a, b in edges.tolist()]
    held_by = [*holders, *both]
    mass = tissue.density * lumped(nodes, elements)
    inertia = 0.4 * mass * (0.75 * mass / (np.pi * tissue.density)) ** (2.0 / 3.0)
    frames = _frames(spec, name, held_by)
    for holder in sorted(frames.keys() - {WORLD}):
        position, rotation = frames[holder]
        held = np.array([h == holder for h in held_by])
        _load(spec, holder, (nodes[held] - position) @ rotation, mass[held], inertia[held])
    free = np.array([not holder for holder in held_by])
    loose = np.flatnonzero(free)
    for some in np.split(loose, range(NODES_PER_ATTACH, len(loose), NODES_PER_ATTACH)):
        spec.attach(
            _free_nodes(some, nodes, mass, inertia, "xyz"[: simplices.shape[1] - 1]),
            prefix=f"{name}:",
            frame=spec.worldbody.add_frame(),
        )
    spec.memory = ARENA
    bodies = tuple(holder or f"{name}:{i}" for i, holder in enumerate(held_by))
    return Grown(name, nodes, elements, bodies, free, tissue)


def _frames(
    spec: mujoco.MjSpec, name: str, holders: Sequence[str]
) -> dict[str, tuple[Array, Array]]:
    """Position and rotation at rest of the bodies that hold flesh."""
    mj = compiled_quietly(spec.copy())
    position, rotation, _, _ = rest_poses(mj)
    frames = {}
    for holder in {h for h in holders if h}:
        body = mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_BODY, holder)
        if body < 0:
            raise ValueError(
                f"flesh '{name}': there is no body '{holder}' to hold it. Name a body of the model."
            )
        frames[holder] = position[body], rotation[body]
    return frames


def _free_nodes(
    some: Integers, nodes: Array, mass: Array, inertia: Array, axes: str
) -> mujoco.MjSpec:
    """A model of some nodes of flesh that slide along some axes, named by their numbers."""
    spec = mujoco.MjSpec()
    for i in some.tolist():
        body = spec.worldbody.add_body(name=f"{i}", pos=nodes[i])
        body.mass, body.explicitinertial = mass[i], True
        body.inertia = np.full(3, max(inertia[i], LEAST_INERTIA))
        body.ipos = np.zeros(3)  # by default it would be `pos`
        for axis, direction in zip(axes, np.eye(3), strict=False):
            joint = body.add_joint(name=f"{i}:{axis}", type=mujoco.mjtJoint.mjJNT_SLIDE)
            joint.axis, joint.limited = direction, mujoco.mjtLimited.mjLIMITED_FALSE
    return spec


def _load(spec: mujoco.MjSpec, holder: str, offsets: Array, mass: Array, inertia: Array) -> None:
    """Add the mass of held nodes, at `offsets` (n, 3) in the frame of a bone, to the bone."""
    mj = compiled_quietly(spec.copy())
    b = mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_BODY, holder)
    axes = rotation_of(mj.body_iquat[b])
    masses = np.append(mass, mj.body_mass[b])
    centres = np.concatenate([offsets, mj.body_ipos[b][None]])
    centre = masses @ centres / masses.sum()
    arms = centres - centre
    about = np.eye(3) * (masses @ (arms**2).sum(axis=1) + inertia.sum()) - (arms.T * masses) @ arms
    about += axes @ np.diag(mj.body_inertia[b]) @ axes.T
    body = spec.body(holder)
    body.mass, body.ipos, body.explicitinertial = masses.sum(), centre, True
    body.iquat, body.inertia = (1.0, 0.0, 0.0, 0.0), np.zeros(3)
    body.fullinertia = about[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
