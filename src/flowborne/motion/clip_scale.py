"""Whether a clip's unit and axes make a standing person of its skeleton."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flowborne.errors import SceneError
from flowborne.motion.bvh import TO_WORLD
from flowborne.motion.clip import Clip

Array = NDArray[np.float64]

SHORTEST, LONGEST = 0.2, 2.0
"""m from hip to ankle: of a small child, of a giant."""

LIKELY = (0.65, 1.1)
"""m from hip to ankle, of grown people."""

USUAL = 0.856
"""m from hip to ankle, of the standard skeleton."""

UPRIGHT = 0.5
"""Cosine of the angle to the vertical at which a person stands rather than lies."""

UNITS = {
    0.001: "mm",
    0.01: "cm",
    0.0254: "inches",
    0.056444: "CMU's own",
    0.3048: "feet",
    1.0: "m",
}


def leg_length(clip: Clip, mapping: Mapping[str, str]) -> float:
    """Length along the bones from hip to ankle, mean of both legs, in the clip's unit."""
    lengths = []
    for side in ("left", "right"):
        hip = clip.names.index(mapping[f"{side}_hip"])
        joint = clip.names.index(mapping[f"{side}_ankle"])
        length = 0.0
        while joint != hip and joint > 0:
            length += float(np.linalg.norm(clip.offsets[joint]))
            joint = int(clip.parents[joint])
        lengths.append(length)
    return sum(lengths) / 2.0


def likely_unit(length: float) -> float:
    """m per length of a file in which legs are that long: a known unit that makes them a grown
    person's, or else what makes them the standard skeleton's.

    raises  SceneError for legs without a length
    """
    if length <= 0.0:
        raise SceneError(
            "its legs have no length from hip to ankle. Correct the mapping or the file."
        )
    low, high = LIKELY
    known = next((unit for unit in UNITS if low <= length * unit <= high), None)
    return float(f"{USUAL / length:.3g}") if known is None else known


def named(unit: float) -> str:
    """A unit with its name, if it has one: "0.01 (cm)"."""
    return f"{unit:g}" + (f" ({UNITS[unit]})" if unit in UNITS else "")


def check_scale(length: float, unit: float) -> None:
    """Raise SceneError when a leg is not that of a person.

    length  from hip to ankle, in the file's unit
    unit    m per length of the file
    """
    if not SHORTEST <= length * unit <= LONGEST:
        raise SceneError(
            f"with unit = {unit:g} its legs are {length * unit:.3g} m long from hip to ankle. "
            f"Set unit = {named(likely_unit(length))}, or leave it out."
        )


def standing_axis(up: Array, read_as: str) -> str | None:
    """The axis of a file that is up where its person stands, "y" before others; None where the
    person lies whichever it is.

    up       (3,) of a posture: mean direction from ankles to shoulders
    read_as  axis that was taken to be up when the clip was read
    """
    in_file = TO_WORLD[read_as].T @ up
    along = {axis: float((world @ in_file)[2]) for axis, world in TO_WORLD.items()}
    standing = [axis for axis, cosine in along.items() if cosine >= UPRIGHT]
    return max(standing, key=lambda axis: (axis == "y", along[axis]), default=None)
