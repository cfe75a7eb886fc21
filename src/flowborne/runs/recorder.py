"""The state files of a run, from which any frame can be drawn without the solver."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flowborne.base.atomic import sync_files, write_atomically, write_json
from flowborne.coupling.world import Setup, World
from flowborne.kernels.arrays import Array, Integers
from flowborne.runs.run_folder import RunFolder
from flowborne.shapes.mesh import ShapeMesh
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.flesh import Flesh
from flowborne.solids.geoms import rest_poses
from flowborne.solids.mjcf import MjModel
from flowborne.solids.model import SolidModel
from flowborne.solids.skins import clad_bodies, skins_of

BYTES_PER_MEMBER = 300
"""Overhead of an array in an npz file: two headers and two names."""


class Recorder:
    """Writes states/NNNNNN.npz of a run.

    Each file contains the arrays of `states.QUANTITIES` and the dyes, in single precision except
    for time and grid_origin: those of the fluid where there is one, no velocity_z in a slab.

    Files are written atomically. `sync` flushes all of them to the disc together: one by one, this
    would take longer than writing them.
    """

    def __init__(self, folder: RunFolder) -> None:
        self.folder = folder
        self._written: list[Path] = []

    def write(self, frame: int, world: World, force: Array | None) -> None:
        """Write the state after `frame` frames.

        force   (nb, 3) N, to draw; None at the start
        raises  OSError when the file cannot be written; no part of it is then left
        """
        arrays = self.arrays(world, force)
        path = self.folder.state(frame)
        write_atomically(path, lambda file: np.savez(file, **arrays), durable=False)  # type: ignore[arg-type]
        self._written.append(path)

    def sync(self) -> None:
        """Wait until every written state is on the disc."""
        sync_files(self._written)
        self._written.clear()

    def bytes_per_frame(self, world: World) -> int:
        """Approximate size of a state file."""
        arrays = self.arrays(world, None).values()
        return sum(values.nbytes + BYTES_PER_MEMBER for values in arrays)

    def arrays(self, world: World, force: Array | None) -> dict[str, NDArray[Any]]:
        """The arrays of a state file for `world`."""
        solid = world.setup.solid
        pose = kinematics(solid, world.solid.q)
        kept: dict[str, Array] = {
            "q": world.solid.q,
            "v": world.solid.v,
            "geom_position": pose.geom_position,
            "geom_rotation": pose.geom_rotation,
            "body_position": pose.body_position,
            "body_rotation": pose.body_rotation,
            "fluid_centre": centres(solid, pose),
            "fluid_force": np.zeros_like(pose.centroid) if force is None else force,
        }
        if solid.flesh is not None:
            kept["flesh_vertices"] = pose.vertices[on_skin(solid.flesh)]
        if world.fluid is not None and world.setup.fluid is not None:
            named = world.fluid.arrays()
            axes = [f"velocity_{'xyz'[axis]}" for axis in world.setup.fluid.grid.axes]
            scalars = [name for name in named if name.startswith("scalar_")]
            kept |= {name: named[name] for name in ("pressure", *axes, *scalars)}
            kept["open"] = open_cells(world)
        exact = {"time": np.array(world.time)}
        if world.setup.fluid is not None:
            exact["grid_origin"] = np.array(world.setup.fluid.grid.origin)
        return exact | {name: values.astype(np.float32) for name, values in kept.items()}


def open_cells(world: World) -> Array:
    """(nx, ny, nz) open fraction of each cell, from the bodies' distance to its centre."""
    from flowborne.coupling.cut import cut_by_bodies

    assert world.setup.fluid is not None
    distance = cut_by_bodies(world).distance
    for _ in range(3):
        # mean of neighbours along the first axis, which then becomes the last; once per axis
        distance = np.moveaxis(0.5 * (distance[1:] + distance[:-1]), 0, -1)
    return np.clip(0.5 + distance / world.setup.fluid.grid.spacing, 0.0, 1.0)


def centres(solid: SolidModel, pose: Kinematics) -> Array:
    """(nb, 3) centroid of each body with the flesh that it carries, m."""
    flesh = solid.flesh
    if flesh is None:
        return pose.centroid
    carried = flesh.carried * flesh.volumes[:, None]
    volume = (solid.volume + carried.sum(axis=0))[:, None]
    moment = solid.volume[:, None] * pose.centroid + carried.T @ pose.vertices
    return np.where(volume > 0.0, moment / np.where(volume > 0.0, volume, 1.0), pose.centroid)


def on_skin(flesh: Flesh) -> Integers:
    """(k,) vertices of flesh on its surface, ascending."""
    return np.unique(flesh.surface)


def write_model(
    folder: RunFolder,
    setup: Setup,
    *,
    controlled: list[str],
    frames_per_second: float,
    wind: list[list[float]],
    taken: Sequence[str] = (),
) -> None:
    """Write model.json: the constant data to draw the run or to use it in another run.

    controlled  names of the controlled joints
    wind        directions and speeds of the streams, m/s, to draw as arrows
    taken       names of the joints that repeat their motion of an earlier run
    """
    solid, fluid = setup.solid, setup.fluid
    joint_bodies = solid.mj.jnt_bodyid
    of_bones = np.flatnonzero(joint_bodies < solid.nbody)
    names = [solid.joint_names[joint] for joint in of_bones]
    grid = None
    if fluid is not None:
        grid = {
            "shape": list(fluid.grid.shape),
            "spacing": fluid.grid.spacing,
            "origin": list(fluid.grid.origin),
        }
    write_json(
        folder.model,
        {
            "slab": solid.slab,
            "bodies": list(solid.body_names),
            "joints": names,
            "joint_bodies": joint_bodies[of_bones].tolist(),
            "controlled": controlled,
            "decided": [*taken, *controlled],
            "places": {name: _entries(solid, name) for name in names},
            "grid": grid,
            "geoms": _geoms(solid),
            "flesh": None if solid.flesh is None else _flesh(solid.flesh, solid.mj),
            "skins": [] if solid.slab else _skins(solid),
            "frames_per_second": frames_per_second,
            "wind": wind,
        },
    )


def _entries(solid: SolidModel, joint: str) -> list[int]:
    """Begin and end of the entries of q of a joint."""
    entries = solid.positions_of(joint)
    return [int(entries[0]), int(entries[-1]) + 1]


def _geoms(solid: SolidModel) -> list[dict[str, Any]]:
    """The geometries in the order of geom_position."""
    listed = []
    clad = np.zeros(solid.nbody, bool) if solid.slab else clad_bodies(solid.mj)[: solid.nbody]
    for geom, shape in enumerate(solid.geom_shape):
        entry: dict[str, Any] = {
            "type": shape.kind,
            "size": solid.geom_size[geom].tolist(),
            "body": int(solid.geom_body[geom]),
            "rgba": solid.geom_rgba[geom].tolist(),
            "covered": bool(solid.geom_covered[geom] or clad[solid.geom_body[geom]]),
        }
        if isinstance(shape, ShapeMesh):
            entry |= {"vertices": shape.vertices.tolist(), "faces": shape.faces.tolist()}
        listed.append(entry)
    return listed


def _skins(solid: SolidModel) -> list[dict[str, Any]]:
    """The skins of the model at its rest pose, and the poses of their bodies there."""
    listed = []
    position, rotation, _, _ = rest_poses(solid.mj)
    for skin in skins_of(solid.mj):
        bodies = np.flatnonzero(skin.weights.any(axis=0))
        listed.append(
            {
                "name": skin.name,
                "rgba": skin.rgba.tolist(),
                "vertices": skin.vertices.tolist(),
                "triangles": skin.faces.tolist(),
                "bodies": bodies.tolist(),
                "weights": skin.weights[:, bodies].tolist(),
                "body_position": position[bodies].tolist(),
                "body_rotation": rotation[bodies].tolist(),
            }
        )
    return listed


def _flesh(flesh: Flesh, mj: MjModel) -> dict[str, Any]:
    """The skin: triangles of the vertices in the states, and the bodies that carry flesh; both also
    at rest."""
    bodies = np.flatnonzero(flesh.carried.any(axis=0))
    position, rotation, _, _ = rest_poses(mj)
    return {
        "names": list(flesh.names),
        "triangles": np.searchsorted(on_skin(flesh), flesh.surface).tolist(),
        "of_triangles": flesh.of_surface.tolist(),
        "rest": flesh.rest[on_skin(flesh)].tolist(),
        "bodies": bodies.tolist(),
        "body_position": position[bodies].tolist(),
        "body_rotation": rotation[bodies].tolist(),
    }
