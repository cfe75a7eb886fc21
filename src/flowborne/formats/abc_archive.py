"""The objects of an Alembic archive: a sample for each state, at the times of the run.

As other programs have it, y is up and triangles are wound clockwise seen from outside; lengths are
in m. Each geometry is a mesh under a transform of its name, each flesh a mesh with its vertices.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from alembic3d import Abc, AbcGeom
from alembic3d.AbcCoreAbstract import TimeSampling
from numpy.typing import NDArray

from flowborne.formats.creature import Array, Creature, Integers
from flowborne.version import __version__

import imath  # isort: skip (found once alembic3d is there)

Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""From z up to y up."""


def write_archive(creature: Creature, path: Path) -> None:
    """Write the bodies and the flesh of a run to `path`."""
    run = creature.run
    archive = Abc.CreateArchiveWithInfo(str(path), f"flowborne {__version__}", run.name)
    step = 1.0 / run.frames_per_second
    times = archive.addTimeSampling(TimeSampling(step, run.frames[0] * step))
    turn, shift = creature.skeleton.carried
    for surface in creature.surfaces:
        transform = AbcGeom.OXform(archive.getTop(), _object(surface.name))
        if surface.bone >= 0:
            schema = transform.getSchema()
            schema.setTimeSampling(times)
            for number in range(len(run)):
                schema.set(_moved(turn[number, surface.bone], shift[number, surface.bone]))
        mesh = AbcGeom.OPolyMesh(transform, _object(f"{surface.name}Shape")).getSchema()
        mesh.set(_mesh(surface.vertices, surface.faces))
    for skin in creature.skins:
        mesh = AbcGeom.OPolyMesh(archive.getTop(), _object(skin.name)).getSchema()
        mesh.setTimeSampling(times)
        for number in range(len(run)):
            places = run.arrays["flesh_vertices"][number][skin.chosen]
            mesh.set(_mesh(places, skin.faces))


def _object(name: str) -> str:
    """A name that Alembic takes: a slash would end it."""
    return name.replace("/", "_")


def _mesh(vertices: NDArray[Any], faces: Integers) -> Any:
    """A sample of a mesh of outward triangles."""
    points = np.ascontiguousarray(vertices @ Y_UP.T, np.float32)
    corners = np.ascontiguousarray(faces[:, ::-1].ravel(), np.int32)
    return AbcGeom.OPolyMeshSchemaSample(
        imath.V3fArrayFromBuffer(points),
        imath.IntArrayFromBuffer(corners),
        imath.IntArrayFromBuffer(np.full(len(faces), 3, np.int32)),
    )


def _moved(turn: Array, shift: Array) -> Any:
    """A sample of the transform x -> R x + t; Alembic's matrices multiply rows."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[3, :3] = (Y_UP @ turn @ Y_UP.T).T, Y_UP @ shift
    sample = AbcGeom.XformSample()
    sample.setMatrix(imath.M44d(*matrix.ravel().tolist()))
    return sample
