"""Tables of a scene that describe flesh around bones."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from flowborne.tables import FileName, NotNegative, PlainName, Positive, Table, Text


class FleshTable(Table):
    """[[flesh]]: an elastic body that bones hold, meshed with tetrahedra.

    Where it is thinner with its bones than 1.75 cells of the fluid's grid, the fluid sees all of it
    thicker by what is missing there, so that it does not leak. Where a mirror plane exchanges
    bones, as left and right ones, the elements are each other's mirror images too.

    name       the flesh's own
    bones      bodies of the model that lie inside and hold it
    thickness  m: it is a skin as thick as this around the bones
    surface    instead of a thickness: file of a closed surface (.obj, .stl, .ply, .off, .glb, and
               whatever else trimesh reads) in the axes of the model at rest; the flesh fills it
    size       m: length of the elements' edges. One element through its thickness is enough for
               flesh to bend as it should
    mesh       file (.npz as a run leaves it, or .vtu) of elements that were made of all this
               before: made anew where it was made otherwise. Without a thickness and a surface it
               is used as it is, in two dimensions a mesh of triangles at z = 0
    young      N/m^2, Young's modulus
    poisson    Poisson's ratio
    density    kg/m^3
    damping    s, Rayleigh's: the damping matrix is this times the stiffness matrix
    law        "neo-hookean" comes back when it is turned inside out, "st-venant-kirchhoff" does not
    """

    name: PlainName
    bones: Annotated[tuple[Text, ...], Field(min_length=1)]
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
        made = self.thickness is not None or self.surface is not None
        if not made and self.mesh is None:
            raise ValueError("has neither a thickness nor a surface. Give one of them")
        if made and self.size is None:
            raise ValueError("has no size of elements. Give it, in m")
        return self
