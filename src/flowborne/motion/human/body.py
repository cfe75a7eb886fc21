"""The human as MJCF: 23 bodies, ball joints, explicit inertias."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from flowborne.kernels.arrays import Array
from flowborne.motion.human.segments import Inertia, Sex, inertias
from flowborne.motion.human.shapes import Shape, shapes
from flowborne.motion.human.skeleton import BODIES, JOINT_OF, SIDES, Skeleton

ELBOWS = tuple(f"{side}_elbow" for side in SIDES)

MAX_ELBOW_FLEXION = 150.0
"""Degrees; largest flexion of a hinged elbow."""

MAX_STRAIGHT_FLEXION = 5.0
"""Degrees; largest flexion at rest of an elbow that counts as straight."""

FORWARD, UP = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])

LINK_MASS_RATIO = 0.05
"""Part of the mass of the parent body that moves with a link: small, because the clip moves it."""

STRIKING = tuple(f"{side}_{body}" for side in SIDES for body in ("forearm", "hand"))
STRUCK = (
    "pelvis",
    "lower_back",
    "head",
    *(f"{side}_{body}" for side in SIDES for body in ("thigh", "shank")),
)
"""Bodies of the first group collide with those of the second; no other bodies collide."""


def human_mjcf(
    skeleton: Skeleton,
    mass: float,
    sex: Sex,
    hinged_elbows: Collection[str] = (),
    touching: Collection[str] = SIDES,
    held: Collection[str] = (),
) -> str:
    """MJCF of a human at rest: the root is a free joint, every other joint a ball joint.

    Body frames are parallel to the world's at rest, with their origins at the joints. Joints have
    no friction, stiffness or inertia. A link of the skeleton is a body without a geometry.

    mass           kg
    hinged_elbows  elbows that are hinges instead: 0 is the pose at rest, positive angles bend the
                   forearm forward, from straight to 150 degrees
    touching       sides, "left" and "right", on which forearm and hand collide. An arm that follows
                   a clip should not: the actor's body is thicker or thinner
    held           joints to omit: their bodies are rigidly attached to the parent bodies
    raises         ValueError for a mass that is not positive, and a hinge that is not an elbow
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
        position = skeleton.joints[joint]
        origin = skeleton.joints[parent] if parent else np.zeros(3)
        above = elements[parent]
        for link in skeleton.links.get(joint, ()):
            above = ElementTree.SubElement(
                above, "body", name=link.name, pos=_text(link.position - origin)
            )
            ElementTree.SubElement(above, "joint", name=link.name, type="ball")
            _add_inertia(above, inertia[bodies[parent]].part(LINK_MASS_RATIO), link.position)
            origin = link.position
        element = ElementTree.SubElement(above, "body", name=body, pos=_text(position - origin))
        elements[joint] = element
        if joint not in held:
            _add_joint(element, joint, skeleton, joint in hinged_elbows)
        _add_inertia(element, inertia[body].part(1.0 - LINK_MASS_RATIO * linked[joint]), position)
        strikes = body in STRIKING and body.split("_")[0] in touching
        _add_geom(element, shape[body], skeleton, strikes)
    ElementTree.indent(top)
    return ElementTree.tostring(top, encoding="unicode")


def _text(values: ArrayLike) -> str:
    """Numbers for MJCF, with more digits than the tests compare."""
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
            range=_text((-bend, MAX_ELBOW_FLEXION - bend)),
        )
    else:
        ElementTree.SubElement(element, "joint", name=joint, type="ball")


def elbow_hinge(skeleton: Skeleton, elbow: str) -> tuple[Array, float]:
    """(3,) unit axis about which a positive rotation bends an elbow, and its flexion at rest in
    degrees.

    A straight elbow bends the forearm forward, or up if the upper arm points forward.
    """
    side = elbow.split("_")[0]
    upper = skeleton.joints[elbow] - skeleton.joints[f"{side}_shoulder"]
    upper = upper / np.linalg.norm(upper)
    fore = skeleton.joints[f"{side}_wrist"] - skeleton.joints[elbow]
    axis = np.cross(upper, fore)
    bend = float(np.degrees(np.arctan2(np.linalg.norm(axis), upper @ fore)))
    if bend <= MAX_STRAIGHT_FLEXION:
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
        pos=_text(shape.centre - skeleton.joints[JOINT_OF[body]]),
        xyaxes=_text(shape.axes[:, :2].T),
        rgba=_text(shape.colour),
        contype=str(int(strikes)),
        conaffinity=str(int(body in STRUCK)),
        friction="0.6",
    )
