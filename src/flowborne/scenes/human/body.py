"""The human as MJCF: 23 bodies, ball joints, explicit inertias."""

from __future__ import annotations

from collections.abc import Collection
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from flowborne.scenes.human.inertia import Inertia, inertias
from flowborne.scenes.human.segments import Sex
from flowborne.scenes.human.shapes import Shape, shapes
from flowborne.scenes.human.skeleton import BODIES, SIDES, Array, Skeleton, joint_of

ELBOWS = tuple(f"{side}_elbow" for side in SIDES)

STRAIGHT, BENT = 0.0, 150.0
"""Degrees, range of a hinged elbow."""

FORWARD = (1.0, 0.0, 0.0)

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
) -> str:
    """MJCF of a human at rest: the root is free, every other joint a ball.

    Bodies' frames are parallel to the world's at rest, their origins at the joints. No joint has
    friction, stiffness or inertia of its own.

    mass           kg
    hinged_elbows  names of elbows that are hinges instead: 0 is the pose at rest, positive bends
                   the forearm forward, from 0 to 150 degrees
    touching       sides, "left" and "right", whose forearm and hand collide. An arm that follows a
                   clip should not: its body is thicker or thinner than the actor's
    raises         ValueError for a mass that is not positive, another joint than an elbow, and an
                   upper arm that points forward at rest where its elbow is to be a hinge
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
    for body, joint, parent in BODIES:
        place = skeleton.joints[joint]
        origin = skeleton.joints[parent] if parent else np.zeros(3)
        element = ElementTree.SubElement(
            elements[parent], "body", name=body, pos=_text(place - origin)
        )
        elements[joint] = element
        _add_joint(element, joint, skeleton, joint in hinged_elbows)
        _add_inertia(element, inertia[body], skeleton)
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
        ElementTree.SubElement(
            element,
            "joint",
            name=joint,
            type="hinge",
            axis=_text(elbow_axis(skeleton, joint)),
            limited="true",
            range=_text((STRAIGHT, BENT)),
        )
    else:
        ElementTree.SubElement(element, "joint", name=joint, type="ball")


def elbow_axis(skeleton: Skeleton, elbow: str) -> Array:
    """(3,) unit axis about which a positive turn brings the forearm forward.

    raises  ValueError when the upper arm points forward at rest
    """
    shoulder = elbow.replace("elbow", "shoulder")
    axis = np.cross(skeleton.joints[elbow] - skeleton.joints[shoulder], FORWARD)
    length = float(np.linalg.norm(axis))
    if length < 1e-3 * float(np.linalg.norm(skeleton.joints[elbow] - skeleton.joints[shoulder])):
        raise ValueError(
            f"the upper arm above '{elbow}' points forward at rest, which leaves no axis for a "
            "hinge. Let that elbow be a ball joint."
        )
    return np.asarray(axis / length)


def _add_inertia(element: ElementTree.Element, inertia: Inertia, skeleton: Skeleton) -> None:
    origin = skeleton.joints[joint_of(element.attrib["name"])]
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
