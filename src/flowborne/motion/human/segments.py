"""Inertia of the human's bodies, which add up exactly to the segments of de Leva (1996)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.motion.human.skeleton import SIDES, Skeleton

Sex = Literal["male", "female"]

MAX_SPREAD = 0.95
"""Largest part of a segment's inertia, in any direction, that comes from the distances of its
bodies' centres of mass."""


@dataclass(frozen=True)
class Measures:
    """Inertia of a segment, relative to the mass of the body and the length of the segment.

    mass          of one side, per mass of the body
    centre        centre of mass from the start of the segment, per length
    sagittal      radius of gyration about the axis from back to front, per length
    transverse    ... about the axis from right to left
    longitudinal  ... about the axis of the segment
    """

    mass: float
    centre: float
    sagittal: float
    transverse: float
    longitudinal: float


MEASURES: dict[Sex, dict[str, Measures]] = {
    "male": {
        "head": Measures(0.0694, 0.5002, 0.303, 0.315, 0.261),
        "trunk": Measures(0.4346, 0.5138, 0.328, 0.306, 0.169),
        "upper_arm": Measures(0.0271, 0.5772, 0.285, 0.269, 0.158),
        "forearm": Measures(0.0162, 0.4574, 0.276, 0.265, 0.121),
        "hand": Measures(0.0061, 0.7900, 0.628, 0.513, 0.401),
        "thigh": Measures(0.1416, 0.4095, 0.329, 0.329, 0.149),
        "shank": Measures(0.0433, 0.4459, 0.255, 0.249, 0.103),
        "foot": Measures(0.0137, 0.4415, 0.257, 0.245, 0.124),
    },
    "female": {
        "head": Measures(0.0669, 0.4841, 0.271, 0.295, 0.261),
        "trunk": Measures(0.4257, 0.4964, 0.307, 0.292, 0.147),
        "upper_arm": Measures(0.0255, 0.5754, 0.278, 0.260, 0.148),
        "forearm": Measures(0.0138, 0.4559, 0.261, 0.257, 0.094),
        "hand": Measures(0.0056, 0.7474, 0.531, 0.454, 0.335),
        "thigh": Measures(0.1478, 0.3612, 0.369, 0.364, 0.162),
        "shank": Measures(0.0481, 0.4416, 0.271, 0.267, 0.093),
        "foot": Measures(0.0129, 0.4014, 0.299, 0.279, 0.124),
    },
}
"""de Leva 1996, J. Biomechanics 29:1223, Table 4. Segments go from vertex to C7, C7 to mid hip,
between joint centres, from heel to toe tip, and from wrist to third knuckle (the table's length for
the hand). The head of women is 0.0668 in the paper; 0.0669 makes the sum 1.
"""

TRUNK: dict[Sex, dict[str, float]] = {
    "male": {"upper": 0.1596, "middle": 0.1633, "lower": 0.1117},
    "female": {"upper": 0.1545, "middle": 0.1465, "lower": 0.1247},
}
"""Masses of the parts of the trunk, per mass of the body; they meet at xiphoid and navel. Source as
above."""

CLAVICLE = 0.1
"""Part of the upper trunk's mass that moves with one collar bone; an estimate, as the next two."""

NECK = 0.12
"""Part of the head segment's mass in each of the neck's two bodies: a neck 10 cm long and 12 cm
thick."""

TOES = 0.18
"""Part of the foot's mass in the toes, which are 27 % of its length and thinner."""


def segments() -> tuple[str, ...]:
    """Names of the 14 segments: "head", "trunk", "left_upper_arm", ..."""
    paired = [name for name in MEASURES["male"] if name not in ("head", "trunk")]
    return ("head", "trunk", *(f"{side}_{name}" for side in SIDES for name in paired))


def measures_of(segment: str, sex: Sex) -> Measures:
    """The measures of a segment."""
    return MEASURES[sex][segment.removeprefix("left_").removeprefix("right_")]


def ends_of(segment: str, skeleton: Skeleton) -> tuple[Array, Array]:
    """Start and end (3,) of a segment, m, for its length and its centre of mass."""
    if segment == "head":
        return skeleton.tips["head_top"], skeleton.joints["lower_neck"]
    if segment == "trunk":
        return skeleton.joints["lower_neck"], skeleton.mid_hip
    side, name = segment.split("_", 1)
    if name == "foot":
        return skeleton.heel(side), skeleton.tips[f"{side}_toe_tip"]
    if name == "hand":
        return skeleton.joints[f"{side}_wrist"], skeleton.knuckle(side)
    return skeleton.bone(segment)


def shares_of(segment: str, sex: Sex) -> dict[str, float]:
    """Body of a segment -> its share of the segment's mass."""
    if segment == "head":
        return {"lower_neck": NECK, "upper_neck": NECK, "head": 1.0 - 2.0 * NECK}
    if segment == "trunk":
        whole = MEASURES[sex]["trunk"].mass
        upper, middle, lower = (TRUNK[sex][part] / whole for part in ("upper", "middle", "lower"))
        return {
            "pelvis": lower,
            "lower_back": 0.5 * middle,
            "upper_back": 0.5 * middle,
            "thorax": (1.0 - 2.0 * CLAVICLE) * upper,
            "left_clavicle": CLAVICLE * upper,
            "right_clavicle": CLAVICLE * upper,
        }
    if segment.endswith("_foot"):
        side = segment.split("_")[0]
        return {f"{side}_foot": 1.0 - TOES, f"{side}_toes": TOES}
    return {segment: 1.0}


@dataclass(frozen=True, eq=False)
class Inertia:
    """Inertia of a body at rest.

    mass    kg
    centre  (3,) m, centre of mass
    tensor  (3, 3) kg m^2, about the centre along the world's axes
    """

    mass: float
    centre: Array
    tensor: Array

    def part(self, share: float) -> Inertia:
        """A share of the mass with the same distribution."""
        return Inertia(share * self.mass, self.centre, share * self.tensor)


def axes_of(start: Array, end: Array) -> Array:
    """(3, 3) columns: sagittal, transverse and longitudinal axis of a segment, right-handed.

    The longitudinal axis points from end to start. The sagittal axis is as close as possible to x,
    or to z for a segment along x, such as a foot.
    """
    longitudinal = (start - end) / np.linalg.norm(start - end)
    ahead = np.eye(3)[2 if abs(longitudinal[0]) > np.sqrt(0.5) else 0]
    sagittal = ahead - (ahead @ longitudinal) * longitudinal
    sagittal /= np.linalg.norm(sagittal)
    return np.column_stack([sagittal, np.cross(longitudinal, sagittal), longitudinal])


def inertias(skeleton: Skeleton, mass: float, sex: Sex) -> dict[str, Inertia]:
    """Inertia of each body of a human of `mass` kg.

    A segment of one body has de Leva's values. A segment of several bodies has them in total, at
    rest: the centres of mass of the bodies are the midpoints of their bones, shifted together to
    match the centre of the segment. If they are too far apart for the radii of gyration of the
    segment, they move towards its centre. The bodies share the remaining inertia by their mass.
    """
    found: dict[str, Inertia] = {}
    for segment in segments():
        found |= _of_segment(segment, skeleton, mass, sex)
    return found


def _of_segment(segment: str, skeleton: Skeleton, mass: float, sex: Sex) -> dict[str, Inertia]:
    measures, shares = measures_of(segment, sex), shares_of(segment, sex)
    start, end = ends_of(segment, skeleton)
    centre = start + measures.centre * (end - start)
    whole = _second_moment(segment, skeleton, sex)
    weight = np.array(list(shares.values()))
    middle = np.array([np.mean(skeleton.bone(body), axis=0) for body in shares])
    offsets = middle - weight @ middle
    inward = np.linalg.inv(np.linalg.cholesky(whole))
    spread = float(np.linalg.eigvalsh(inward @ (offsets.T * weight) @ offsets @ inward.T)[-1])
    offsets *= min(1.0, np.sqrt(MAX_SPREAD / max(spread, MAX_SPREAD)))
    rest = whole - (offsets.T * weight) @ offsets
    tensor = np.trace(rest) * np.eye(3) - rest
    kilograms = measures.mass * mass
    return {
        body: Inertia(share * kilograms, centre + offset, share * kilograms * tensor)
        for (body, share), offset in zip(shares.items(), offsets, strict=True)
    }


def _second_moment(segment: str, skeleton: Skeleton, sex: Sex) -> Array:
    """(3, 3) m^2: the mean of x x^T of a segment about its centre of mass, in world axes."""
    measures = measures_of(segment, sex)
    start, end = ends_of(segment, skeleton)
    radii = np.array([measures.sagittal, measures.transverse, measures.longitudinal])
    squares = (float(np.linalg.norm(end - start)) * radii) ** 2
    axes = axes_of(start, end)
    return np.asarray(axes @ np.diag(0.5 * squares.sum() - squares) @ axes.T)
