"""A standing human with least effort of back and arms (K8, K9), also in the wind (K10)."""

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
from flowborne_validation.findings import Figure, Figures

G, MASS, FRAMES = 9.81, 73.0, 48
"""m/s^2; kg of the standard body; frames after which no joint of these scenes moves any more."""

BACK, SHOULDERS = "lower_back", ("left_shoulder", "right_shoulder")
"""Names of joints; the body on the back's joint has the same name."""

Pose = Mapping[str, tuple[float, float, float]]
"""Joint -> degrees about axes that point forward, left and up at rest: intrinsic rotations in this
order."""

SPREAD: Pose = {"left_shoulder": (25.0, 0.0, 0.0), "right_shoulder": (-25.0, 0.0, 0.0)}
"""Arms away from the sides, so that they miss the legs when the back leans."""

PICTURE = {"domain", "fluid", "boundaries", "dye", "film"}
"""Tables that only draw the wind of a scene by dye in a fluid; the bodies have the given wind."""

LEANS, SHARE = ((12.0, 15.0, 10.0), (-20.0, 5.0, 0.0), (0.0, -25.0, -15.0)), 0.15
"""Of the back, degrees, as in `Pose`; force of the wind at the centre of mass over the weight."""


def standing(scene: str, pose: Pose, **tables: Any) -> Simulation:
    """A scene of the library with a clip in which the walker stands still.

    pose    of joints that are not controlled, and the start of controlled joints without one in the
            scene
    tables  replace those of the scene
    """
    with TemporaryDirectory() as folder:
        (Path(folder) / "still.bvh").write_text(still_clip(pose), encoding="utf-8")
        own = load_scene(scene).model_dump(exclude_none=True, exclude=PICTURE)
        posed = Scene.model_validate(own | {"clip": {"file": "still.bvh"}} | tables)
        return Simulation(posed.in_folder(Path(folder)), workers=1)


def settled(simulation: Simulation) -> Simulation:
    """The simulation after its joints have come to rest."""
    for _ in range(FRAMES):
        simulation.advance_frame()
    return simulation


def still_clip(pose: Pose) -> str:
    """BVH file of the standard skeleton in the same pose for a second."""
    skeleton = list(skeleton_below(human(), 1))
    joints = [line.split()[1] for line in skeleton if line.startswith(("ROOT", "JOINT"))]
    row = " ".join(f"{angle:g}" for joint in joints for angle in pose.get(joint, (0.0,) * 3))
    motion = ["MOTION", "Frames: 2", "Frame Time: 1.0", row, row]
    return "\n".join(["HIERARCHY", *skeleton, *motion]) + "\n"


def skeleton_below(model: SolidModel, body: int) -> Iterator[str]:
    """Lines of a BVH file, y up and facing z, for a body's joint and all below it. Without end
    sites the last bones have their standard lengths."""
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
    """The load on a joint, in the world's axes.

    names   (n) of its bodies; the first is on the joint
    joint   (3,) m, its position
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
        """The load on a joint after the last step."""
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
        """Horizontal distance of the centre of mass from the joint, m."""
        return float(np.hypot(*self.reach[:2]))

    @property
    def lean(self) -> float:
        """Angle of the line from joint to centre from the vertical. Degrees; positive for a
        standing trunk that leans forward and a hanging arm that is blown back."""
        away = self.reach if self.reach[2] > 0.0 else -self.reach
        return float(np.degrees(np.arctan2(away[0], away[2])))

    @property
    def off_line(self) -> float:
        """Angle between weight and wind together and the line from joint to centre. Degrees; from
        the moment about the joint, which depends on where the wind acts."""
        forces = self.mass[:, None] * np.array([0.0, 0.0, -G]) + self.force
        moment = (np.cross(self.centre - self.joint, forces) + self.torque).sum(axis=0)
        net = np.linalg.norm(forces.sum(axis=0))
        sine = float(np.linalg.norm(moment) / (np.linalg.norm(self.reach) * net))
        return float(np.degrees(np.arcsin(min(sine, 1.0))))


def torque_at_back(simulation: Simulation) -> Array:
    """(3,) torque of the back's drive in the world's axes, N m; `drive` is in those of its body."""
    return np.asarray(simulation.body(BACK).rotation @ simulation.joint(BACK).drive)


def back_over_hips(starts: int) -> Figures:
    """K8: the back moves the mass above it over its joint, from some leans; its effort is the
    weight's moment."""
    found = {}
    for lean in LEANS[:starts]:
        free = settled(standing("human-gravity-back", {**SPREAD, BACK: lean}, initial={}))
        title = f"centre of mass beside the back's joint from a lean of {lean} degrees, m"
        found[title] = Load.on(free, BACK).off_centre
    title = "torque at the back over M g (x_c - x_j), less one, about both horizontal axes"
    return {**found, title: max(map(torque_off_moment, LEANS))}


def torque_off_moment(lean: tuple[float, float, float]) -> float:
    """Torque that holds a back in a lean less the weight's moment, over that moment."""
    held = standing(
        "human-gravity-back", {**SPREAD, BACK: lean}, initial={}, control=[], objectives=[]
    )
    held.advance_frame()
    load = Load.on(held, BACK)
    moment = load.mass.sum() * G * np.array([load.reach[1], -load.reach[0], 0.0])
    return float(np.abs(torque_at_back(held) - moment).max() / np.linalg.norm(moment))


def arms_hang() -> Figures:
    """K9: arms hang below the shoulders and the rest balances. Free arms are those of the standard
    body: in the scene's body the thighs reach the hands."""
    start: Pose = {
        BACK: (12.0, 15.0, 10.0),
        "left_shoulder": (10.0, -40.0, 0.0),
        "right_shoulder": (-20.0, 30.0, 0.0),
    }
    arms = settled(standing("human-gravity-arms", start, human={"mass": MASS}))
    return {
        f"centre of mass beside {joint}, m": Load.on(arms, joint).off_centre
        for joint in (BACK, *SHOULDERS)
    }


def arms_serve_the_back() -> Figures:
    """K9: effort of a leaning back with arms that serve it alone, over that with hanging arms."""
    serving, hanging = back_held(arms_serve=True), back_held(arms_serve=False)
    return {"back's effort with arms that serve it alone, over arms that hang": serving / hanging}


def back_held(arms_serve: bool) -> float:
    """Torque of a leaning back, N m, with one objective of the arms.

    arms_serve  whether that is least effort of the back, or of the arms
    """
    tables = load_scene("human-gravity-arms").model_dump(exclude_none=True)
    of_arms = [table for table in tables["objectives"] if table["wanted_by"] != (BACK,)]
    simulation = standing(
        "human-gravity-arms",
        {BACK: (0.0, 10.0, 0.0)},
        human={"mass": MASS},
        control=[table for table in tables["control"] if table["joints"] == SHOULDERS],
        objectives=[table for table in of_arms if (table["joints"] == (BACK,)) == arms_serve],
    )
    return float(np.linalg.norm(torque_at_back(settled(simulation))))


def arm_is_blocked() -> Figures:
    """K9, Fig. 9 b: the left thigh, spread and lifted, is in the way of the hanging arm."""
    start = {
        BACK: (0.0, 8.0, 0.0),
        "left_hip": (25.0, -40.0, 0.0),
        "left_shoulder": (0.0, -35.0, 0.0),
    }
    walker = settled(standing("human-gravity-arms", start))
    left, right = (Load.on(walker, shoulder) for shoulder in SHOULDERS)
    ahead = float(left.reach[0] - right.reach[0])
    shift, expected = torso_shift(Load.on(walker, BACK), left)
    title = "torso's shift that balances the blocked arm, less -m_arm d / M_rest, m"
    line = f"shift {shift:.4f} m, -m_arm d / M_rest = {expected:.4f} m"
    return {
        "blocked arm's centre of mass ahead of the free one's, m": ahead,
        title: Figure(shift - expected, lines=[line]),
    }


def torso_shift(back: Load, arm: Load) -> tuple[float, float]:
    """Forward shift of the mass above the back with the arm at its shoulder, and the shift that
    balances the arm's reach forward of the shoulder, m."""
    in_arm = np.isin(back.names, arm.names)[:, None]
    away = np.where(in_arm, arm.joint, back.centre) - back.joint
    whole = back.mass.sum()
    return float(back.mass @ away[:, 0] / whole), float(-arm.mass.sum() * arm.reach[0] / whole)


def wind_at_centre() -> list[dict[str, object]]:
    """[[wind]]: forces in proportion to the bodies' masses, which act at their common centre."""
    model = human()
    return [
        {"kind": "force", "force": [-SHARE * G * mass, 0.0, 0.0], "bodies": [name]}
        for name, mass in zip(model.body_names[1:], model.body_mass[1:].tolist(), strict=True)
    ]


def leans_into_the_wind() -> Figures:
    """K10 (a): the back lies along the net force, into a wind at the centre of mass, and into the
    wind of eq. (2)."""
    centred = Load.on(settled(standing("human-wind-back", SPREAD, wind=wind_at_centre())), BACK)
    faces = Load.on(settled(standing("human-wind-back", SPREAD)), BACK)
    law = float(np.degrees(np.arctan(SHARE)))
    off, lean = "net force off the back's line, degrees", "lean into it, degrees"
    return {
        f"wind at the centre of mass: {off}": centred.off_line,
        f"wind at the centre of mass: {lean}": centred.lean,
        "its angle, atan(F / M g), degrees": Figure(centred.lean, reference=law),
        f"wind on faces: {off}": faces.off_line,
        f"wind on faces: {lean}": faces.lean,
    }


def arms_in_the_wind() -> Figures:
    """K10: (b) arms along the net force on them, blown back; (c) arms with least drag as
    objective."""
    trailing = settled(standing("human-wind-arms", {}))
    found: dict[str, float] = {}
    for shoulder in SHOULDERS:
        arm = Load.on(trailing, shoulder)
        found[f"{shoulder}: net force off the line of the arm, degrees"] = arm.off_line
        found[f"{shoulder}: blown back by, degrees"] = arm.lean
    held = settled(standing("human-wind-drag", {}))
    title = "drag of arms that want little of it over that of arms that want little effort"
    return {**found, title: drag_of_arms(held) / drag_of_arms(trailing)}


def drag_of_arms(simulation: Simulation) -> float:
    """Force of the wind on both arms along it, N."""
    return float(-sum(Load.on(simulation, shoulder).force[:, 0].sum() for shoulder in SHOULDERS))
