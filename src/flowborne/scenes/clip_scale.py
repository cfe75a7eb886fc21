"""Whether a clip's unit and axes make a person of its skeleton."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from flowborne.errors import SceneError
from flowborne.io.clip import Clip

SHORTEST, LONGEST, USUAL = 0.2, 2.0, 0.85
"""m from hip to ankle: of a small child, of a giant, of a grown person."""

UPRIGHT = 0.5
"""Least part of its length by which a leg points down."""

UNITS = {
    0.001: "mm",
    0.01: "cm",
    0.0254: "inches",
    0.056444: "CMU's own",
    0.3048: "feet",
    1.0: "m",
}


def leg_length(clip: Clip, mapping: Mapping[str, str]) -> float:
    """m along the bones from hip to ankle, mean of both legs."""
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


def check_upright(clip: Clip, mapping: Mapping[str, str], up: str) -> None:
    """Raise SceneError unless the legs point down when no joint is turned, as a person's do.

    up  axis of the file that is taken to point up
    """
    down, length = 0.0, leg_length(clip, mapping)
    for side in ("left", "right"):
        hip = clip.names.index(mapping[f"{side}_hip"])
        joint = clip.names.index(mapping[f"{side}_ankle"])
        while joint != hip and joint > 0:
            down -= 0.5 * float(clip.offsets[joint, 2])
            joint = int(clip.parents[joint])
    if down < UPRIGHT * length:
        other = "z" if up == "y" else "y"
        raise SceneError(
            f"with up = '{up}' its legs do not point down when no joint is turned. "
            f"Set up = '{other}', or correct the mapping."
        )


def check_scale(length: float, unit: float) -> None:
    """Raise SceneError when a leg is not that of a person.

    length  m from hip to ankle, as read with the unit
    unit    m per length of the file
    """
    if SHORTEST <= length <= LONGEST:
        return
    if length <= 0.0:
        raise SceneError(
            "its legs have no length from hip to ankle. Correct the mapping or the file."
        )
    best = min(UNITS, key=lambda candidate: abs(math.log(length / unit * candidate / USUAL)))
    if SHORTEST <= length / unit * best <= LONGEST:
        remedy = f"Set unit = {best:g} ({UNITS[best]})"
    else:
        remedy = f"Set unit = {unit * USUAL / length:.2g} or so"
    raise SceneError(
        f"with unit = {unit:g} its legs are {length:.3g} m long from hip to ankle. {remedy}."
    )
