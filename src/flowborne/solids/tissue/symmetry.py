"""Mirror planes that exchange bones: flesh is meshed between them and reflected to the other side.

The mesher is not symmetric. The stiffness of flesh around a joint depends on the points that a bone
holds, so two legs that are meshed separately may differ by a quarter.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from flowborne.base.extras import flesh_library
from flowborne.kernels.arrays import Array, Integers, Mask, Mesh
from flowborne.shapes.thickness import connected
from flowborne.solids.elements import surface_of
from flowborne.solids.tissue.bones import Bones, signed_distance

SAME = 0.01
"""Largest distance between a shape and its mirror image, in tolerances of the faces."""

PARALLEL_TOLERANCE = 1e-3
"""Unit vectors that differ by less are equal: files give coordinates with few digits."""

MIRRORED_CORNERS = [2, 1, 0, 3]
"""Corners of the image of an element: right-handed, and with `elements.PARTS` mirrored."""

INSIDE_DIRECTION = np.array([0.55, 0.72, 0.42])
"""A direction in no likely mirror plane; the chamber that contains it is meshed."""


@dataclass(frozen=True)
class Chamber:
    """A part of space between mirror planes; its images under reflection fill all space.

    centre  (3,) m, in all of the planes
    walls   (k, 3) inward unit normals of the planes around it; none without a mirror plane
    images  (g, 3, 3) the maps to its images, the identity first
    """

    centre: Array
    walls: Array
    images: Array

    def cut(self, surface: Mesh) -> Mesh:
        """The part of the inside of a closed surface in the chamber, as a closed surface."""
        pv = flesh_library()
        left = pv.PolyData.from_regular_faces(*surface)
        for wall in self.walls:
            left = left.clip_closed_surface(normal=wall, origin=self.centre)
        left = left.triangulate()
        return np.asarray(left.points, dtype=np.float64), left.regular_faces.astype(np.int64)

    def unfold(
        self, points: Array, elements: Integers, wanted: Mask, surface: Mesh, tolerance: float
    ) -> tuple[Array, Integers]:
        """Points and right-handed tetrahedra of all images, joined at the walls.

        points     (n, 3) m
        elements   (m, 4) right-handed tetrahedra in the chamber
        wanted     (m,) those that are copied to the images
        surface    surface of all the flesh, in all images
        tolerance  largest distance of the faces on a wall from it, m; their points are projected
                   onto it, and elements that become flat are dropped
        """
        on_wall = self._on_walls(points, elements, surface, tolerance)
        settled = points - self.centre
        for those in np.unique(on_wall, axis=1).T:
            across = np.linalg.pinv(self.walls[those]) @ self.walls[those]
            own = (on_wall == those[:, None]).all(axis=0)
            settled[own] -= settled[own] @ across
        wanted = wanted & ~on_wall[:, elements].all(axis=2).any(axis=0)
        images = np.einsum("gij,nj->gni", self.images, settled) + self.centre
        point = self._joined(on_wall, len(points))
        first = np.unique(point, return_index=True)[1]
        unfolded = point[:, elements[wanted]]
        turned = np.linalg.det(self.images) < 0.0
        unfolded[turned] = unfolded[turned][..., MIRRORED_CORNERS]
        return images.reshape(-1, 3)[first], unfolded.reshape(-1, 4)

    def _joined(self, on_wall: Mask, count: int) -> Integers:
        """(g, count) numbers of the images of points; two images share the points on the wall
        between them."""
        numbers = np.arange(len(self.images) * count).reshape(-1, count)
        pairs = [np.zeros((2, 0), np.int64)]
        for wall, on in zip(self.walls, on_wall, strict=True):
            across = self.images @ reflection(wall)
            apart = np.abs(across[:, None] - self.images[None]).max(axis=(2, 3))
            partner = numbers[apart.argmin(axis=1)]
            pairs.append(np.stack([numbers[:, on].ravel(), partner[:, on].ravel()]))
        return connected(numbers.size, *np.concatenate(pairs, axis=1)).reshape(-1, count)

    def _on_walls(self, points: Array, elements: Integers, surface: Mesh, tolerance: float) -> Mask:
        """(k, n) for each wall, the points of faces that lie in it.

        These are the faces near the wall with a middle no closer to the surface. The normals of
        small faces are no criterion, as the mesher may tilt them.
        """
        faces = surface_of(elements)
        to_surface = np.abs(signed_distance(points[faces].mean(axis=1), surface))
        on_wall = np.zeros((len(self.walls), len(points)), bool)
        for wall, on in zip(self.walls, on_wall, strict=True):
            away = np.abs((points - self.centre) @ wall)[faces]
            on[faces[(away <= tolerance).all(axis=1) & (away.mean(axis=1) <= to_surface)]] = True
        return on_wall


def reflection(normal: Array) -> Array:
    """(3, 3) reflection in the plane through the origin that has the unit `normal` (3,)."""
    return np.eye(3) - 2.0 * np.outer(normal, normal)


def chamber_of(bones: Bones, skin: Array, tolerance: float, surface: Mesh | None) -> Chamber:
    """The chamber between the mirror planes that exchange bones; all space without such planes.

    skin       (n, 3) points on the surface of the bones, m
    tolerance  largest distance of the faces of the mesh from the surfaces, m
    surface    the user's surface of the flesh, which must be symmetric too, or None
    """
    centres = np.array([0.5 * (part.low + part.high) for part in bones.parts])
    middle = centres.mean(axis=0)
    normals: list[Array] = []
    for one, other in combinations(range(len(centres)), 2):
        gap = centres[one] - centres[other]
        width = float(np.linalg.norm(gap))
        if bones.parts[one].bone == bones.parts[other].bone or width < tolerance:
            continue
        normal = gap / width
        if not _among(normal, normals) and _is_mirror(
            normal, middle, bones, skin, SAME * tolerance, surface
        ):
            normals.append(normal)
    whole = [n for n in normals if all(_among(reflection(n) @ m, normals) for m in normals)]
    if len(whole) < len(normals):  # the tolerance accepted some of the planes only
        whole = normals[:1]
    inward = np.array([n if n @ INSIDE_DIRECTION > 0.0 else -n for n in whole]).reshape(-1, 3)
    walls = np.array([n for n in inward if _next_to(n, inward)]).reshape(-1, 3)
    return Chamber(middle, walls, _generated(inward))


def _among(normal: Array, normals: list[Array]) -> bool:
    """Whether a plane is in a list, by unit normals."""
    return any(np.abs(np.abs(normal @ n) - 1.0) < PARALLEL_TOLERANCE**2 for n in normals)


def _is_mirror(
    normal: Array, centre: Array, bones: Bones, skin: Array, same: float, surface: Mesh | None
) -> bool:
    """Whether the bones, and the user's surface of the flesh, are symmetric about a plane."""
    mirror = reflection(normal)

    def image(points: Array) -> Array:
        return np.asarray((points - centre) @ mirror + centre)

    if np.abs(bones.distance(image(skin)) - bones.distance(skin)).max() > same:
        return False
    if surface is None:
        return True
    return bool(np.abs(signed_distance(image(surface[0]), surface)).max() <= same)


def _next_to(normal: Array, inward: Array) -> bool:
    """Whether a plane is a wall: no other plane lies between INSIDE_DIRECTION and its image."""
    return int((inward @ (reflection(normal) @ INSIDE_DIRECTION) < 0.0).sum()) == 1


def _generated(normals: Array) -> Array:
    """(g, 3, 3) all products of reflections in some planes, the shortest first.

    Files give coordinates with few digits, and each factor adds their error.
    """
    images = [np.eye(3)]
    for image in images:
        for normal in normals:
            product = image @ reflection(normal)
            if all(np.abs(product - known).max() > 10.0 * PARALLEL_TOLERANCE for known in images):
                images.append(product)
    return np.array(images)
