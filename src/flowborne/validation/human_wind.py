"""A standing human in the wind: K10."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flowborne import Array, SolidModel, StepReport, World
from flowborne.bodies import Kinematics, kinematics
from flowborne.objectives import ObjectiveWindDrag, WeightedObjective
from flowborne.validation.case import Case, Finding, at_most, near
from flowborne.validation.human import (
    ABOVE,
    BACK,
    SHOULDERS,
    SPREAD,
    G,
    arms_and_back,
    bodies_above,
    centre_above,
    dofs_of,
    human,
    settle,
    standing,
    wish,
)
from flowborne.winds import Wind, WindFaces

HEADWIND = (-8.0, 0.0, 0.0)
"""m/s, against the face."""

AIR = 1.2
SHARE = 0.15
"""Force of the wind that acts at the centre of mass, as a part of the weight."""

DRAG_WEIGHT = 0.02
"""Of an arm's drag (N) against efforts (N m s)."""


@dataclass(frozen=True)
class WindAtCentre:
    """A force on each body in proportion to its mass, so that all of it acts at their centre.

    share  of the weight, along -x
    """

    share: float

    def wrench(self, model: SolidModel, kinematics: Kinematics, v: Array, time: float) -> Array:
        """(nbody, 6) force and torque about the world origin on each body."""
        force = model.body_mass[:, None] * np.array([-self.share * G, 0.0, 0.0])
        return np.concatenate([force, np.cross(kinematics.mass_centre, force)], axis=1)


def off_line(world: World, report: StepReport, joint: str) -> float:
    """Angle between the net force on what a joint moves and the line through joint and centre.

    Degrees; from the moment about the joint, so that it counts where the wind acts.
    """
    model, bodies = human(), bodies_above(joint)
    pose = kinematics(model, world.solid.q)
    at = pose.body_position[model.dof_body[model.dofs_of(joint)[0]]]
    weight = model.body_mass[bodies, None] * np.array([0.0, 0.0, -G])
    wind = report.wind_wrench[bodies]
    force = (weight + wind[:, :3]).sum(axis=0)
    moment = np.cross(pose.mass_centre[bodies], weight) + wind[:, 3:]
    about = moment.sum(axis=0) - np.cross(at, force)
    arm, _ = centre_above(world, joint)
    sine = float(np.linalg.norm(about) / (np.linalg.norm(arm) * np.linalg.norm(force)))
    return float(np.degrees(np.arcsin(min(sine, 1.0))))


def lean_of(world: World, joint: str) -> float:
    """Angle from the vertical of the line from a joint to the centre of mass of what it moves.

    Degrees; positive where a standing trunk leans forward and where a hanging arm is blown back.
    """
    arm, _ = centre_above(world, joint)
    away = arm if arm[2] > 0.0 else -arm
    return float(np.degrees(np.arctan2(away[0], away[2])))


def leans_into_the_wind(quick: bool) -> list[Finding]:
    """(a) The back in a wind at the centre of mass, and in that of eq. (2)."""
    findings = []
    winds: dict[str, Wind] = {
        "at the centre of mass": WindAtCentre(SHARE),
        "on faces": WindFaces(HEADWIND, AIR),
    }
    for said, wind in winds.items():
        world = standing(SPREAD, [BACK], wind)
        report = settle(world, [BACK], [wish([BACK], BACK)], 48)
        lean, off = lean_of(world, BACK), off_line(world, report, BACK)
        findings += [
            at_most(f"wind {said}: net force off the back's line, degrees", off, 1.0),
            Finding(f"wind {said}: lean into it, degrees", lean, "> 0", "sign", lean > 0.0),
        ]
        if isinstance(wind, WindAtCentre):
            law = float(np.degrees(np.arctan(SHARE)))
            findings.append(near("its angle, atan(F / M g), degrees", lean, law, absolute=1.0))
    return findings


def arms_in_the_wind(quick: bool) -> list[Finding]:
    """(b) Arms along the net force on them, blown back; (c) arms that want least drag."""
    wind = WindFaces(HEADWIND, AIR)
    world = standing({}, ABOVE, wind)
    report = settle(world, ABOVE, arms_and_back(0.1), 72)
    findings = []
    for shoulder in SHOULDERS:
        off = off_line(world, report, shoulder)
        said = f"{shoulder}: net force off the line of the arm, degrees"
        findings.append(at_most(said, off, 1.0))
        back = lean_of(world, shoulder)
        found = Finding(f"{shoulder}: blown back by, degrees", back, "> 0", "sign", back > 0.0)
        findings.append(found)
    world = standing({}, ABOVE, wind)
    held = settle(world, ABOVE, [wish([BACK], BACK), *least_drag()], 72)
    drags = [drag_of_arms(r) for r in (held, report)]
    said = "drag of arms that want little of it over that of arms that want little effort"
    findings.append(Finding(said, drags[0] / drags[1], "<= 1", "less", drags[0] <= drags[1]))
    return findings


def least_drag() -> list[WeightedObjective]:
    """Each arm wants least drag of its own."""
    return [
        WeightedObjective(
            ObjectiveWindDrag(bodies_above(shoulder), HEADWIND),
            DRAG_WEIGHT,
            wanted_by=dofs_of([shoulder]),
        )
        for shoulder in SHOULDERS
    ]


def drag_of_arms(report: StepReport) -> float:
    """Force of the wind on both arms along it, N."""
    arms = np.concatenate([bodies_above(shoulder) for shoulder in SHOULDERS])
    return float(-report.wind_wrench[arms, 0].sum())


def in_the_wind(quick: bool) -> list[Finding]:
    """K10."""
    return leans_into_the_wind(quick) + arms_in_the_wind(quick)


CASES = (Case("K10", in_the_wind),)
