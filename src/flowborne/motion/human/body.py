"""The human as MJCF: 23 bodies, ball joints, explicit inertias."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from flowborne.motion.human.segments import Inertia, Sex, inertias
from flowborne.motion.human.shapes import Shape, shapes
from flowborne.motion.human.skeleton import BODIES, SIDES, Array, Skeleton, joint_of

ELBOWS = tuple(f"{side}_elbow" for side in SIDES)

BENT = 150.0
"""Degrees, the most that a hinged elbow bends."""

STRAIGHT = 5.0
"""Degrees by which an elbow may be bent at rest and be straight."""

FORWARD, UP = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])

LINK = 0.05
"""Of the mass of the body before it, what moves with a link: little, where the clip moves it."""

STRIKING = tuple(f"{side}_{body}" for side in SIDES for body in ("forearm", "hand"))
STRUCK = (
    "pelvis",
    "lower_back",
    "head",
    *(f"{side}_{body}" for side in SIDES for body in ("thigh", "shank")),
)
"""Bodies of the first kind collide with those of the second, and nothing else does."""


def human_mjcf(
    skeleton: Skeleton,
    mass: float,
    sex: Sex,
    hinged_elbows: Collection[str] = (),
    touching: Collection[str] = SIDES,
    held: Collection[str] = (),
) -> str:
    """MJCF of a human at rest: the root is free, every other joint a ball.

    Bodies' frames are parallel to the world's at rest, their origins at the joints. No joint has
    friction, stiffness or inertia of its own. A link of the skeleton is a body without a geometry.

    mass           kg
    hinged_elbows  names of elbows that are hinges instead: 0 is the pose at rest, positive bends
                   the forearm forward, from straight to 150 degrees
    touching       sides, "left" and "right", whose forearm and hand collide. An arm that follows a
                   clip should not: its body is thicker or thinner than the actor's
    held           joints that are none: their bodies are one with those before them
    raises         ValueError for a mass that is not positive, and another joint than an elbow
    """
    if not (np.isfinite(mass) and mass > 0.0):
        raise ValueError(f"a human cannot have a mass of {mass} kg. Give a mass above 0.")
    for joint in hinged_elbows:
        if joint not in ELBOWS:
            raise ValueError(f"'{joint}' cannot be a hinge. Only these can: {', '.join(ELBOWS)}.")
    inertia = inertias(skeleton, mass, sex)
    shape = shapes(skeleton, {body: inertia[body].mass for body, _, _ in BODIES})
    top = ElementTree.Element("mujoco", model="human")
    ElementTree.SubElement(top, "compiler", angle="degree")
    elements = {"": ElementTree.SubElement(top, "worldbody")}
    linked = Counter(parent for _, joint, parent in BODIES for _ in skeleton.links.get(joint, ()))
    bodies = {joint: body for body, joint, _ in BODIES}
    for body, joint, parent in BODIES:
        place = skeleton.joints[joint]
        origin = skeleton.joints[parent] if parent else np.zeros(3)
        above = elements[parent]
        for link in skeleton.links.get(joint, ()):
            above = ElementTree.SubElement(
                above, "body", name=link.name, pos=_text(link.place - origin)
            )
            ElementTree.SubElement(above, "joint", name=link.name, type="ball")
            _add_inertia(above, inertia[bodies[parent]].part(LINK), link.place)
            origin = link.place
        element = ElementTree.SubElement(above, "body", name=body, pos=_text(place - origin))
        elements[joint] = element
        if joint not in held:
            _add_joint(element, joint, skeleton, joint in hinged_elbows)
        _add_inertia(element, inertia[body].part(1.0 - LINK * linked[joint]), place)
        strikes = body in STRIKING and body.split("_")[0] in touching
        _add_geom(element, shape[body], skeleton, strikes)
    ElementTree.indent(top)
    return ElementTree.tostring(top, encoding="unicode")


def _text(values: ArrayLike) -> str:
    """Numbers for MJCF, to more digits than the references are held to."""
    return " ".join(f"{value:.14g}" for value in np.asarray(values, dtype=np.float64).ravel())


def _add_joint(element: ElementTree.Element, joint: str, skeleton: Skeleton, hinged: bool) -> None:
    if joint == "root":
        ElementTree.SubElement(element, "freejoint", name=joint)
    elif hinged:
        axis, bend = elbow_hinge(skeleton, joint)
        ElementTree.SubElement(
            element,
            "joint",
            name=joint,
            type="hinge",
            axis=_text(axis),
            limited="true",
            range=_text((-bend, BENT - bend)),
        )
    else:
        ElementTree.SubElement(element, "joint", name=joint, type="ball")


def elbow_hinge(skeleton: Skeleton, elbow: str) -> tuple[Array, float]:
    """(3,) unit axis about which a positive turn bends an elbow, and degrees by which it is bent at
    rest.

    A straight one bends the forearm forward, or up where the upper arm points forward.
    """
    side = elbow.split("_")[0]
    upper = skeleton.joints[elbow] - skeleton.joints[f"{side}_shoulder"]
    upper = upper / np.linalg.norm(upper)
    fore = skeleton.joints[f"{side}_wrist"] - skeleton.joints[elbow]
    axis = np.cross(upper, fore)
    bend = float(np.degrees(np.arctan2(np.linalg.norm(axis), upper @ fore)))
    if bend <= STRAIGHT:
        ahead = FORWARD if abs(upper @ FORWARD) < np.sqrt(0.5) else UP
        axis, bend = np.cross(upper, ahead), 0.0
    return np.asarray(axis / np.linalg.norm(axis)), bend


def _add_inertia(element: ElementTree.Element, inertia: Inertia, origin: Array) -> None:
    rows, columns = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)
    ElementTree.SubElement(
        element,
        "inertial",
        pos=_text(inertia.centre - origin),
        mass=_text(inertia.mass),
        fullinertia=_text(inertia.tensor[rows, columns]),
    )


def _add_geom(
    element: ElementTree.Element, shape: Shape, skeleton: Skeleton, strikes: bool
) -> None:
    body = element.attrib["name"]
    ElementTree.SubElement(
        element,
        "geom",
        name=body,
        type=shape.kind,
        size=_text(shape.size),
        pos=_text(shape.centre - skeleton.joints[joint_of(body)]),
        xyaxes=_text(shape.axes[:, :2].T),
        rgba=_text(shape.colour),
        contype=str(int(strikes)),
        conaffinity=str(int(body in STRUCK)),
        friction="0.6",
    )
