"""How far a walker is from the file that it follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from flowborne.motion.bvh import TO_WORLD
from flowborne.scenes.capture import capture_of
from flowborne.scenes.load import load_scene
from flowborne.sim.simulation import Simulation
from flowborne.solids.dynamics import kinematics

from .plain_bvh import plain

SCENE = """
gravity = [0.0, 0.0, -9.81]
[time]
frames_per_second = {rate}
frames = 100
[human]
[clip]
file = "{file}"
{control}
"""

CONTROL = """
[[control]]
joints = ["lower_back"]
strength = 40.0
probe = 1.0
[[objectives]]
kind = "effort"
joints = ["lower_back"]
"""


@dataclass
class Worst:
    """The largest deviations of a walker.

    place  m, of a joint from the file's, both as seen from the hips, and of the way that the hips
           have gone over the ground
    turn   degrees, of a joint since the first frame
    bend   degrees, of a body from its rest as seen from its parent, and which
    joints how many were compared
    """

    place: float
    turn: float
    bend: tuple[float, str]
    joints: int


def worst(path: Path, frames: Sequence[int], free: Sequence[str] = (), control: str = "") -> Worst:
    """Run a scene of which the clip has its file alone, and compare it in some frames of the file.

    free  joints of the model that are left out, as are all that they carry
    """
    said = plain(path.read_text())
    toml = path.with_suffix(".toml")
    rate = 1.0 / said.frame_time
    toml.write_text(SCENE.format(rate=rate, file=path.name, control=control))
    scene = load_scene(toml)
    capture = capture_of(scene)
    assert capture is not None
    assert capture.skeleton is not None
    world = TO_WORLD[capture.up]
    with Simulation(scene, workers=1) as simulation:
        model = simulation.world.setup.solid
        mj = model.mj
        rest = kinematics(model, model.rest().q).body_rotation
        carried = np.zeros(model.nbody, bool)
        for joint in free:
            carried |= model.moves[:, model.dofs_of(joint)[0]]
        bodies = {
            joint: int(mj.jnt_bodyid[model.joint(joint)])
            for joint in model.joint_names
            if joint in capture.mapping and not carried[mj.jnt_bodyid[model.joint(joint)]]
        }
        first: dict[str, np.ndarray] = {}
        hips = said.places[capture.mapping["root"]]
        start = simulation.world.solid.q[:2].copy()
        place = turn = 0.0
        bend = 0.0, ""
        for frame in range(max(frames) + 1):
            if frame:
                simulation.advance_frame()
            if frame not in frames:
                continue
            found = kinematics(model, simulation.world.solid.q)
            turned = np.einsum("nij,nkj->nik", found.body_rotation, rest)
            gone = world @ (hips[frame] - hips[0])
            way = simulation.world.solid.q[:2] - start
            place = max(place, float(np.linalg.norm(way - capture.unit * gone[:2])))
            for joint, body in bodies.items():
                bone = capture.mapping[joint]
                theirs = world @ (said.places[bone][frame] - hips[frame])
                ours = found.body_position[body] - found.body_position[bodies["root"]]
                place = max(place, float(np.linalg.norm(ours - capture.unit * theirs)))
                own = world @ said.rotations[bone][frame] @ world.T
                since = found.body_rotation[body].T @ own
                first.setdefault(joint, since)
                turn = max(turn, angle(first[joint].T @ since))
            for body in range(2, model.nbody):
                above = int(mj.body_parentid[body])
                bend = max(bend, (angle(turned[above].T @ turned[body]), model.body_names[body]))
    return Worst(place, turn, bend, len(bodies))


def angle(matrix: np.ndarray) -> float:
    """Degrees of a rotation (3, 3)."""
    return float(np.degrees(np.arccos(np.clip((np.trace(matrix) - 1.0) / 2.0, -1.0, 1.0))))
