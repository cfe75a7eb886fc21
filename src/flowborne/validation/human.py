"""A standing human whose back and arms look for least effort: K8 and K9."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from flowborne import Array, Controller, Hypothesis, Setup, SolidModel, StepReport, World, step
from flowborne.bodies import human_mjcf, kinematics, standard_skeleton
from flowborne.executors import Serial
from flowborne.gradients import GradientCentral
from flowborne.motions import ServoExact
from flowborne.objectives import ObjectiveEffort, ObjectiveSum, WeightedObjective
from flowborne.rules import GoldenSection
from flowborne.validation.case import Case, Finding, at_most
from flowborne.winds import Wind

G = 9.81
FRAME, STEPS = 1.0 / 24.0, 4
"""s of a frame, and physics steps in it."""

STRENGTH, PROBE = np.radians(60.0), np.radians(0.5)
"""rad/s of every joint, and displacement of the differences, rad."""

LIMIT = 100.0
"""N m with which a shoulder may push at most, so that a leg can stop an arm."""

BACK, SHOULDERS = "lower_back", ("left_shoulder", "right_shoulder")
ARM = ("upper_arm", "forearm", "hand")

Pose = Mapping[str, Sequence[float]]
"""Joint -> rotation vector in degrees, about axes that point forward, left and up at rest."""


@dataclass
class Still:
    """Joints that stay in a pose."""

    dofs: NDArray[np.int64]
    places: Array

    def position(self, time: float) -> Array:
        """(m,) their places in q."""
        return self.places

    def velocity(self, time: float) -> Array:
        """(k,) zero."""
        return np.zeros(len(self.dofs))


@cache
def human() -> SolidModel:
    """The standard male body of 73 kg under gravity."""
    return SolidModel.from_string(
        human_mjcf(standard_skeleton(), 73.0, "male"), gravity=(0.0, 0.0, -G)
    )


def standing(pose: Pose, free: Sequence[str], *winds: Wind) -> World:
    """A human that stands still in a pose; the joints in `free` are the controller's to move."""
    model = human()
    turn = np.zeros(model.nv)
    for joint, degrees in pose.items():
        turn[model.dofs_of(joint)] = np.radians(degrees)
    q = model.integrate(model.rest().q, turn, 1.0)
    still = np.setdiff1d(np.arange(model.nv), dofs_of(free))
    world = World.at_rest(Setup(model, None, (Still(still, q[model.indices_of(still)]),), winds))
    world.solid.q[:] = q
    return world


def dofs_of(joints: Sequence[str]) -> NDArray[np.int64]:
    """Dofs of joints, in their order."""
    return np.array([dof for joint in joints for dof in human().dofs_of(joint)], dtype=np.int64)


def wish(joints: Sequence[str], effort_of: str, weight: float = 1.0) -> WeightedObjective:
    """That `joints` want least effort of one joint."""
    return WeightedObjective(
        ObjectiveEffort(human().dofs_of(effort_of)), weight, wanted_by=dofs_of(joints)
    )


def settle(
    world: World, free: Sequence[str], wishes: Sequence[WeightedObjective], frames: int
) -> StepReport:
    """Let the joints follow their wishes; gives the report of the last step."""
    limits = np.where(np.isin(dofs_of(free), dofs_of(SHOULDERS)), LIMIT, np.inf)
    controller = Controller(
        dofs_of(free),
        ObjectiveSum(tuple(wishes)),
        Hypothesis(FRAME),
        float(STRENGTH),
        GradientCentral(float(PROBE)),
        GoldenSection(None, 0.05),
        servo=ServoExact(tuple(limits.tolist())),
        executor=Serial(),
    )
    for _ in range(frames):
        controller.decide(world, FRAME, step)
        end = world.time + FRAME
        for _ in range(STEPS):
            report = step(world, FRAME / STEPS, controller.command(world, end, FRAME / STEPS))
    return report


def bodies_above(joint: str) -> NDArray[np.int64]:
    """The bodies that a joint moves."""
    model = human()
    return np.flatnonzero(model.moves[:, model.dofs_of(joint)[0]]).astype(np.int64)


def centre_above(world: World, joint: str) -> tuple[Array, float]:
    """(3,) from a joint to the centre of mass of what it moves, m, and that mass, kg."""
    model, bodies = human(), bodies_above(joint)
    pose = kinematics(model, world.solid.q)
    mass = model.body_mass[bodies]
    centre = mass @ pose.mass_centre[bodies] / mass.sum()
    body = model.dof_body[model.dofs_of(joint)[0]]
    return centre - pose.body_position[body], float(mass.sum())


def off_centre(world: World, joint: str) -> float:
    """Horizontal distance of that centre from the joint, m."""
    return float(np.hypot(*centre_above(world, joint)[0][:2]))


def torque_in_world(world: World, report: StepReport, joint: str) -> Array:
    """(3,) drive torque of a ball joint, N m; the report has it in the body's own axes."""
    dofs = human().dofs_of(joint)
    body = human().dof_body[dofs[0]]
    turn = kinematics(human(), world.solid.q).body_rotation[body]
    return np.asarray(turn @ report.actuator[dofs])


SPREAD: Pose = {"left_shoulder": (25.0, 0.0, 0.0), "right_shoulder": (-25.0, 0.0, 0.0)}
"""Arms held off the sides, so that they miss the legs when the back leans."""


def back_over_hips(quick: bool) -> list[Finding]:
    """K8: the back brings what is above it over itself; its effort is the weight's moment."""
    starts = [(12.0, 15.0, 10.0), (-20.0, 5.0, 0.0), (0.0, -25.0, -15.0)]
    findings = []
    for start in starts[: 1 if quick else None]:
        world = standing({**SPREAD, BACK: start}, [BACK])
        settle(world, [BACK], [wish([BACK], BACK)], 36)
        said = f"centre of mass beside the back's joint from a lean of {start} degrees, m"
        findings.append(at_most(said, off_centre(world, BACK), 0.01))
    wrong = 0.0
    for lean in starts:
        world = standing({**SPREAD, BACK: lean}, [])
        report = step(world, FRAME)
        arm, mass = centre_above(world, BACK)
        moment = mass * G * np.array([arm[1], -arm[0], 0.0])
        torque = torque_in_world(world, report, BACK)
        wrong = max(wrong, float(np.abs(torque - moment).max() / np.linalg.norm(moment)))
    said = "torque at the back over M g (x_c - x_j), less one, about both horizontal axes"
    return [*findings, at_most(said, wrong, 1e-6)]


def arms_and_back(weight: float = 0.3) -> list[WeightedObjective]:
    """The back wants its own least effort; each arm its own and, by weight, the back's."""
    wishes = [wish([BACK], BACK)]
    for shoulder in SHOULDERS:
        wishes += [wish([shoulder], shoulder), wish([shoulder], BACK, weight)]
    return wishes


ABOVE = [BACK, *SHOULDERS]
RAISED_THIGH = (25.0, -40.0, 0.0)
"""Left thigh spread and lifted into the way of the hanging arm."""


def arms_hang(quick: bool) -> list[Finding]:
    """K9: arms hang below the shoulders and the rest balances; a leg in the way is answered."""
    world = standing(
        {BACK: (12.0, 15.0, 10.0), "left_shoulder": (10, -40, 0), "right_shoulder": (-20, 30, 0)},
        ABOVE,
    )
    settle(world, ABOVE, arms_and_back(), 48)
    findings = [
        at_most(f"centre of mass beside {joint}, m", off_centre(world, joint), 0.01)
        for joint in ABOVE
    ]
    findings.append(arms_serve_the_back())
    return findings + arm_is_blocked()


def arms_serve_the_back() -> Finding:
    """Arms with no wish but the back's least effort, over arms that hang, on a back that leans."""
    efforts = []
    for wishes in ([wish(SHOULDERS, BACK)], [wish([s], s) for s in SHOULDERS]):
        world = standing({BACK: (0.0, 10.0, 0.0)}, SHOULDERS)
        report = settle(world, SHOULDERS, wishes, 48)
        efforts.append(float(np.linalg.norm(torque_in_world(world, report, BACK))))
    said = "back's effort with arms that serve it alone, over arms that hang"
    return Finding(said, efforts[0] / efforts[1], "< 1", "less", efforts[0] < efforts[1])


def arm_is_blocked() -> list[Finding]:
    """Fig. 9 b: the left leg is in the way of the left arm."""
    world = standing(
        {BACK: (0.0, 8.0, 0.0), "left_hip": RAISED_THIGH, "left_shoulder": (0.0, -35.0, 0.0)}, ABOVE
    )
    settle(world, ABOVE, arms_and_back(), 72)
    forward = {s: float(centre_above(world, s)[0][0]) for s in SHOULDERS}
    ahead = forward["left_shoulder"] - forward["right_shoulder"]
    shift, expected = torso_shift(world)
    free = Finding(
        "blocked arm's centre of mass ahead of the free one's, m", ahead, "> 0", "ahead", ahead > 0
    )
    said = "torso's shift that balances the blocked arm, less -m_arm d / M_rest, m"
    lines = (f"shift {shift:.4f} m, -m_arm d / M_rest = {expected:.4f} m",)
    return [free, at_most(said, shift - expected, 0.01, lines=lines)]


def torso_shift(world: World) -> tuple[float, float]:
    """How far forward all but the arm's own reach is from the back, and what balances that reach.

    The arm counts at its shoulder in the first, and by its reach d forward of it in the second.
    """
    model = human()
    pose = kinematics(model, world.solid.q)
    joint = pose.body_position[model.body("lower_back")]
    shoulder = pose.body_position[model.body("left_upper_arm")]
    arm = bodies_above("left_shoulder")
    above = bodies_above(BACK)
    place = pose.mass_centre.copy()
    place[arm] = shoulder
    mass = model.body_mass
    shift = mass[above] @ (place[above, 0] - joint[0]) / mass[above].sum()
    reach = mass[arm] @ (pose.mass_centre[arm, 0] - shoulder[0]) / mass[above].sum()
    return float(shift), float(-reach)


CASES = (Case("K8", back_over_hips), Case("K9", arms_hang))
