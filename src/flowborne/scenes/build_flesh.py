"""The flesh of a scene's tables, meshed once, around the bones of its model."""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np

from flowborne.scenes.schema_flesh import FleshTable
from flowborne.solids.compiler import compiled_quietly
from flowborne.solids.tissue.growth import Grown, Law, Tissue, add_flesh
from flowborne.solids.tissue.mesh import (
    ASTRAY,
    FIDELITY,
    HELD,
    JOINT,
    JOINT_EDGES,
    THICKNESSES,
    FleshMesh,
    skin_mesh,
    surface_mesh,
)
from flowborne.solids.tissue.mesh_file import read_mesh, recipe_of
from flowborne.solids.tissue.surface_file import surface_bytes
from flowborne.solids.tissue.symmetry import SAME

LAWS = {
    "neo-hookean": Law.STABLE_NEO_HOOKEAN,
    "st-venant-kirchhoff": Law.SAINT_VENANT_KIRCHHOFF,
}


def grow(spec: mujoco.MjSpec, tables: tuple[FleshTable, ...], folder: Path) -> list[Grown]:
    """Add the flesh of `tables` to a model; their files are found from `folder`.

    returns what `SolidModel.with_flesh` asks for
    raises  ValueError for flesh that cannot be meshed, or read
    """
    meshes = [meshed(spec, table, folder) for table in tables]
    return [
        add_flesh(spec, table.name, mesh.points, mesh.elements, tissue_of(table), mesh.holders)
        for table, (mesh, _) in zip(tables, meshes, strict=True)
    ]


def tissue_of(table: FleshTable) -> Tissue:
    """What the flesh of a table is made of."""
    return Tissue(table.young, table.poisson, table.density, table.damping, LAWS[table.law])


def meshed(spec: mujoco.MjSpec, table: FleshTable, folder: Path) -> tuple[FleshMesh, str]:
    """The mesh of a flesh around the bones of a model without any, and its recipe.

    The mesher never makes the same mesh twice, so a file's mesh is taken where its recipe is the
    same, and within a process a recipe is followed once.
    raises  ValueError as `grow`
    """
    recipe = _recipe(spec, table, folder)
    if table.mesh is not None:
        path = folder / table.mesh
        as_it_is = table.thickness is None and table.surface is None
        if as_it_is or (path.exists() and recipe_of(path) == recipe):
            return _read(path, path.stat().st_mtime_ns if path.exists() else 0), recipe
    if recipe not in _made:
        _made[recipe] = _mesh(spec, table, folder)
    return _made[recipe], recipe


_made: dict[str, FleshMesh] = {}
"""What this process has meshed, by recipe."""


def _mesh(spec: mujoco.MjSpec, table: FleshTable, folder: Path) -> FleshMesh:
    assert table.size is not None
    if table.surface is not None:
        return surface_mesh(folder / table.surface, spec, table.bones, table.size)
    assert table.thickness is not None
    return skin_mesh(spec, table.bones, table.thickness, table.size)


def _recipe(spec: mujoco.MjSpec, table: FleshTable, folder: Path) -> str:
    """What decides a mesh, as JSON: the bones' shapes and places at rest, and how it is made."""
    mj = compiled_quietly(spec.copy())
    data = mujoco.MjData(mj)
    mujoco.mj_kinematics(mj, data)
    shapes = hashlib.sha256()
    for name in table.bones:
        body = mujoco.mj_name2id(mj, mujoco.mjtObj.mjOBJ_BODY, name)
        for geom in np.flatnonzero(mj.geom_bodyid == body) if body >= 0 else ():
            for values in (mj.geom_size[geom], data.geom_xpos[geom], data.geom_xmat[geom]):
                shapes.update(np.round(values, 9).tobytes())
            shapes.update(bytes([mj.geom_type[geom]]))
            mesh = mj.geom_dataid[geom]
            if mesh >= 0:
                first = mj.mesh_vertadr[mesh]
                shapes.update(mj.mesh_vert[first : first + mj.mesh_vertnum[mesh]].tobytes())
    recipe = {
        "bones": list(table.bones),
        "shapes": shapes.hexdigest(),
        "thickness": table.thickness,
        "size": table.size,
        "rules": [FIDELITY, THICKNESSES, HELD, JOINT, JOINT_EDGES, ASTRAY, SAME],
    }
    if table.surface is not None:
        recipe["surface"] = hashlib.sha256(surface_bytes(folder / table.surface)).hexdigest()
    return json.dumps(recipe)


@lru_cache(maxsize=8)
def _read(path: Path, _changed: int) -> FleshMesh:
    return read_mesh(path)
