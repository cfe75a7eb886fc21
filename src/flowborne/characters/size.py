"""How large a character is, and what makes one of another unit as large as an animal."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from flowborne.characters.limits import check_places, check_surface
from flowborne.characters.rig import Array, Rig, Surface
from flowborne.errors import SceneError

LENGTHS = (2e-3, 35.0)
"""m along the longest side of what is neither smaller than a fruit fly nor longer than a whale.
Files hold numbers without a unit or in another one than they say: centimetres as metres make a fox
of 156 m."""


def scaled(rig: Rig, surface: Surface, scale: float, name: str) -> tuple[Rig, Surface]:
    """A character made larger about the origin.

    name    of its file, for messages
    raises  SceneError when the scale is none, or leads to lengths that cannot be
    """
    if not (scale > 0.0 and math.isfinite(scale)):
        raise SceneError(f"scale is {scale:g}. Give a number above 0.")
    if scale == 1.0:
        return rig, surface
    where = f"{name} scaled by {scale:g}"
    larger = replace(surface, vertices=scale * surface.vertices)
    check_surface(larger.vertices, where)
    check_places(scale * rig.position, where)
    return replace(rig, position=scale * rig.position), larger


def size_notes(vertices: Array, mass: float, scale: float, name: str) -> Iterator[str]:
    """A sentence on a surface (k, 3), m, that is far longer than animals.

    mass    kg
    scale   by which it has been made larger
    name    of its file, for messages
    raises  SceneError where it is far smaller than animals: MuJoCo refuses the inertia of its parts
    """
    length = float(np.ptp(vertices, axis=0).max())
    more = 10.0 ** round(-math.log10(length))
    resized = (
        f"with --scale {more * scale:g} it is {more * length:.3g} m long and "
        f"{more**3 * mass:.3g} kg"
    )
    said = f"{length:.3g} m long and {mass:.3g} kg"
    if length < LENGTHS[0]:
        raise SceneError(
            f"{name} is {said}, smaller than a fly, and its parts too small to compute. Import it "
            f"in its own unit: {resized}."
        )
    if length > LENGTHS[1]:
        yield (
            f"it is {said}, longer than a whale: is its file in another unit than metres? Imported "
            f"into another folder {resized}"
        )
