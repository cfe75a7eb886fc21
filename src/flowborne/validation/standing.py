"""The walker of the library's scenes, standing still, and where its parts hang or lean."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from flowborne import Array, Scene, Simulation, SolidModel, load_scene
from flowborne.bodies import human_mjcf, standard_skeleton

G = 9.81

MASS = 73.0
"""kg, of the standard body."""

FRAMES = 48
"""After which no joint of these scenes moves any more."""

BACK, SHOULDERS = "lower_back", ("left_shoulder", "right_shoulder")
"""Joints; the body on the back's has its name."""

Pose = Mapping[str, tuple[float, float, float]]
"""Joint -> degrees by which it turns about axes that point forward, left and up at rest; about the
first, then about the second as that has turned it, then about the third as both have."""

SPREAD: Pose = {"left_shoulder": (25.0, 0.0, 0.0), "right_shoulder": (-25.0, 0.0, 0.0)}
"""Arms held off the sides, so that they miss the legs when the back leans."""

PICTURE = {"domain", "fluid", "boundaries", "dye", "film"}
"""Tables of the scenes in wind that only draw it: there the fluid carries dye, and the bodies feel
the wind as it is given."""


def standing(scene: str, pose: Pose, **tables: Any) -> Simulation:
    """A scene of the library whose walker follows a clip in which nobody moves.

    pose    where joints stay that are not controlled, and where controlled ones start that the
            scene does not place
    tables  in place of the scene's own
    """
    with TemporaryDirectory() as folder:
        (Path(folder) / "still.bvh").write_text(still_clip(pose), encoding="utf-8")
        own = load_scene(scene).model_dump(exclude_none=True, exclude=PICTURE)
        posed = Scene.model_validate(own | {"clip": {"file": "still.bvh"}} | tables)
        return Simulation(posed.in_folder(Path(folder)), workers=1)


def settled(simulation: Simulation) -> Simulation:
    """The simulation when its joints have come to where they want to be."""
    for _ in range(FRAMES):
        simulation.advance_frame()
    return simulation


def still_clip(pose: Pose) -> str:
    """BVH file of the standard skeleton in a pose that it keeps for a second."""
    skeleton = list(skeleton_below(human(), 1))
    joints = [line.split()[1] for line in skeleton if line.startswith(("ROOT", "JOINT"))]
    row = " ".join(f"{angle:g}" for joint in joints for angle in pose.get(joint, (0.0,) * 3))
    motion = ["MOTION", "Frames: 2", "Frame Time: 1.0", row, row]
    return "\n".join(["HIERARCHY", *skeleton, *motion]) + "\n"


def skeleton_below(model: SolidModel, body: int) -> Iterator[str]:
    """Lines of a BVH file, y up and facing z, for a body's joint and all that hangs on it.

    There are no end sites, and so the last bones have their standard lengths.
    """
    forward, left, up = model.mj.body_pos[body]
    yield f"{'ROOT' if body == 1 else 'JOINT'} {model.joint_names[body - 1]}"
    yield "{"
    yield f"OFFSET {left:.9f} {up:.9f} {forward:.9f}"
    yield "CHANNELS 3 Zrotation Xrotation Yrotation"
    for child in np.flatnonzero(model.mj.body_parentid == body):
        yield from skeleton_below(model, int(child))
    yield "}"


@cache
def human() -> SolidModel:
    """The standard male body."""
    return SolidModel.from_string(human_mjcf(standard_skeleton(), MASS, "male"))


@dataclass(frozen=True, eq=False)
class Load:
    """What a joint carries, in the world's axes.

    names   (n) of its bodies; the first turns on the joint
    joint   (3,) m, where that is
    mass    (n,) kg
    centre  (n, 3) m, centres of mass
    force   (n, 3) N, of the wind
    torque  (n, 3) N m, of the wind about each centre of mass
    """

    names: list[str]
    joint: Array
    mass: Array
    centre: Array
    force: Array
    torque: Array

    @classmethod
    def on(cls, simulation: Simulation, joint: str) -> Load:
        """That of a joint after the last step."""
        model = simulation.setup.solid
        numbers = np.flatnonzero(model.moves[:, model.dofs_of(joint)[0]])
        names = [model.body_names[number] for number in numbers]
        bodies = [simulation.body(name) for name in names]
        return cls(
            names,
            bodies[0].position,
            model.body_mass[numbers],
            np.array([body.centre for body in bodies]),
            np.array([body.force for body in bodies]),
            np.array([body.torque for body in bodies]),
        )

    @property
    def reach(self) -> Array:
        """(3,) m from the joint to the centre of mass of the whole."""
        return np.asarray(self.mass @ (self.centre - self.joint) / self.mass.sum())

    @property
    def off_centre(self) -> float:
        """Horizontal distance of that centre from the joint, m."""
        return float(np.hypot(*self.reach[:2]))

    @property
    def lean(self) -> float:
        """Angle of the line from joint to centre from the vertical.

        Degrees; positive where a standing trunk leans forward and where a hanging arm is blown
        back.
        """
        away = self.reach if self.reach[2] > 0.0 else -self.reach
        return float(np.degrees(np.arctan2(away[0], away[2])))

    @property
    def off_line(self) -> float:
        """Angle between weight and wind together and the line from joint to centre.

        Degrees; from the moment about the joint, so that it counts where the wind acts.
        """
        forces = self.mass[:, None] * np.array([0.0, 0.0, -G]) + self.force
        moment = (np.cross(self.centre - self.joint, forces) + self.torque).sum(axis=0)
        net = np.linalg.norm(forces.sum(axis=0))
        sine = float(np.linalg.norm(moment) / (np.linalg.norm(self.reach) * net))
        return float(np.degrees(np.arcsin(min(sine, 1.0))))
