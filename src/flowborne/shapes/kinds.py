"""The kinds of geometries that MJCF has, by name."""

from __future__ import annotations

from flowborne.shapes.box import ShapeBox
from flowborne.shapes.capsule import ShapeCapsule
from flowborne.shapes.cylinder import ShapeCylinder
from flowborne.shapes.ellipsoid import ShapeEllipsoid
from flowborne.shapes.mesh import ShapeMesh
from flowborne.shapes.shape import Array, Mesh, Primitive, Shape
from flowborne.shapes.sphere import ShapeSphere

PRIMITIVES: dict[str, type[Primitive]] = {
    shape.kind: shape
    for shape in (ShapeSphere, ShapeCapsule, ShapeCylinder, ShapeBox, ShapeEllipsoid)
}


def shape_of(kind: str, size: Array, mesh: Mesh | None) -> Shape:
    """A geometry of MuJoCo.

    kind  as MJCF spells it
    size  (3,) MuJoCo's half sizes, m
    mesh  of kind "mesh"; None for the others
    """
    return PRIMITIVES[kind](size) if mesh is None else ShapeMesh(*mesh)
