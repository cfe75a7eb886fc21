"""Mirror planes that exchange bones: flesh is meshed between them and reflected into the rest.

The mesher lays its points where it likes. How stiff flesh is about a joint depends on which of them
a bone holds, so that two legs meshed on their own may differ by a quarter.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flowborne.extras import flesh_library
from flowborne.shapes.shape import Mesh
from flowborne.solids.elements import surface_of
from flowborne.solids.tissue.bones import Bones, signed_distance

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

SAME = 0.01
"""How far the mirror image of a shape may be off it, as a part of the distance that faces may."""

PARALLEL = 1e-3
"""Unit vectors that differ by less than this are one: files give coordinates with few digits."""

MIRRORED = [2, 1, 0, 3]
"""Corners of an element's image, right-handed again and with `elements.PARTS` mirrored too."""

APART = np.array([0.55, 0.72, 0.42])
"""A direction in no mirror plane that a person would choose: the chamber around it is meshed."""


@dataclass(frozen=True)
class Chamber:
    """A part of space between mirror planes, whose images under reflection fill all of it.

    centre  (3,) m, in all of the planes
    walls   (k, 3) unit normals of the planes around it, inward; none where nothing is mirrored
    images  (g, 3, 3) what carries it to each of its images, the identity first
    """

    centre: Array
    walls: Array
    images: Array

    def cut(self, surface: Mesh) -> Mesh:
        """What of a closed surface's inside lies in the chamber, as a closed surface."""
        pv = flesh_library()
        left = pv.PolyData.from_regular_faces(*surface)
        for wall in self.walls:
            left = left.clip_closed_surface(normal=wall, origin=self.centre)
        left = left.triangulate()
        return np.asarray(left.points, dtype=np.float64), left.regular_faces.astype(np.int64)

    def unfold(
        self,
        points: Array,
        elements: Indices,
        wanted: NDArray[np.bool_],
        surface: Mesh,
        tolerance: float,
    ) -> tuple[Array, Indices]:
        """Points and right-handed tetrahedra of all images in turn, joined at the walls.

        points     (n, 3) m
        elements   (m, 4) right-handed, of all that is in the chamber
        wanted     (m,) those of them that are set down in the images
        surface    that of all the flesh, in all images
        tolerance  how far from a wall the faces on it may be, m; their points are put onto it, and
                   elements that this makes flat are left out
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
        unfolded[turned] = unfolded[turned][..., MIRRORED]
        return images.reshape(-1, 3)[first], unfolded.reshape(-1, 4)

    def _joined(self, on_wall: NDArray[np.bool_], count: int) -> Indices:
        """(g, count) numbers of the images of points: an image has those on a wall in common with
        the one on its other side."""
        numbers = np.arange(len(self.images) * count).reshape(-1, count)
        graph = coo_array((numbers.size,) * 2, dtype=np.float64)
        for wall, on in zip(self.walls, on_wall, strict=True):
            across = self.images @ reflection(wall)
            apart = np.abs(across[:, None] - self.images[None]).max(axis=(2, 3))
            pair = numbers[:, on].ravel(), numbers[apart.argmin(axis=1)][:, on].ravel()
            graph = graph + coo_array((np.ones(pair[0].size), pair), shape=graph.shape)
        return np.asarray(connected_components(graph, directed=False)[1]).reshape(-1, count)

    def _on_walls(
        self, points: Array, elements: Indices, surface: Mesh, tolerance: float
    ) -> NDArray[np.bool_]:
        """(k, n) of each wall, the points of faces that lie in it.

        Those are the faces beside it whose middle is no closer to the surface: which way a small
        one faces says nothing, as the mesher may tilt it.
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
    """The chamber between the mirror planes that exchange bones; all of space where there is none.

    skin       (n, 3) points on the bones' skin, m
    tolerance  how far from the surfaces the faces of the mesh may be, m
    surface    the flesh's own, which must be its own mirror image too
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
    if len(whole) < len(normals):  # a tolerance let some of the planes through, and not others
        whole = normals[:1]
    inward = np.array([n if n @ APART > 0.0 else -n for n in whole]).reshape(-1, 3)
    walls = np.array([n for n in inward if _next_to(n, inward)]).reshape(-1, 3)
    return Chamber(middle, walls, _generated(inward))


def _among(normal: Array, normals: list[Array]) -> bool:
    """Whether a plane is one of some, by their unit normals."""
    return any(np.abs(np.abs(normal @ n) - 1.0) < PARALLEL**2 for n in normals)


def _is_mirror(
    normal: Array, centre: Array, bones: Bones, skin: Array, same: float, surface: Mesh | None
) -> bool:
    """Whether the bones, and the flesh's own surface, are their own images in a plane."""
    mirror = reflection(normal)

    def image(points: Array) -> Array:
        return np.asarray((points - centre) @ mirror + centre)

    if np.abs(bones.distance(image(skin)) - bones.distance(skin)).max() > same:
        return False
    if surface is None:
        return True
    return bool(np.abs(signed_distance(image(surface[0]), surface)).max() <= same)


def _next_to(normal: Array, inward: Array) -> bool:
    """Whether no plane but its own lies between APART and its image: it is a wall."""
    return int((inward @ (reflection(normal) @ APART) < 0.0).sum()) == 1


def _generated(normals: Array) -> Array:
    """(g, 3, 3) all products of reflections in some planes, the shortest first: files give
    coordinates with few digits, and each factor adds their error."""
    images = [np.eye(3)]
    for image in images:
        for normal in normals:
            product = image @ reflection(normal)
            if all(np.abs(product - known).max() > 10.0 * PARALLEL for known in images):
                images.append(product)
    return np.array(images)
