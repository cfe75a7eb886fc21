"""One hypothetical evaluation: copy the world, move the controlled joints, step, measure.

Paper: sections 2.1 and 2.2 (positional change), 2.3 and 3.2 (velocities when the objective is
measured), 3.3 and 5 (outboard joints are rigid), 3.3 and 4.3 (steady state).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from flowborne.control import creature
from flowborne.control.course import Course
from flowborne.control.measurement import Measurement
from flowborne.control.objectives import ObjectiveSum
from flowborne.coupling.bodies_step import advance_prescribed
from flowborne.kernels.arrays import Array, Integers
from flowborne.solids.trajectories import JointCommand

if TYPE_CHECKING:
    from flowborne.coupling.world import World

Velocities = Literal["removed", "present", "probe"]


@dataclass(frozen=True)
class Hypothesis:
    """How a pose is tried.

    dt          s, length of a hypothetical step
    steps       number of steps over which the displacement is spread
    settle      number of steps in the new pose after that, for the flow to adapt. They also keep
                the displacement's effect on the inertia of a turning creature out of the drives'
                force: use one for the effort of a floating creature
    velocities  of the controlled dofs in the last step, in which the objective is measured:
                "removed"  zero: relative velocities are removed first, at constant momentum, so
                           that the flow depends on the pose and not on the motion into it (steady
                           state, sections 3.3 and 4.3)
                "present"  as now: the drives' force maintains them (effort, eq. 1). In the last
                           steps, at least one, the dofs keep moving with them; they start so far
                           back that they end in the pose tried
                "probe"    of the displacement itself, from the start and over all steps; the other
                           controlled dofs have zero velocity (section 3.2; in a fluid the
                           pseudo-velocity of section 4.3). In a fluid the first step contains the
                           impulse that starts the flow: use two steps or settle
    raises      ValueError when dt is not positive, steps < 1, settle < 0 or velocities is unknown
    """

    dt: float
    steps: int = 1
    settle: int = 0
    velocities: Velocities = "removed"

    def __post_init__(self) -> None:
        if not 0.0 < self.dt < np.inf:
            raise ValueError(f"hypothetical step is {self.dt} s: give a positive number of seconds")
        if self.steps < 1 or self.settle < 0:
            raise ValueError(
                f"hypothetical steps are {self.steps} with {self.settle} to settle: "
                "give at least 1 and at least 0"
            )
        if self.velocities not in ("removed", "present", "probe"):
            raise ValueError(
                f"velocities is {self.velocities!r}: give 'removed', 'present' or 'probe'"
            )

    @property
    def last_steps(self) -> int:
        """Number of steps after those of the displacement."""
        return max(self.settle, 1) if self.velocities == "present" else self.settle

    @property
    def duration(self) -> float:
        """Time over which the displacement is spread, s."""
        return self.steps * self.dt


@dataclass(frozen=True, eq=False)
class PoseCourse(Course):
    """Going straight to a pose, as in the paper.

    hypothesis  how a pose is tried
    dofs        (n,) the controlled dofs
    pose        (nq,) from which displacements start, in the flow of `world`
    """

    hypothesis: Hypothesis
    dofs: Integers
    pose: Array

    @property
    def count(self) -> int:
        """n."""
        return int(self.dofs.size)

    @property
    def goal(self) -> Array:
        """(nq,) the pose."""
        return self.pose

    @cached_property
    def rigid(self) -> Integers:
        """(k,) dofs outboard of the controlled ones."""
        return creature.outboard(self.world, self.dofs)

    def within_range(self, displacement: Array) -> Array:
        """(n,) the part of a displacement that the joints' ranges allow."""
        model = self.world.setup.solid
        return creature.within_range(model, self.pose, self._full(displacement))[self.dofs]

    def displaced(self, displacement: Array) -> PoseCourse:
        pose = creature.moved(self.world.setup.solid, self.pose, self._full(displacement))
        return replace(self, pose=pose)

    def evaluate(self, objective: ObjectiveSum, displacement: Array) -> float:
        """Objective after the hypothetical steps. Raises TrialError when it is not finite."""
        hypothesis, dofs = self.hypothesis, self.dofs
        world = self.world.for_step()
        world.setup = world.setup.hypothetical
        world.solid.q[:] = self.pose
        command = self._prepare(world, displacement)
        whole = hypothesis.steps + hypothesis.last_steps
        for number in range(1, whole + 1):
            if number == hypothesis.steps + 1:
                command.rate[dofs] = self._last_rate(command)
            # only the last step is measured; before it, prescribed motion needs no solve
            if number == whole or not advance_prescribed(world, hypothesis.dt, command):
                report = self.advance(world, hypothesis.dt, command, displacement)
        value = objective.value(Measurement(world, report, self.world.time))
        if not np.isfinite(value):
            raise self.error(displacement, hypothesis.dt, f"the objective is {value}")
        return value

    def tried(self, displacement: Array) -> str:
        names = self.world.setup.solid.dof_names
        tried = ", ".join(
            f"{names[dof]} by {by:.4g}" for dof, by in zip(self.dofs, displacement, strict=True)
        )
        return f"moves {tried} at time {self.world.time:.6g} s"

    def _prepare(self, world: World, displacement: Array) -> JointCommand:
        """Make outboard joints rigid; returns the command that moves the controlled dofs.

        Every trial makes all dofs outboard of any controlled one rigid, so that trials differ only
        in the displacement.
        """
        hypothesis, rigid, v = self.hypothesis, self.rigid, world.solid.v
        own = ~np.isin(self.dofs, world.told.dofs())
        dofs = self.dofs[own]
        rate = displacement[own] / hypothesis.duration
        if hypothesis.velocities == "present":
            final = v[dofs].copy()
            creature.give_velocity(world, rigid, np.zeros(rigid.size), dofs)
        else:
            final = rate if hypothesis.velocities == "probe" else np.zeros_like(rate)
            held = np.concatenate([dofs, rigid])
            velocity = np.concatenate([final, np.zeros(rigid.size)])
            creature.give_velocity(world, held, velocity, np.zeros(0, np.int64))
        command = JointCommand.none(v.size)
        command.set(rigid, 0.0, 0.0)
        command.set(dofs, rate, final)
        ahead = hypothesis.last_steps * hypothesis.dt * self._last_rate(command)
        command.rate[self.dofs] -= ahead / hypothesis.duration
        return command

    def _last_rate(self, command: JointCommand) -> Array:
        """(n,) velocity of the controlled dofs' positions in the last steps."""
        final = command.final_velocity[self.dofs]
        return final if self.hypothesis.velocities == "present" else np.zeros_like(final)

    def _full(self, displacement: Array) -> Array:
        """(nv,) a displacement (n,) of the controlled dofs among all."""
        full = np.zeros(self.world.setup.solid.nv)
        full[self.dofs] = displacement
        return full


def without_scalars(world: World) -> World:
    """The same world, its arrays shared, without dye and smoke: these exert no force, so trials do
    not advect them, and objectives cannot read them."""
    if world.fluid is None:
        return world
    return replace(world, fluid=replace(world.fluid, scalars={}))
