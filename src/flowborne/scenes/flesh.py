"""The flesh of a scene: its tables, checks, and meshes around the bones."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flowborne.base.phrases import listed
from flowborne.base.tables import FileName, NotNegative, Places, PlainName, Positive, Table, Text
from flowborne.scenes.domain import Domain
from flowborne.scenes.sides import BoundariesTable
from flowborne.solids.dynamics import kinematics
from flowborne.solids.mjcf import MjSpec
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.tissue.bones import digest
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
from flowborne.solids.tissue.mesh_file import ENDING, read_mesh, recipe_of
from flowborne.solids.tissue.surface_file import surface_bytes
from flowborne.solids.tissue.symmetry import SAME

LAWS = {"neo-hookean": Law.STABLE_NEO_HOOKEAN, "st-venant-kirchhoff": Law.SAINT_VENANT_KIRCHHOFF}


class FleshTable(Table):
    """[[flesh]]: an elastic body that bones hold, meshed with tetrahedra.

    If flesh and bones together are thinner than 1.75 cells of the grid, the fluid treats all of the
    flesh as thicker by the difference, so that it does not leak. If a mirror plane exchanges bones,
    such as left and right ones, the mesh has the same symmetry.

    name       the flesh's own
    bones      bodies of the model that lie inside and hold it
    neighbours  bodies into which it reaches: they hold the points of it that are inside them
    thickness  m: it is a skin as thick as this around the bones
    surface    instead of a thickness: file of a closed surface (.obj, .stl, .ply, .off, .glb, and
               whatever else trimesh reads) in the axes of the model at rest; the flesh fills it
    size       m: length of the elements' edges. One element through its thickness is enough for
               flesh to bend as it should
    mesh       file (.npz as a run leaves it, or .vtu) of elements that were made of all this
               before. Where it was made otherwise, each process meshes anew and differently, and a
               run keeps the mesh that it began with; `check` says so. Without a thickness and a
               surface it is used as it is, in two dimensions a mesh of triangles at z = 0
    young      N/m^2, Young's modulus
    poisson    Poisson's ratio
    density    kg/m^3
    damping    s, Rayleigh's: the damping matrix is this times the stiffness matrix
    law        "neo-hookean" comes back when it is turned inside out, "st-venant-kirchhoff" does not
    """

    name: PlainName
    bones: Annotated[tuple[Text, ...], Field(min_length=1)]
    neighbours: tuple[Text, ...] = ()
    thickness: Positive | None = None
    surface: FileName | None = None
    size: Positive | None = None
    mesh: FileName | None = None
    young: Positive
    poisson: Annotated[float, Field(ge=0.0, lt=0.5)] = 0.4
    density: Positive = 1000.0
    damping: NotNegative = 0.01
    law: Literal["neo-hookean", "st-venant-kirchhoff"] = "neo-hookean"

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.thickness is not None and self.surface is not None:
            raise ValueError("has both a thickness and a surface. Keep one of them")
        if not self.is_made and self.mesh is None:
            raise ValueError("has neither a thickness nor a surface. Give one of them")
        if self.is_made and self.size is None:
            raise ValueError("has no size of elements. Give it, in m")
        return self

    @property
    def is_made(self) -> bool:
        """Whether it is meshed, and no mesh of the user's own."""
        return self.thickness is not None or self.surface is not None

    @property
    def kept_as(self) -> str:
        """Name of the file in which a run keeps its mesh."""
        return Path(self.mesh or f"flesh-{self.name}").with_suffix(ENDING).name

    def tissue(self) -> Tissue:
        """The material."""
        return Tissue(self.young, self.poisson, self.density, self.damping, LAWS[self.law])


def grow(spec: MjSpec, tables: tuple[FleshTable, ...], folder: Path) -> list[Grown]:
    """Add the flesh of `tables` to a model; their files are found from `folder`.

    returns what `SolidModel.with_flesh` asks for
    raises  ValueError for flesh that cannot be meshed, or read
    """
    meshes = [meshed(spec, table, folder) for table in tables]
    return [
        add_flesh(spec, table.name, mesh.points, mesh.elements, table.tissue(), mesh.holders)
        for table, (mesh, _) in zip(tables, meshes, strict=True)
    ]


def meshed(spec: MjSpec, table: FleshTable, folder: Path) -> tuple[FleshMesh, str]:
    """The mesh of a flesh around the bones of a model without flesh, and its recipe.

    The mesher is not deterministic: a file's mesh is used if its recipe is the same, and a process
    meshes each recipe once.
    raises  ValueError as `grow`
    """
    recipe = _recipe(spec, table, folder)
    if table.mesh is not None and staleness(spec, table, folder) is None:
        path = folder / table.mesh
        return _read(path, path.stat().st_mtime_ns if path.exists() else 0), recipe
    if recipe not in _made:
        assert table.size is not None
        if table.surface is not None:
            path = folder / table.surface
            made = surface_mesh(path, spec, table.bones, table.size, table.neighbours)
        else:
            assert table.thickness is not None
            made = skin_mesh(spec, table.bones, table.thickness, table.size, table.neighbours)
        _made[recipe] = made
    return _made[recipe], recipe


def staleness(spec: MjSpec, table: FleshTable, folder: Path) -> str | None:
    """Why the file of a mesh that a flesh names is not used, after the name of the file; None where
    it is used or none is named. Raises ValueError for a file that cannot be read."""
    if table.mesh is None or not table.is_made:
        return None
    path, recipe = folder / table.mesh, _recipe(spec, table, folder)
    if not path.exists():
        return "is missing"
    if (found := recipe_of(path)) == recipe:
        return None
    if not found:
        return "does not say what it was made of"
    before, wanted = json.loads(found), json.loads(recipe)
    other = [WORDS.get(key, key) for key in wanted if before.get(key) != wanted[key]]
    return f"was made with other {listed(other)}"


WORDS = {"shapes": "shapes of the bones", "rules": "rules of the mesher"}
"""What entries of a recipe are called in messages, where it is not by their key."""

_made: dict[str, FleshMesh] = {}
"""Meshes of this process by recipe."""


def _recipe(spec: MjSpec, table: FleshTable, folder: Path) -> str:
    """All inputs of a mesh, as JSON: shapes and poses of the bones at rest, and parameters."""
    recipe = {
        "bones": list(table.bones),
        "shapes": digest(spec, (*table.bones, *table.neighbours)),
        "thickness": table.thickness,
        "size": table.size,
        "rules": [FIDELITY, THICKNESSES, HELD, JOINT, JOINT_EDGES, ASTRAY, SAME],
    }
    if table.neighbours:
        recipe["neighbours"] = list(table.neighbours)
    if table.surface is not None:
        recipe["surface"] = hashlib.sha256(surface_bytes(folder / table.surface)).hexdigest()
    return json.dumps(recipe)


@lru_cache(maxsize=8)
def _read(path: Path, _changed: int) -> FleshMesh:
    return read_mesh(path)


def check_flesh(
    places: Places, tables: Sequence[FleshTable], *, slab: bool, has_model: bool
) -> Iterator[str]:
    """Problems that do not need the mesh."""
    for index, table in enumerate(tables):
        if slab and table.is_made:
            yield (
                f"{places.at('flesh', index)}: flesh is meshed in 3 dimensions alone. Set "
                "dimensions = 3, or give a mesh of triangles at z = 0 in place of its thickness "
                "or surface."
            )
    if tables and not has_model:
        yield (
            f"{places.at('flesh')}: flesh grows on the bodies of a model file. "
            "Add [solids] with a model, or drop [[flesh]]."
        )
    names = [table.name for table in tables]
    for index, table in enumerate(tables):
        if table.name in names[:index]:
            yield (
                f"{places.at('flesh', index)}: another flesh is called '{table.name}'. Rename one."
            )
        if table.damping != tables[0].damping:
            yield (
                f"{places.at('flesh', index)}: its damping is {table.damping:g} s, that of "
                f"'{names[0]}' {tables[0].damping:g} s. Give all flesh the same."
            )


def check_flesh_places(
    places: Places,
    model: SolidModel,
    start: SolidState,
    domain: Domain,
    boundaries: BoundariesTable,
) -> Iterator[str]:
    """No flesh may start outside the domain, or be longer than it between periodic sides."""
    if model.flesh is None:
        return
    vertices = kinematics(model, start.q).vertices
    for flesh, name in enumerate(model.flesh.names):
        own = vertices[model.flesh.surface[model.flesh.of_surface == flesh]].reshape(-1, 3)
        for axis in range(len(domain.lower)):
            low, high = own[:, axis].min(), own[:, axis].max()
            first, last = domain.lower[axis], domain.upper[axis]
            shorter = boundaries.periodic(axis) and high - low < last - first
            if (low < first or high > last) and not shorter:
                yield (
                    f"{places.at('flesh', flesh)}: '{name}' reaches from {low:g} to {high:g} m in "
                    f"{'xyz'[axis]} at the start, outside the domain from {first:g} to {last:g} m. "
                    "Move the body or enlarge the domain."
                )
