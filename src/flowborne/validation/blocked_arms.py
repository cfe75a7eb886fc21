"""The paper's Fig. 9 b with our numbers: a walk whose thighs are in the way of the hands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from flowborne import Array, Simulation, SolidModel, load_scene, run
from flowborne.bodies import SIDES, kinematics
from flowborne.exporters import write_atomically

SCENE = "human-gravity-arms"
ARM = ("upper_arm", "forearm", "hand")
SETTLED = 0.25
"""Part of the frames that is left out at the start."""


@dataclass(frozen=True)
class Walk:
    """What arms and torso do, a row per frame.

    ahead    (frames, 2) m, centre of mass of the left and of the right arm ahead of its shoulder
    torso    (frames, 2) m, centre of mass of what is above the back's joint, but the arms, ahead
             and to the left of it
    twist    (frames,) degrees of the thorax about the vertical, to the left
    touched  (frames,) whether an arm touched the body
    """

    ahead: Array
    torso: Array
    twist: Array
    touched: Array

    def means(self) -> list[float]:
        """Of all but the first frames: arms and torso in mm, twist in degrees, part touched."""
        late = slice(round(SETTLED * len(self.twist)), None)
        lengths = 1e3 * np.concatenate([self.ahead[late], self.torso[late]], axis=1).mean(axis=0)
        return [*lengths.tolist(), float(self.twist[late].mean()), float(self.touched.mean())]


COLUMNS = (
    "walk",
    "left arm ahead mm",
    "right arm ahead mm",
    "torso ahead mm",
    "torso to the left mm",
    "twist to the left degrees",
    "frames with contact",
)


def blocked_rows(frames: int | None = None) -> tuple[list[Sequence[object]], int]:
    """Rows for `COLUMNS` with and without collisions, and the frame in which the arms differ most.

    frames  how many; as many as the scene asks for when None
    """
    walks = {"arms collide": walk(True, frames), "arms pass through": walk(False, frames)}
    rows: list[Sequence[object]] = []
    for name, found in walks.items():
        *numbers, part = found.means()
        rows.append((name, *(f"{number:.1f}" for number in numbers), f"{100.0 * part:.0f} %"))
    blocked = walks["arms collide"]
    apart = np.abs(blocked.ahead[:, 0] - blocked.ahead[:, 1])
    late = round(SETTLED * len(apart))
    return rows, int(apart[late:].argmax()) + late + 1


def walk(collisions: bool, frames: int | None = None) -> Walk:
    """Run the scene, with or without what makes its arms collide."""
    rows: list[tuple[Array, Array, float, bool]] = []
    with Simulation(load_scene(SCENE), workers=1) as simulation:
        model = simulation.world.setup.solid
        if not collisions:
            model.mj.geom_contype[:] = 0
        for _ in range(simulation.frames if frames is None else frames):
            report = simulation.advance_frame()
            touched = any(step.contacts > 0 for step in report.steps)
            rows.append((*posture(model, simulation.world.solid.q), touched))
    ahead, torso, twist, touches = zip(*rows, strict=True)
    return Walk(np.array(ahead), np.array(torso), np.array(twist), np.array(touches, float))


def posture(model: SolidModel, q: Array) -> tuple[Array, Array, float]:
    """(2,) arms ahead, (2,) torso ahead and to the left, m, and twist in degrees of a pose."""
    pose = kinematics(model, q)

    def centre(bodies: Sequence[int]) -> Array:
        mass = model.body_mass[bodies]
        return np.asarray(mass @ pose.mass_centre[bodies] / mass.sum())

    arms = {side: [model.body(f"{side}_{part}") for part in ARM] for side in SIDES}
    ahead = [centre(bodies)[0] - pose.body_position[bodies[0], 0] for bodies in arms.values()]
    above = np.flatnonzero(model.moves[:, model.dofs_of("lower_back")[0]])
    rest = np.setdiff1d(above, [body for bodies in arms.values() for body in bodies])
    torso = centre(rest.tolist()) - pose.body_position[model.body("lower_back")]
    turn = pose.body_rotation[model.body("thorax")]
    return np.array(ahead), torso[:2], float(np.degrees(np.arctan2(turn[1, 0], turn[0, 0])))


def draw_frame(frame: int, path: Path) -> None:
    """Picture of the scene after `frame` frames.

    raises  ValueError when this machine cannot draw in three dimensions
    """
    import imageio.v3 as imageio

    from flowborne.pictures import Picture, Run

    with TemporaryDirectory() as folder:
        run(load_scene(SCENE), Path(folder) / "run", frames=frame, film=False)
        picture = Picture(Run.read(Path(folder) / "run"), scale=1.5)
        pixels = picture.draw(frame)[:, :, :3].copy()
        picture.close()
    write_atomically(path, lambda file: imageio.imwrite(file, pixels, extension=".png"))
