"""The geometries of the human's bodies, with the volume that their mass needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.motion.human.segments import axes_of
from flowborne.motion.human.skeleton import Skeleton

SKIN, SHIRT, TROUSERS, SHOES = (
    (0.85, 0.66, 0.53, 1.0),
    (0.27, 0.45, 0.62, 1.0),
    (0.25, 0.27, 0.33, 1.0),
    (0.15, 0.14, 0.14, 1.0),
)


@dataclass(frozen=True)
class Form:
    """Type and proportions of the geometry of a body.

    kind     "capsule" along the bone, "ellipsoid" around it, "box" below it, or "lump": an
             ellipsoid of fixed proportions at the bone's end, for bones with a varying start
    density  kg/m^3 (Winter 2009, Table 4.1)
    flat     size from back to front over size from side to side
    half     half length: of an ellipsoid per length of its bone, of a lump per half breadth; half
             height of a box per half height of the toes
    middle   centre: of an ellipsoid from the bone's start, per length of the bone; of a lump from
             the bone's end, per half length
    ahead    distance of an ellipsoid or a lump in front of the bone, per half depth
    counted  part of a lump's volume outside its neighbours
    """

    kind: str
    density: float
    colour: tuple[float, float, float, float]
    flat: float = 1.0
    half: float = 0.5
    middle: float = 0.5
    ahead: float = 0.0
    counted: float = 1.0


FORMS: dict[str, Form] = {
    "pelvis": Form("lump", 1010.0, TROUSERS, 0.82, 0.85, 0.74, 0.0, 0.68),
    "lower_back": Form("ellipsoid", 1010.0, SHIRT, 0.73, 1.4, 0.5, 0.2),
    "upper_back": Form("ellipsoid", 1010.0, SHIRT, 0.73, 1.5, 0.5, 0.25),
    "thorax": Form("lump", 920.0, SHIRT, 0.76, 1.0, 1.05, 0.25, 0.84),
    "clavicle": Form("capsule", 920.0, SHIRT),
    "lower_neck": Form("ellipsoid", 1110.0, SKIN, 1.0, 1.5, 0.5, 0.75),
    "upper_neck": Form("ellipsoid", 1110.0, SKIN, 1.0, 1.5, 0.5, 0.5),
    "head": Form("lump", 1110.0, SKIN, 1.3, 1.5, 1.0, 0.15),
    "upper_arm": Form("capsule", 1070.0, SHIRT),
    "forearm": Form("capsule", 1130.0, SKIN),
    "hand": Form("ellipsoid", 1160.0, SKIN, 2.8),
    "thigh": Form("ellipsoid", 1050.0, TROUSERS, 1.15, 0.62, 0.42),
    "shank": Form("ellipsoid", 1090.0, TROUSERS, 1.1, 0.61, 0.45),
    "foot": Form("box", 1100.0, SHOES, half=1.4),
    "toes": Form("box", 1100.0, SHOES, half=1.0),
}
"""Depth over breadth of chest, waist and head: Gordon et al. 1989, means of men. All other
proportions, and the positions of the ellipsoids, by eye; hips are narrower than in that source, so
that a hanging arm does not touch them."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A geometry in the world at rest.

    kind    type of the geom in MJCF
    size    half sizes in m, as many as MJCF needs for the kind
    centre  (3,) m
    axes    (3, 3) columns: its axes
    colour  red, green, blue, opacity
    """

    kind: str
    size: tuple[float, ...]
    centre: Array
    axes: Array
    colour: tuple[float, float, float, float]


def shapes(skeleton: Skeleton, masses: dict[str, float]) -> dict[str, Shape]:
    """The geometry of each body, with the volume of its mass (kg) at its density.

    Neighbours overlap, so only part of a shape counts: half of a capsule's round ends, the part of
    an ellipsoid between the ends of the bone, and `counted` of a lump.
    """
    return {body: _shape(body, skeleton, masses) for body in masses}


def _shape(body: str, skeleton: Skeleton, masses: dict[str, float]) -> Shape:
    form = _form(body)
    volume = masses[body] / form.density
    start, end = skeleton.bone(body)
    axes, length = axes_of(start, end), float(np.linalg.norm(end - start))
    if form.kind == "capsule":
        radius = _capsule_radius(volume, length)
        return Shape("capsule", (radius, 0.5 * length), 0.5 * (start + end), axes, form.colour)
    if form.kind == "box":
        return _box(body, skeleton, volume)
    size = _ellipsoid(form, volume, length)
    if form.kind == "lump":
        centre = end + form.middle * size[2] * axes[:, 2]
    else:
        centre = start + form.middle * (end - start)
    return Shape("ellipsoid", size, centre + form.ahead * size[0] * axes[:, 0], axes, form.colour)


def _ellipsoid(form: Form, volume: float, length: float) -> tuple[float, float, float]:
    """Half sizes, m, of an ellipsoid on a bone of this length, or of a lump."""
    if form.kind == "lump":
        breadth = float(np.cbrt(0.75 * volume / (np.pi * form.counted * form.flat * form.half)))
        return form.flat * breadth, breadth, form.half * breadth
    half = form.half * length
    ends = np.clip((np.array([0.0, 1.0]) - form.middle) / form.half, -1.0, 1.0)
    counted = float(np.diff(ends - ends**3 / 3.0)[0])
    breadth = float(np.sqrt(volume / (np.pi * form.flat * half * counted)))
    return form.flat * breadth, breadth, half


def _box(body: str, skeleton: Skeleton, volume: float) -> Shape:
    """Box of a foot or toes on the sole, with the breadth that gives the volume."""
    form, side = _form(body), body.split("_")[0]
    start, end = skeleton.bone(body)
    axes, length = axes_of(start, end), float(np.linalg.norm(end - start))
    down = skeleton.to_sole(side)
    thin = float(np.linalg.norm(down))
    high = form.half * thin
    size = (high, 0.125 * volume / (high * 0.5 * length), 0.5 * length)
    centre = 0.5 * (start + end) + (1.0 - high / thin) * down
    return Shape("box", size, centre, axes, form.colour)


def _capsule_radius(volume: float, length: float) -> float:
    """Radius r with pi r^2 length + 2/3 pi r^3 = volume, the only positive root."""
    roots = np.roots([2.0 / 3.0 * np.pi, np.pi * length, 0.0, -volume])
    return float(roots[np.argmax(roots.real)].real)


def _form(body: str) -> Form:
    return FORMS[body.removeprefix("left_").removeprefix("right_")]
