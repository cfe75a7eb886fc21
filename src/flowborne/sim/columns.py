"""Columns of the history: the name of each with its unit, and how it follows from a frame."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.control.objectives import name_of
from flowborne.coupling.report import FIELDS
from flowborne.coupling.world import Setup
from flowborne.kernels.arrays import Array, Integers, Mask
from flowborne.runs.history import OF_BODIES, POSE, body_columns, joint_column
from flowborne.sim.frame import FrameReport, Snapshot
from flowborne.solids.ellipsoids import EllipsoidModel
from flowborne.solids.geoms import quaternion_of
from flowborne.solids.model import HINGE, SLIDE, SolidModel
from flowborne.solids.motors import activations_of, inputs_of, outputs_of
from flowborne.solids.sensors import readings, sensor_columns

if TYPE_CHECKING:
    from flowborne.control.controller import Controller

POSITION = {HINGE: "angle", SLIDE: "position"}
"""Kind of joint -> what its position is called."""

OF_STEPS = {name: made for name, made in FIELDS.items() if made.frame is not None}
"""Columns made of the reports of steps."""

LISTED = 3
"""Most columns that a message names."""


@dataclass(frozen=True)
class Quantity:
    """Columns that are computed together.

    names    in the order in which they are written
    values   their numbers, in this order, from a FrameReport
    of_step  False where they are known without a frame: their numbers are from a Snapshot
    splits   whether they ask for the added-mass part of forces, which costs a solve
    """

    names: Sequence[str]
    values: Callable[[Any], Iterable[float]]
    of_step: bool = True
    splits: bool = False


class Outside(NamedTuple):
    """Names of the joints and actuators that are told from outside, and of the bodies that are
    pushed."""

    joints: tuple[str, ...] = ()
    actuators: tuple[str, ...] = ()
    bodies: tuple[str, ...] = ()


class Columns:
    """Columns of a scene's history and their values.

    Columns carry their unit at the end of their name. Positions and velocities hold at the frame's
    end. Forces and torques are means over the frame: the impulse of all its steps over its time;
    with one step a frame they hold at its end too, with n steps (n - 1) / 2 steps earlier.
    Convergence is that of the worst step.

      frame, time_s
      angle_<joint>_rad … power_<joint>_W       joints and their drives; see `of_joints`
      actuator_<name>_force … _control          of actuators that have controls; `of_actuators`
      sensor_<name>_<unit>                      of every sensor of the model
      objective                                 of the last decision, as its trials evaluate it; see
                                                `Decision`
      measured_<term>                           each term without its weight, in the last step
      drag_N, lift_N                            force of fluid and winds on all bodies along and
                                                across the stream (a quarter turn to its left),
                                                without the added-mass part
      added_mass_drag_N, added_mass_lift_N      with which the fluid resists the bodies'
                                                acceleration; both together are the whole force
      ellipsoid_drag_N, ellipsoid_power_W       force along the stream and power taken from the
                                                bodies by MuJoCo's ellipsoid fluid model
      effort                                    |drive force| dt over the controlled dofs, N m s
      work_J                                    that the drives did in the frame
      applied_force_<body>_x_N … _z_N           sum of the forces from outside on each body on which
      applied_torque_<body>_x_Nm … _z_Nm        some act, and torque about its centre of mass
      momentum_applied_x_Ns … _z_Ns             impulse of all these forces in the frame
      thrust_<thruster>_N                       of each thruster on its body
      jet_power_<thruster>_W                    that it gives to body and water: thrust times the
                                                speed with which water goes through it
      disc_water_<thruster>                     part of its disc that is water
      flesh_least_detF, flesh_inside_out        least volume of an element over that at rest, number
                                                of elements inside out, in scenes with flesh
      <body>_x_m … _z_m, <body>_qw … _qz        pose of every body
      <body>_centre_x_m … _torque_z_Nm          of bodies named in the scene's output: OF_BODIES. A
                                                torque is about the centre of mass, an added-mass
                                                one is a part of it
      window_x_m … _z_m                         lower corner of a domain that follows bodies, along
                                                the axes along which it moves
      momentum_solid_x_Ns … fastest_m/s         see `StepReport`: momenta after the frame, impulses
                                                and volumes of the whole frame, the worst of its
                                                steps of all else

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
        outside: Outside = Outside(),  # noqa: B008 (never changes)
        uniform: tuple[float, ...] | None = None,
    ) -> None:
        self._controller = controller
        dofs = np.zeros(0, np.int64) if controller is None else controller.dofs
        self.controlled = controlled_positions(setup.solid, dofs)
        quantities = (
            Quantity(("frame", "time_s"), lambda now: (now.frame, now.world.time), False),
            *of_joints(setup, dofs, joints, outside.joints),
            *of_actuators(setup.solid, outside.actuators),
            Quantity(sensor_columns(setup.solid), sensor_values, False),
            *of_objective(controller),
            *of_forces(stream, dofs),
            *of_ellipsoids(setup, stream, uniform),
            *of_applied(setup, outside.bodies),
            *of_bodies(setup.solid, bodies),
            *of_fluid(setup),
        )
        self._quantities = [quantity for quantity in quantities if quantity.names]
        self.names = tuple(name for quantity in self._quantities for name in quantity.names)
        twice = [name for name, count in Counter(self.names).items() if count > 1]
        if twice:
            raise SceneError(
                f"the history would have two columns '{twice[0]}', because the name of one joint "
                "or body is that of another with '_x' or a quantity behind it. Rename one in the "
                "model."
            )

    def values(self, now: Snapshot, split: bool = True) -> dict[str, float]:
        """column -> number, in the order of `names`; without a report nan for what needs a step.

        split  whether with those that ask for the added-mass part of forces
        """
        found: dict[str, float] = {}
        for quantity in self._quantities:
            if quantity.splits and not split:
                continue
            source = now.report if quantity.of_step else now
            if source is None:
                found |= dict.fromkeys(quantity.names, np.nan)
            else:
                found |= zip(quantity.names, quantity.values(source), strict=True)
        return found

    def lost(self, values: Mapping[str, float]) -> str:
        """Names of the first few columns of a frame without a finite number; "" when all have one.

        Without a controller there is no objective, which is then nan.
        """
        known = set() if self._controller is not None else {"objective"}
        names = [c for c, value in values.items() if c not in known and not math.isfinite(value)]
        return ", ".join(names[:LISTED]) + (" and more" if len(names) > LISTED else "")

    def strength_steps(self, frame_time: float) -> dict[str, float]:
        """column of each controlled joint -> the farthest it moves by one decision, rad or m."""
        controller = self._controller
        if controller is None:
            return {}
        steps = controller.greatest_strength() * controller.every * frame_time
        return {column: float(steps[n]) for column, n in self.controlled.items()}


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
        dofs, kind = model.dofs_of(name), _kind(model, name)
        named = driven[dofs].any() if isinstance(chosen, bool) else name in chosen
        named = bool(chosen and named)
        if kind in POSITION:
            position = joint_column(POSITION[kind], name)
            target = joint_column(f"target_{POSITION[kind]}", name)
            positions[position] = int(model.positions_of(name)[0])
            if position in places:
                decided[target] = places[position]
            elif named and prescribed[dofs[0]]:
                followed[target] = positions[position]
        if named:
            force += _components(model, name)
            power[joint_column("power", name)] = dofs

    def targets(now: Snapshot) -> list[float]:
        q = now.world.solid.q.copy()
        for motion in motions:
            q[model.indices_of(motion.dofs)] = motion.position(now.world.time)
        return _at(q, followed)

    def forces(frame: FrameReport) -> list[float]:
        mean = frame.mean(lambda step: step.actuator)
        return [float(mean[dof]) for _, dof in force]

    def powers(frame: FrameReport) -> list[float]:
        mean = frame.power()
        return [float(mean[dofs].sum()) for dofs in power.values()]

    yield Quantity([*positions], lambda now: _at(now.world.solid.q, positions), False)
    yield Quantity([*decided], lambda frame: _at(frame.targets, decided))
    yield Quantity([*followed], targets, False)
    yield Quantity([column for column, _ in force], forces)
    yield Quantity([*power], powers)


def of_actuators(model: SolidModel, told: tuple[str, ...]) -> Iterator[Quantity]:
    """Force, power, control and activation of actuators, with a number where there are several.

    actuator_<name>_force       mean over the frame, N or N m
    actuator_<name>_power_W     of the force on the rate of the actuator's length, mean over the
                                frame
    actuator_<name>_control     held within its range; 0 in a frame that tells it nothing
    actuator_<name>_activation  of a muscle or filter, at the end
    """
    Places = Callable[[SolidModel, int], slice]

    def named(word: str, places: Places, unit: str = "") -> tuple[list[str], list[int]]:
        columns, found = list[str](), list[int]()
        for name in told:
            own = places(model, model.actuator(name))
            several = own.stop - own.start > 1
            found += range(own.start, own.stop)
            columns += [
                f"actuator_{name}_{word}" + f"_{k}" * several + unit
                for k in range(own.stop - own.start)
            ]
        return columns, found

    forces, outputs = named("force", outputs_of)
    powers, _ = named("power", outputs_of, "_W")
    controls, inputs = named("control", inputs_of)
    active, activations = named("activation", activations_of)

    def told_controls(frame: FrameReport) -> Array:
        return frame.controls[inputs] if frame.controls.size else np.zeros(len(inputs))

    yield Quantity(forces, lambda frame: frame.mean(lambda step: step.output)[outputs])
    yield Quantity(powers, lambda frame: frame.mean(lambda step: step.output_power)[outputs])
    yield Quantity(controls, told_controls)
    yield Quantity(active, lambda now: now.world.solid.act[activations], False)


def sensor_values(now: Snapshot) -> list[float]:
    """Readings of all sensors, in the order of their columns."""
    found = readings(now.sensed, now.world.time).values()
    return [float(value) for reading in found for value in reading]


def of_objective(controller: Controller | None) -> Iterator[Quantity]:
    """The objective, and each of its terms once."""
    found = () if controller is None else controller.objective.terms
    terms = list(dict.fromkeys(name_of(term.objective) for term in found))
    yield Quantity(["objective"], lambda frame: [frame.objective])
    yield Quantity(
        [f"measured_{term}" for term in terms], lambda frame: [frame.terms[term] for term in terms]
    )


def of_forces(stream: tuple[float, ...] | None, controlled: Integers) -> Iterator[Quantity]:
    """Drag and lift, effort and work."""
    along, across = axes_of(stream)

    def forces(frame: FrameReport) -> list[float]:
        added = frame.central_added_mass()[1:, :3].sum(axis=0)
        both = frame.drag()[1:].sum(axis=0), added
        return [float(force @ axis) for force in both for axis in (along, across)]

    def effort(frame: FrameReport) -> list[float]:
        return [float(np.linalg.norm(frame.step.actuator[controlled]) * frame.step.dt)]

    names = ["drag_N", "lift_N", "added_mass_drag_N", "added_mass_lift_N"]
    yield Quantity(names, forces, splits=True)
    yield Quantity(["effort"], effort)
    yield of_steps("work")


def of_ellipsoids(
    setup: Setup, stream: tuple[float, ...] | None, uniform: tuple[float, ...] | None
) -> Iterator[Quantity]:
    """What MuJoCo's ellipsoid fluid model would give for the motion at the frame's end in a flow
    of velocity `uniform`, m/s."""
    fluid, (along, _) = setup.fluid, axes_of(stream)
    if fluid is None or uniform is None:
        return
    flow = EllipsoidModel(setup.solid, fluid.density, fluid.viscosity, uniform)

    def values(now: Snapshot) -> list[float]:
        if np.isnan(now.sensed.dt):
            return [np.nan, np.nan]
        force, power = flow.force_and_power(now.sensed.pose, now.sensed.velocity)
        return [float(force @ along), power]

    yield Quantity(["ellipsoid_drag_N", "ellipsoid_power_W"], values, False)


def of_applied(setup: Setup, told: tuple[str, ...]) -> Iterator[Quantity]:
    """Forces from outside on bodies, those that a policy pushes among them, and their impulse;
    thrusters."""
    model = setup.solid
    found = {*told, *(force.body for force in setup.forces)}
    found |= {model.body_names[thruster.body] for thruster in setup.thrusters}
    names = [name for name in model.body_names if name in found]
    if not names:
        return
    pushed = [model.body(name) for name in names]
    kinds = ("force", "N"), ("torque", "Nm")
    yield Quantity(
        [
            f"applied_{of}_{name}_{axis}_{unit}"
            for name in names
            for of, unit in kinds
            for axis in "xyz"
        ],
        lambda frame: frame.applied()[pushed].ravel().tolist(),
    )
    yield Quantity(
        [f"momentum_applied_{axis}_Ns" for axis in "xyz"],
        lambda frame: sum(step.dt * step.applied_wrench[:, :3].sum(axis=0) for step in frame.steps),
    )
    thrusters = [thruster.name for thruster in setup.thrusters]
    yield Quantity(
        [f"thrust_{name}_N" for name in thrusters],
        lambda frame: frame.mean(lambda step: step.thrust).tolist(),
    )
    yield Quantity(
        [f"jet_power_{name}_W" for name in thrusters],
        lambda frame: frame.mean(lambda step: step.jet_power).tolist(),
    )
    yield Quantity(
        [f"disc_water_{name}" for name in thrusters],
        lambda frame: frame.mean(lambda step: step.disc_water).tolist(),
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

    def poses(now: Snapshot) -> Iterator[float]:
        pose = now.sensed.pose
        for place, rotation in zip(pose.body_position[1:], pose.body_rotation[1:], strict=True):
            yield from map(float, (*place, *quaternion_of(rotation)))

    yield Quantity([f"{name}_{column}" for name in names for column in POSE], poses, False)
    for name in named:
        yield Quantity(body_columns(name), partial(numbers_of, name), False, splits=True)


def of_fluid(setup: Setup) -> Iterator[Quantity]:
    """Where a domain is that moves, the budget of momentum, and how well the solves did."""
    window = None if setup.fluid is None else setup.fluid.window
    axes = () if window is None else window.axes
    yield Quantity(
        [f"window_{'xyz'[axis]}_m" for axis in axes],
        lambda now: [now.world.flow()[0].grid.origin[axis] for axis in axes],
        False,
    )
    absent = {"work"}
    if not setup.mouths:
        absent |= {"momentum_jet", "expelled"}
    if setup.fluid is None or not setup.fluid.scalars:
        absent |= {"dye_budget_error"}
    yield from (of_steps(name) for name in OF_STEPS if name not in absent)


def of_steps(name: str) -> Quantity:
    """One of OF_STEPS, of the whole frame."""
    made = OF_STEPS[name]

    def values(frame: FrameReport) -> list[float]:
        assert made.frame is not None
        whole = made.frame([getattr(step, name) for step in frame.steps])
        return list(whole.tolist()) if made.axes else [whole]

    unit = [made.unit] if made.unit else []
    return Quantity(["_".join([name, *axis, *unit]) for axis in made.axes or [""]], values)


def controlled_positions(model: SolidModel, controlled: Integers) -> dict[str, int]:
    """Column of the position of each controlled hinge and slide -> its place among the dofs."""
    places = {int(dof): n for n, dof in enumerate(controlled)}
    return {
        joint_column(POSITION[kind], name): places[dof]
        for name in _joints(model)
        if (kind := _kind(model, name)) in POSITION
        and (dof := int(model.dofs_of(name)[0])) in places
    }


def numbers_of(name: str, now: Snapshot) -> list[float]:
    """Every quantity of OF_BODIES of a body, in its order."""
    body = now.sensed.body(name)
    found: list[float] = np.concatenate([getattr(body, of) for of in OF_BODIES]).tolist()
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


def _components(model: SolidModel, joint: str) -> list[tuple[str, int]]:
    """Column and dof of each component of a joint's drive; none that a slab locks."""
    dofs, kind = model.dofs_of(joint), _kind(model, joint)
    if kind in POSITION:
        return [(joint_column("torque" if kind == HINGE else "force", joint), int(dofs[0]))]
    of = ["force", "torque"] if len(dofs) > 3 else ["torque"]
    columns = [joint_column(quantity, joint, axis) for quantity in of for axis in "xyz"]
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
