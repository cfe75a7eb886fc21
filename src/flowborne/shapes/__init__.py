"""Geometries: one contract, `shape.Shape`, its kinds, and how to add to them.

A shape has a volume, a distance, a cross-section, crossings with lines, a surface and a thickness,
all in its own frame; no other room depends on its kind. The distance at the nodes of the grid is a
kernel, `kernels.distance`, which distinguishes kinds by `Shape.code`.

    @shapes.register("torus")
    @dataclass(frozen=True)
    class Torus:
        radius: float
        tube: float

        def distance(self, points):
            ring = np.hypot(points[:, 0], points[:, 1]) - self.radius
            return np.hypot(ring, points[:, 2]) - self.tube

        def half_extents(self):
            return [self.radius + self.tube, self.radius + self.tube, self.tube]

A scene that names the file in `plugins` then has `[[shapes]]` of `kind = "torus"` on a `body` of
its model, with `radius` and `tube` as keys. In Python `PlacedShape(Torus(0.3, 0.1), "ring")` is one
of the `shapes` of `SolidModel.from_string` or `from_file`. The distance must be accurate to first
order at the surface. Mass, inertia, contact and pictures use triangles that are computed once; the
fluid uses the distance itself, sampled twice per cell.
"""

from __future__ import annotations

from flowborne.shapes.own import SHAPES, OwnGeometry, PlacedShape

__all__ = ["OwnGeometry", "PlacedShape", "register"]

register = SHAPES.register
