"""A prescribed joint is where its motion says, whatever pulls at it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from flowborne.coupling.step import step
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.grid import Grid
from flowborne.fluid.sides.kinds import BoundaryInflow, BoundaryOpen
from flowborne.kernels.arrays import Array, Integers
from flowborne.motion.tracks import Curve, TrajectoryKeyframes, TrajectorySinusoid
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.model import SolidModel
from flowborne.solids.trajectories import velocity_after

ARM = """
<mujoco><compiler angle="radian"/><worldbody>
  <geom type="plane" size="4 4 1" pos="0 -0.45 0" zaxis="0 1 0"/>
  <body name="upper"><joint name="shoulder" type="hinge" axis="0 0 1"/>
    <geom type="capsule" size="0.08 0.12" pos="0.2 0 0" zaxis="1 0 0" density="1300"/>
    <body name="lower" pos="0.4 0 0"><joint name="elbow" type="hinge" axis="0 0 1"/>
      <geom type="capsule" size="0.08 0.1" pos="0.15 0 0" zaxis="1 0 0" density="700"/>
      <body name="hand" pos="0.3 0 0"><joint name="wrist" type="hinge" axis="0 0 1"/>
        <geom type="sphere" size="0.09" pos="0.08 0 0" density="2000"/>
      </body>
    </body>
  </body>
</worldbody></mujoco>
"""
"""Shoulder and elbow are told what to do, the wrist is not; a floor lies below."""


@dataclass(frozen=True)
class Pulls:
    """A random wrench on every body, new in every step, as strong as the bodies' weight."""

    strength: float
    random: np.random.Generator = field(default_factory=lambda: np.random.default_rng(4))

    def wrench(self, model: SolidModel, pose: Kinematics, v: Array, time: float) -> Array:
        return self.strength * self.random.normal(size=(model.nbody, 6))


def channel() -> Boundaries:
    def profile(x: Array, y: Array, z: Array, time: float) -> tuple[Array, Array, Array]:
        return 1.5 + 0 * x, 0 * x, 0 * x

    return Boundaries(x_min=BoundaryInflow(profile), x_max=BoundaryOpen())


def arm(grid: Grid, *, viscosity: float = 0.0, pull: float = 300.0) -> World:
    model = SolidModel.from_string(ARM, slab=grid.is_slab, gravity=(0.0, -9.81, 0.0))
    frames = Curve((0.0, 0.2, 0.35, 0.6), (0.2, -0.9, -0.4, 0.8))
    motions = (
        TrajectorySinusoid(model.dofs_of("shoulder"), 0.5, 0.5, mean=-0.5),
        TrajectoryKeyframes(model.dofs_of("elbow"), frames),
    )
    fluid = Fluid(grid, 1000.0, viscosity, channel())
    world = World.at_rest(Setup(model, fluid, motions, (Pulls(pull),)))
    for motion in motions:
        world.solid.q[model.dof_position[motion.dofs]] = motion.position(0.0)
        world.solid.v[motion.dofs] = motion.velocity(0.0)
    world.flow()[1].velocity[0][:] = 1.5
    return world


SLAB = Grid.slab(40, 32, 1.6 / 32, (-0.7, -0.8))
CUBE = Grid((20, 16, 10), 0.1, (-0.7, -0.8, -0.5))


@pytest.mark.parametrize(
    ("grid", "viscosity"), [(SLAB, 0.0), (SLAB, 5.0), (CUBE, 0.0)], ids=["slab", "viscous", "cube"]
)
def test_a_prescribed_joint_reaches_its_target_whatever_pulls_at_it(
    grid: Grid, viscosity: float
) -> None:
    """Gravity, fluid, contact with a floor and a random wrench; 1e-8 rad and rad/s.

    Its velocity is that of half a part on, which is what takes it to where it is told to be after
    the next part.
    """
    world = arm(grid, viscosity=viscosity)
    model, touched = world.setup.solid, 0
    for _ in range(60):
        report = step(world, 0.01)
        assert report.outcome.name == "DONE"
        touched += report.contacts > 0
        for motion in world.setup.motions:
            found = world.solid.q[model.dof_position[motion.dofs]]
            assert np.abs(found - motion.position(world.time)).max() < 1e-8
            part = 0.01 / world.parts
            ahead = motion.position(world.time + part) - motion.position(world.time)
            assert np.abs(world.solid.v[motion.dofs] - ahead / part).max() < 1e-8
        assert np.abs(report.actuator[:2]).min() > 0.0
        assert report.actuator[2] == 0.0
        assert report.momentum_exchange_error < 1e-10
    assert touched > 5, "the arm never touched the floor"


def test_the_random_wrench_changes_the_drives_force_and_not_the_motion() -> None:
    forces = []
    for pull in (0.0, 300.0):
        world = arm(SLAB, pull=pull)
        reports = [step(world, 0.01) for _ in range(10)]
        forces.append(np.array([report.actuator[:2] for report in reports]))
    assert np.abs(forces[1] - forces[0]).min(axis=0).max() > 1.0


PUPPET = """
<mujoco><worldbody>
  <body name="torso"><freejoint name="root"/>
    <geom type="box" size="0.12 0.1 0.15" density="900"/>
    <body name="arm" pos="0.15 0 0"><joint name="shoulder" type="ball"/>
      <geom type="capsule" size="0.06 0.1" pos="0.15 0 0" zaxis="1 0 0" density="1100"/>
      <body name="hand" pos="0.3 0 0"><joint name="wrist" type="ball"/>
        <geom type="sphere" size="0.07" pos="0.06 0 0" density="1500"/>
      </body>
    </body>
  </body>
</worldbody></mujoco>
"""


@dataclass(frozen=True)
class Tumble:
    """A root that circles and turns about z, and a shoulder that swings about its own x."""

    dofs: Integers

    def position(self, time: float) -> Array:
        turn, swing = 0.5 * 2.0 * time, 0.5 * 0.6 * np.sin(5.0 * time)
        place = [0.1 * np.cos(3.0 * time), 0.1 * np.sin(3.0 * time), 0.05]
        root = [np.cos(turn), 0.0, 0.0, np.sin(turn)]
        return np.array([*place, *root, np.cos(swing), np.sin(swing), 0.0, 0.0])

    def velocity(self, time: float) -> Array:
        place = [-0.3 * np.sin(3.0 * time), 0.3 * np.cos(3.0 * time), 0.0]
        return np.array([*place, 0.0, 0.0, 2.0, 3.0 * np.cos(5.0 * time), 0.0, 0.0])


def test_free_and_ball_joints_follow_a_motion_too() -> None:
    model = SolidModel.from_string(PUPPET, gravity=(0.0, 0.0, -9.81))
    motion = Tumble(np.arange(9))
    grid = Grid((12, 12, 12), 0.125, (-0.75, -0.75, -0.75))
    setup = Setup(model, Fluid(grid, 1000.0, 0.0, Boundaries()), (motion,), (Pulls(2.0),))
    world = World.at_rest(setup)
    world.solid.q[:11], world.solid.v[:9] = motion.position(0.0), motion.velocity(0.0)
    for _ in range(30):
        report = step(world, 0.01)
        assert report.outcome.name == "DONE"
        assert np.abs(world.solid.q[:11] - motion.position(world.time)).max() < 1e-8
        ahead = velocity_after(model, world.solid.q, motion, world.time, 0.01)
        assert np.abs(world.solid.v[:9] - ahead).max() < 1e-8
    assert np.abs(report.actuator[:9]).min() > 0.0
    assert np.all(report.actuator[9:] == 0.0), "nothing drives the wrist"
    assert np.abs(world.solid.q[11:] - [1.0, 0.0, 0.0, 0.0]).max() > 0.01, "but it swings"
