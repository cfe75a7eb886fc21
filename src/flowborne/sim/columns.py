"""Columns of the history: the name of each with its unit, and how it follows from a frame."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.control.objectives import name_of
from flowborne.coupling.named import Named
from flowborne.coupling.world import Setup, World
from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.runs.frame_report import FrameReport
from flowborne.solids.dynamics import Kinematics, kinematics
from flowborne.solids.geoms import quaternion_of
from flowborne.solids.model import HINGE, SLIDE, SolidModel

if TYPE_CHECKING:
    from flowborne.control.controller import Controller

OF_BODIES = {
    "centre": "m",
    "velocity": "m/s",
    "rotation": "rad/s",
    "force": "N",
    "torque": "Nm",
    "added_mass_force": "N",
    "added_mass_torque": "Nm",
}
"""Quantity of a body -> its unit; a torque is about the centre of mass, an added-mass one is a part
of it."""

POSITION = {HINGE: ("angle", "rad"), SLIDE: ("position", "m")}
"""Kind of joint -> what its position is called, and its unit."""

IMPULSES = ("exchanged", "advection", "boundary", "crossed", "forces")
"""Parts of the budget that are impulses of a whole frame."""

LISTED = 3
"""Most columns that a message names."""


@dataclass(frozen=True)
class Moment:
    """The end of a frame.

    report  of the frame; None before the first
    """

    world: World
    frame: int
    report: FrameReport | None

    @property
    def done(self) -> FrameReport:
        """The report, where there is one."""
        assert self.report is not None
        return self.report

    @cached_property
    def pose(self) -> Kinematics:
        return kinematics(self.world.setup.solid, self.world.solid.q)

    @cached_property
    def named(self) -> Named:
        return Named.after(self.world, self.report)

    @cached_property
    def drives(self) -> tuple[Array, Array]:
        return drive_means(self.done)


@dataclass(frozen=True)
class Quantity:
    """Columns that are computed together.

    names    in the order in which they are written
    values   their numbers at a moment, in this order
    of_step  whether only a step can tell them: before the first frame they are nan
    """

    names: Sequence[str]
    values: Callable[[Moment], Iterable[float]]
    of_step: bool = True


class Columns:
    """Columns of a scene's history and their values.

    Columns carry their unit at the end of their name. Positions and velocities hold at the frame's
    end. Forces and torques are means over the frame: the impulse of all its steps over its time;
    with one step a frame they hold at its end too, with n steps (n - 1) / 2 steps earlier.
    Convergence is that of the worst step.

      frame, time_s
      angle_<joint>_rad … power_<joint>_W       joints and their drives; see `of_joints`
      objective                                 of the last decision, as its trials evaluate it; see
                                                `Decision`
      measured_<term>                           each term without its weight, in the last step
      drag_N, lift_N                            force of fluid and winds on all bodies along and
                                                across the stream (a quarter turn to its left),
                                                without the added-mass part
      added_mass_drag_N, added_mass_lift_N      with which the fluid resists the bodies'
                                                acceleration; both together are the whole force
      effort                                    |drive force| dt over the controlled dofs, N m s
      work_J                                    that the drives did in the frame
      flesh_least_detF, flesh_inside_out        least volume of an element over that at rest, number
                                                of elements inside out, in scenes with flesh
      <body>_x_m … _z_m, <body>_qw … _qz        pose of every body
      <body>_centre_x_m … _torque_z_Nm          of bodies named in the scene's output; see OF_BODIES
      window_x_m … _z_m                         lower corner of a domain that follows bodies, along
                                                the axes along which it moves
      momentum_{solid,fluid}_{x,y,z}_Ns         after the frame
      momentum_{exchanged,advection,…}_…_Ns     given to the bodies by pressure; made in advection
                                                or lost (0 but in the paper's scheme); given to the
                                                fluid by the sides' pressure (boundary), by what
                                                flows through them (crossed), and by forces and
                                                friction (forces)
      momentum_jet_…_Ns, expelled_m3            brought into the fluid by mouths (m^2 in a slab), in
                                                scenes that have some
      momentum_{exchange,budget}_error          relative: of the pressure solve; of all of these
      divergence_1/s, solver_iterations, residual, contacts
      fastest_m/s                               largest speed of the fluid across an open part of a
                                                face in any step of the frame

    names       in the order in which they are written
    controlled  column of the position of each controlled joint -> its place among their dofs
    raises      SceneError where two joints or bodies would have the same column
    """

    def __init__(
        self,
        setup: Setup,
        controller: Controller | None = None,
        stream: tuple[float, ...] | None = None,
        bodies: tuple[str, ...] = (),
        joints: bool | tuple[str, ...] = True,
        told: tuple[str, ...] = (),
    ) -> None:
        self._controller = controller
        dofs = np.zeros(0, np.int64) if controller is None else controller.dofs
        self.controlled = controlled_positions(setup.solid, dofs)
        self._quantities = (
            Quantity(("frame", "time_s"), lambda now: (now.frame, now.world.time), False),
            *of_joints(setup, dofs, joints, told),
            *of_objective(controller),
            *of_forces(stream, dofs),
            *of_bodies(setup.solid, bodies),
            *of_fluid(setup),
        )
        self.names = tuple(name for quantity in self._quantities for name in quantity.names)
        twice = [name for name, count in Counter(self.names).items() if count > 1]
        if twice:
            raise SceneError(
                f"the history would have two columns '{twice[0]}', because the name of one joint "
                "or body is that of another with '_x' or a quantity behind it. Rename one in the "
                "model."
            )

    def values(self, world: World, frame: int, report: FrameReport | None) -> dict[str, float]:
        """column -> number, in the order of `names`; without a report nan for what needs a step."""
        now, found = Moment(world, frame, report), dict[str, float]()
        for quantity in self._quantities:
            if quantity.of_step and report is None:
                found |= dict.fromkeys(quantity.names, np.nan)
            else:
                found |= zip(quantity.names, quantity.values(now), strict=True)
        return found

    def lost(self, values: Mapping[str, float]) -> str:
        """Names of the first few columns of a frame without a finite number; "" when all have one.

        Without a controller there is no objective, which is then nan.
        """
        known = set() if self._controller is not None else {"objective"}
        names = [c for c, value in values.items() if c not in known and not np.isfinite(value)]
        return ", ".join(names[:LISTED]) + (" and more" if len(names) > LISTED else "")

    def strength_steps(self, frame_time: float) -> dict[str, float]:
        """column of each controlled joint -> the farthest it moves by one decision, rad or m."""
        controller = self._controller
        if controller is None:
            return {}
        steps = controller.greatest_strength() * controller.every * frame_time
        return {column: float(steps[n]) for column, n in self.controlled.items()}


def drive_means(report: FrameReport) -> tuple[Array, Array]:
    """(nv,) generalised force (N or N m) and power (W) of the drives, means over a frame."""
    return report.mean(lambda step: step.actuator), report.mean(
        lambda step: step.actuator * step.velocity
    )


def of_joints(
    setup: Setup, controlled: Integers, chosen: bool | tuple[str, ...], told: tuple[str, ...]
) -> Iterator[Quantity]:
    """Position, target, drive force and power of joints.

    controlled  (n,) dofs of the controller
    chosen      joints with columns for their drive: True for all that are driven, or names
    told        joints that are told from outside

    angle_<joint>_rad, position_<joint>_m    of every hinge and slide
    target_<joint>_rad, target_<joint>_m     of those that are controlled, or chosen and prescribed
    torque_<joint>_Nm, force_<joint>_N       of the drive of a chosen joint, mean over the frame;
                                             with _x, _y, _z of a ball (axes of its body) and of a
                                             free joint (force: world axes, torque: its body's)
    power_<joint>_W                          of that drive, mean over the frame, so that power times
                                             frame time is the work that it did
    """
    model, motions = setup.solid, setup.motions
    prescribed = _mask(model, [motion.dofs for motion in motions])
    driven = prescribed | _mask(model, [controlled, *(model.dofs_of(joint) for joint in told)])
    positions: dict[str, int] = {}
    decided: dict[str, int] = {}
    followed: dict[str, int] = {}
    force: list[tuple[str, int]] = []
    power: dict[str, Integers] = {}
    places = controlled_positions(model, controlled)
    for name in _joints(model):
        dofs = model.dofs_of(name)
        named = driven[dofs].any() if isinstance(chosen, bool) else name in chosen
        named = bool(chosen and named)
        if (position := _position(model, name)) is not None:
            column = f"target_{name}_{position.rpartition('_')[2]}"
            positions[position] = int(model.positions_of(name)[0])
            if position in places:
                decided[column] = places[position]
            elif named and prescribed[dofs[0]]:
                followed[column] = positions[position]
        if named:
            force += _components(model, name)
            power[f"power_{name}_W"] = dofs

    def target(now: Moment) -> Array:
        q = now.world.solid.q.copy()
        for motion in motions:
            q[model.indices_of(motion.dofs)] = motion.position(now.world.time)
        return q

    yield Quantity([*positions], lambda now: _at(now.world.solid.q, positions), False)
    yield Quantity([*decided], lambda now: _at(now.done.targets, decided))
    if followed:
        yield Quantity([*followed], lambda now: _at(target(now), followed), False)
    if power:
        yield Quantity(
            [column for column, _ in force],
            lambda now: [float(now.drives[0][dof]) for _, dof in force],
        )
        yield Quantity(
            [*power], lambda now: [float(now.drives[1][dofs].sum()) for dofs in power.values()]
        )


def of_objective(controller: Controller | None) -> Iterator[Quantity]:
    """The objective, and each of its terms once."""
    found = () if controller is None else controller.objective.terms
    terms = list(dict.fromkeys(name_of(term.objective) for term in found))
    yield Quantity(["objective"], lambda now: [now.done.objective])
    yield Quantity(
        [f"measured_{term}" for term in terms], lambda now: [now.done.terms[term] for term in terms]
    )


def of_forces(stream: tuple[float, ...] | None, controlled: Integers) -> Iterator[Quantity]:
    """Drag and lift, effort and work."""
    along, across = axes_of(stream)

    def forces(now: Moment) -> list[float]:
        added = now.done.central_added_mass()[1:, :3].sum(axis=0)
        both = now.done.drag()[1:].sum(axis=0), added
        return [float(force @ axis) for force in both for axis in (along, across)]

    def effort(now: Moment) -> float:
        last = now.done.step
        return float(np.linalg.norm(last.actuator[controlled]) * last.dt)

    yield Quantity(["drag_N", "lift_N", "added_mass_drag_N", "added_mass_lift_N"], forces)
    yield Quantity(
        ["effort", "work_J"], lambda now: [effort(now), sum(s.work for s in now.done.steps)]
    )


def of_bodies(model: SolidModel, named: tuple[str, ...]) -> Iterator[Quantity]:
    """Volumes of flesh, the pose of every body, and all of OF_BODIES of those that are named."""
    flesh, names = model.flesh, model.body_names[1:]
    if flesh is not None:
        ratios = flesh.volume_ratios
        yield Quantity(
            ["flesh_least_detF", "flesh_inside_out"],
            lambda now: [
                float((found := ratios(now.world.solid.q)).min()),
                float((found <= 0.0).sum()),
            ],
            False,
        )

    def poses(now: Moment) -> Iterator[float]:
        for place, rotation in zip(now.pose.body_position, now.pose.body_rotation, strict=True):
            yield from map(float, (*place, *quaternion_of(rotation)))

    columns = [*(f"{axis}_m" for axis in "xyz"), *(f"q{axis}" for axis in "wxyz")]
    world_body = len(columns)
    yield Quantity(
        [f"{name}_{column}" for name in names for column in columns],
        lambda now: list(poses(now))[world_body:],
        False,
    )
    for name in named:
        yield Quantity(
            [f"{name}_{quantity}_{a}_{u}" for quantity, u in OF_BODIES.items() for a in "xyz"],
            partial(numbers_of, name),
            False,
        )


def of_fluid(setup: Setup) -> Iterator[Quantity]:
    """Where a domain is that moves, the budget of momentum, and how well the solves did."""
    window = None if setup.fluid is None else setup.fluid.window
    axes = () if window is None else window.axes
    blows = bool(setup.mouths)

    def worst(*names: str) -> Callable[[Moment], list[Any]]:
        return lambda now: [max(getattr(step, name) for step in now.done.steps) for name in names]

    def momenta(now: Moment) -> Iterator[float]:
        steps, last = now.done.steps, now.done.step.momentum
        for part in ("solid", "fluid"):
            yield from map(float, getattr(last, part))
        for part in (*IMPULSES, *(["jet"] if blows else [])):
            whole = np.sum([getattr(step.momentum, part) for step in steps], axis=0)
            yield from map(float, whole)

    def errors(now: Moment) -> list[float]:
        parts = [step.momentum for step in now.done.steps]
        return [max(m.exchange_error for m in parts), max(m.budget_error for m in parts)]

    yield Quantity(
        [f"window_{'xyz'[axis]}_m" for axis in axes],
        lambda now: [now.world.flow()[0].grid.origin[axis] for axis in axes],
        False,
    )
    kinds = ("solid", "fluid", *IMPULSES, *(["jet"] if blows else []))
    yield Quantity([f"momentum_{kind}_{a}_Ns" for kind in kinds for a in "xyz"], momenta)
    if blows:
        yield Quantity(["expelled_m3"], lambda now: [sum(s.expelled for s in now.done.steps)])
    yield Quantity(["momentum_exchange_error", "momentum_budget_error"], errors)
    yield Quantity(["divergence_1/s"], worst("divergence"))
    if setup.fluid is not None and setup.fluid.scalars:
        yield Quantity(["dye_budget_error"], worst("dye_error"))
    yield Quantity(
        ["solver_iterations", "residual", "contacts", "fastest_m/s"],
        worst("iterations", "residual", "contacts", "fastest"),
    )


def controlled_positions(model: SolidModel, controlled: Integers) -> dict[str, int]:
    """Column of the position of each controlled hinge and slide -> its place among the dofs."""
    places = {int(dof): n for n, dof in enumerate(controlled)}
    return {
        position: places[dof]
        for name in _joints(model)
        if (position := _position(model, name)) is not None
        and (dof := int(model.dofs_of(name)[0])) in places
    }


def numbers_of(name: str, now: Moment) -> list[float]:
    """Every quantity of OF_BODIES of a body, in its order."""
    body = now.named.body(name)
    state = (body.centre, body.velocity, body.angular_velocity)
    parts = (*state, body.force, body.torque, body.added_mass_force, body.added_mass_torque)
    found: list[float] = np.concatenate(parts).tolist()
    return found


def axes_of(stream: tuple[float, ...] | None) -> tuple[Array, Array]:
    """Unit vectors along the stream (x without one) and across it, z x along (x when along z)."""
    if stream is None:
        return np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    along = np.asarray(stream, float) / np.linalg.norm(stream)
    across = np.cross([0.0, 0.0, 1.0], along)
    if np.linalg.norm(across) < 1e-9:
        return along, np.array([1.0, 0.0, 0.0])
    return along, across / np.linalg.norm(across)


def _at(values: Array, places: Mapping[str, int]) -> list[float]:
    found: list[float] = values[list(places.values())].tolist()
    return found


def _position(model: SolidModel, joint: str) -> str | None:
    """Column of the position of a hinge or a slide; None for other joints."""
    kind = _kind(model, joint)
    if kind not in POSITION:
        return None
    quantity, unit = POSITION[kind]
    return f"{quantity}_{joint}_{unit}"


def _components(model: SolidModel, joint: str) -> list[tuple[str, int]]:
    """Column and dof of each component of a joint's drive; none that a slab locks."""
    dofs, kind = model.dofs_of(joint), _kind(model, joint)
    if kind in POSITION:
        column = f"torque_{joint}_Nm" if kind == HINGE else f"force_{joint}_N"
        return [(column, int(dofs[0]))]
    columns = [f"torque_{joint}_{axis}_Nm" for axis in "xyz"]
    if len(dofs) > len(columns):
        columns = [f"force_{joint}_{axis}_N" for axis in "xyz"] + columns
    found = zip(columns, dofs.tolist(), strict=True)
    return [(column, dof) for column, dof in found if not model.locked[dof]]


def _joints(model: SolidModel) -> list[str]:
    """Names of the joints that are not of flesh."""
    flesh, first = model.flesh, model.mj.jnt_dofadr
    names = enumerate(model.joint_names)
    return [name for j, name in names if flesh is None or not flesh.dofs[first[j]]]


def _kind(model: SolidModel, joint: str) -> int:
    return int(model.mj.jnt_type[model.joint(joint)])


def _mask(model: SolidModel, dofs: Sequence[Integers]) -> Mask:
    mask = np.zeros(model.nv, bool)
    for some in dofs:
        mask[some] = True
    return mask
