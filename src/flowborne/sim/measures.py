"""Columns of the history, and their values after each frame."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.control.objectives import name_of
from flowborne.coupling.report import StepReport
from flowborne.coupling.world import Setup, World
from flowborne.kernels.arrays import Array
from flowborne.runs.frame_report import FrameReport
from flowborne.sim.body_measures import BodyMeasures
from flowborne.sim.joint_measures import JointMeasures
from flowborne.solids.dynamics import kinematics
from flowborne.solids.geoms import quaternion_of

if TYPE_CHECKING:
    from flowborne.control.controller import Controller

IMPULSES = ("exchanged", "advection", "boundary", "crossed", "forces")
"""Parts of the budget that are impulses of a whole frame."""

LISTED = 3
"""Most columns that a message names."""


class Measures:
    """Columns of a scene's history and their values.

    Columns carry their unit at the end of their name. Positions and velocities hold at the frame's
    end. Forces and torques are means over the frame: the impulse of all its steps over its time;
    with one step a frame they hold at its end too, with n steps (n - 1) / 2 steps earlier.
    Convergence is that of the worst step.

      frame, time_s
      angle_<joint>_rad … power_<joint>_W       joints and their drives; see `joint_measures`
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
      <body>_centre_x_m … _torque_z_Nm          of bodies named in the scene's output; see
                                                `body_measures`
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

    columns     names, in the order in which they are written
    controlled  those of the positions of the controlled joints
    """

    def __init__(
        self,
        setup: Setup,
        controller: Controller | None,
        stream: tuple[float, ...] | None,
        bodies: tuple[str, ...] = (),
        joints: bool | tuple[str, ...] = True,
        told: tuple[str, ...] = (),
    ) -> None:
        self._model = setup.solid
        self._controller = controller
        self._blows = bool(setup.mouths)
        window = None if setup.fluid is None else setup.fluid.window
        self._window = () if window is None else window.axes
        self._dyed = setup.fluid is not None and bool(setup.fluid.scalars)
        self._along, self._across = _axes(stream)
        self._named = BodyMeasures(setup.solid, bodies)
        dofs = np.zeros(0, np.int64) if controller is None else controller.dofs
        self._joints = JointMeasures(setup, dofs, joints, told)
        self.controlled = list(self._joints.places)
        self._terms = [] if controller is None else _terms(controller)
        self.columns = self._columns()
        _check_distinct(self.columns)

    def values(self, world: World, frame: int, report: FrameReport | None) -> dict[str, float]:
        """column -> number, in the order of `columns`; without a report nan for what needs a
        step."""
        values: dict[str, float] = dict.fromkeys(self.columns, np.nan)
        values |= {"frame": frame, "time_s": world.time}
        values |= self._joints.values(world.solid.q, world.time, report)
        values |= self._poses(world.solid.q) | self._flesh(world.solid.q)
        values |= self._named.values(world.solid.q, report)
        for axis in self._window:
            values[f"window_{'xyz'[axis]}_m"] = world.flow()[0].grid.origin[axis]
        if report is not None:
            values |= self._of_frame(report)
        return values

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
        return {column: float(steps[n]) for column, n in self._joints.places.items()}

    def _columns(self) -> tuple[str, ...]:
        names = ["frame", "time_s", *self._joints.columns]
        names += ["objective", *(f"measured_{term}" for term in self._terms)]
        names += ["drag_N", "lift_N", "added_mass_drag_N", "added_mass_lift_N", "effort", "work_J"]
        if self._model.flesh is not None:
            names += ["flesh_least_detF", "flesh_inside_out"]
        for body in self._model.body_names[1:]:
            names += [f"{body}_{axis}_m" for axis in "xyz"] + [f"{body}_q{axis}" for axis in "wxyz"]
        names += self._named.columns
        names += [f"window_{'xyz'[axis]}_m" for axis in self._window]
        for part in ("solid", "fluid", *IMPULSES, *(["jet"] if self._blows else [])):
            names += [f"momentum_{part}_{axis}_Ns" for axis in "xyz"]
        names += ["expelled_m3"] if self._blows else []
        names += ["momentum_exchange_error", "momentum_budget_error", "divergence_1/s"]
        names += ["dye_budget_error"] if self._dyed else []
        return (*names, "solver_iterations", "residual", "contacts", "fastest_m/s")

    def _of_frame(self, report: FrameReport) -> dict[str, float]:
        steps, last = report.steps, report.step
        values: dict[str, float] = {"objective": report.objective}
        values |= {f"measured_{term}": report.terms[term] for term in self._terms}
        added = report.central_added_mass()[1:, :3].sum(axis=0)
        for kind, force in (("", report.drag()[1:].sum(axis=0)), ("added_mass_", added)):
            values[f"{kind}drag_N"] = float(force @ self._along)
            values[f"{kind}lift_N"] = float(force @ self._across)
        values |= {"effort": self._effort(last), "work_J": sum(step.work for step in steps)}
        impulses = {"solid": last.momentum.solid, "fluid": last.momentum.fluid}
        for part in IMPULSES:
            impulses[part] = np.sum([getattr(step.momentum, part) for step in steps], axis=0)
        if self._blows:
            impulses["jet"] = np.sum([step.momentum.jet for step in steps], axis=0)
            values["expelled_m3"] = sum(step.expelled for step in steps)
        for part, impulse in impulses.items():
            for axis, component in zip("xyz", np.asarray(impulse), strict=True):
                values[f"momentum_{part}_{axis}_Ns"] = float(component)
        for error in ("exchange_error", "budget_error"):
            values[f"momentum_{error}"] = max(getattr(step.momentum, error) for step in steps)
        if self._dyed:
            values["dye_budget_error"] = max(step.dye_error for step in steps)
        values["divergence_1/s"] = max(step.divergence for step in steps)
        values["solver_iterations"] = max(step.iterations for step in steps)
        values["residual"] = max(step.residual for step in steps)
        values["contacts"] = max(step.contacts for step in steps)
        values["fastest_m/s"] = max(step.fastest for step in steps)
        return values

    def _effort(self, last: StepReport) -> float:
        if self._controller is None:
            return 0.0
        return float(np.linalg.norm(last.actuator[self._controller.dofs]) * last.dt)

    def _flesh(self, q: Array) -> dict[str, float]:
        flesh = self._model.flesh
        if flesh is None:
            return {}
        ratios = flesh.volume_ratios(q)
        return {
            "flesh_least_detF": float(ratios.min()),
            "flesh_inside_out": float((ratios <= 0.0).sum()),
        }

    def _poses(self, q: Array) -> dict[str, float]:
        poses = kinematics(self._model, q)
        values = {}
        for body, name in list(enumerate(self._model.body_names))[1:]:
            for axis, x in zip("xyz", poses.body_position[body], strict=True):
                values[f"{name}_{axis}_m"] = float(x)
            for axis, x in zip("wxyz", quaternion_of(poses.body_rotation[body]), strict=True):
                values[f"{name}_q{axis}"] = float(x)
        return values


def _check_distinct(columns: Sequence[str]) -> None:
    """Raise SceneError where two joints or bodies would have the same column."""
    twice = [column for column, count in Counter(columns).items() if count > 1]
    if twice:
        raise SceneError(
            f"the history would have two columns '{twice[0]}', because the name of one joint or "
            "body is that of another with '_x' or a quantity behind it. Rename one in the model."
        )


def _terms(controller: Controller) -> list[str]:
    """Names of the terms of the objective, each once."""
    return list(dict.fromkeys(name_of(term.objective) for term in controller.objective.terms))


def _axes(stream: tuple[float, ...] | None) -> tuple[Array, Array]:
    """Unit vectors along the stream (x without one) and across it, z x along (x when along z)."""
    if stream is None:
        return np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    along = np.asarray(stream, float) / np.linalg.norm(stream)
    across = np.cross([0.0, 0.0, 1.0], along)
    if np.linalg.norm(across) < 1e-9:
        return along, np.array([1.0, 0.0, 0.0])
    return along, across / np.linalg.norm(across)
