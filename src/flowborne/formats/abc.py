"""A run as an Alembic cache, by alembic3d.

Lengths are in m. By Alembic's conventions y is up and triangles are wound clockwise seen from
outside. Each geometry is a mesh under a transform with its name; each flesh is a mesh that deforms.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flowborne.base.atomic import replaced_whole
from flowborne.base.extras import optional
from flowborne.base.version import __version__
from flowborne.formats.creature import Creature
from flowborne.kernels.arrays import Array, Integers
from flowborne.runs.exporters import provided
from flowborne.runs.open_run import StoredRun

Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation from z up to y up."""


@provided(".abc")
@dataclass(frozen=True)
class ExporterAbc:
    """Rigid geometries under animated transforms, and flesh as a mesh that deforms."""

    def write(self, run: StoredRun, path: Path) -> None:
        optional("alembic3d", "alembic3d", "alembic", f"'{path.suffix}' files")
        creature = Creature(run)
        with replaced_whole(path) as new:
            _write_archive(creature, new)


def _write_archive(creature: Creature, path: Path) -> None:
    """Write the bodies and the flesh of a run to `path`, one sample per state."""
    from alembic3d import Abc, AbcGeom
    from alembic3d.AbcCoreAbstract import TimeSampling

    run = creature.run
    archive = Abc.CreateArchiveWithInfo(str(path), f"flowborne {__version__}", run.name)
    step = 1.0 / run.frames_per_second
    times = archive.addTimeSampling(TimeSampling(step, run.frames[0] * step))
    rotation, translation = creature.skeleton.carried
    for surface in creature.surfaces:
        transform = AbcGeom.OXform(archive.getTop(), _object_name(surface.name))
        if surface.bone >= 0:
            schema = transform.getSchema()
            schema.setTimeSampling(times)
            for R, t in zip(rotation[:, surface.bone], translation[:, surface.bone], strict=True):
                schema.set(_transform_sample(R, t))
        mesh = AbcGeom.OPolyMesh(transform, _object_name(f"{surface.name}Shape")).getSchema()
        mesh.set(_mesh_sample(surface.vertices, surface.faces))
    for skin in creature.skins:
        mesh = AbcGeom.OPolyMesh(archive.getTop(), _object_name(skin.name)).getSchema()
        mesh.setTimeSampling(times)
        for number in range(len(run)):
            vertices = run.arrays["flesh_vertices"][number][skin.chosen]
            mesh.set(_mesh_sample(vertices, skin.faces))


def _object_name(name: str) -> str:
    """A valid name of an Alembic object, which cannot contain a slash."""
    return name.replace("/", "_")


def _mesh_sample(vertices: NDArray[Any], faces: Integers) -> Any:
    """A sample of a mesh of outward triangles."""
    from alembic3d import AbcGeom  # before imath, whose path it sets

    import imath  # isort: skip

    points = np.ascontiguousarray(vertices @ Y_UP.T, np.float32)
    corners = np.ascontiguousarray(faces[:, ::-1].ravel(), np.int32)
    return AbcGeom.OPolyMeshSchemaSample(
        imath.V3fArrayFromBuffer(points),
        imath.IntArrayFromBuffer(corners),
        imath.IntArrayFromBuffer(np.full(len(faces), 3, np.int32)),
    )


def _transform_sample(rotation: Array, translation: Array) -> Any:
    """A sample of the transform x -> R x + t; Alembic's matrices multiply row vectors."""
    from alembic3d import AbcGeom

    import imath  # isort: skip

    matrix = np.eye(4)
    matrix[:3, :3], matrix[3, :3] = (Y_UP @ rotation @ Y_UP.T).T, Y_UP @ translation
    sample = AbcGeom.XformSample()
    sample.setMatrix(imath.M44d(*matrix.ravel().tolist()))
    return sample
