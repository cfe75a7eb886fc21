"""Worlds whose objective is known in closed form: real joints, and a step that only moves them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flowborne.coupling.report import Asked, Outcome, StepReport
from flowborne.coupling.world import Setup, World
from flowborne.solids.model import SolidModel
from flowborne.solids.trajectories import JointCommand

ARM = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" type="hinge" axis="0 0 1" range="-1.2 1.2" limited="{limited}"/>
      <geom name="upper" type="box" size=".5 .1 .1" pos=".5 0 0"/>
      <body name="lower" pos="1 0 0">
        <joint name="elbow" type="hinge" axis="0 0 1"/>
        <geom name="lower" type="box" size=".5 .1 .1" pos=".5 0 0"/>
        <body name="hand" pos="1 0 0">
          <joint name="wrist" type="hinge" axis="0 0 1"/>
          <geom name="hand" type="box" size=".2 .1 .1" pos=".2 0 0"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
BALL = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="arm">
      <joint name="ball" type="ball" range="0 0.7" limited="{limited}"/>
      <geom type="box" size=".5 .1 .1" pos=".5 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""


def move_only(world: World, dt: float, command: JointCommand | None = None) -> StepReport:
    """A step in which driven dofs do as told and nothing else happens."""
    model, state = world.setup.solid, world.solid
    assert model is not None
    assert state is not None
    command = JointCommand.none(model.nv) if command is None else command
    state.q[:] = model.integrate(state.q, np.where(command.prescribed, command.rate, state.v), dt)
    state.v[:] = np.where(command.prescribed, command.final_velocity, state.v)
    world.time += dt
    world.steps += 1
    none = [np.zeros((model.nbody, 6))] * 6
    added = Asked(lambda: none[0])
    centre = np.zeros((model.nbody, 3))
    drives = [np.zeros(model.nv)] * 2
    return StepReport(dt, Outcome.DONE, world.solid.v, *drives, *none, added, centre)


@pytest.fixture
def step() -> Callable[[World, float, JointCommand | None], StepReport]:
    """The step in which driven dofs do as told and nothing else happens."""
    return move_only


@pytest.fixture
def make_world() -> Callable[..., World]:
    """Makes a world of an arm with three hinges, or of one with a ball joint, at rest."""

    def make(*, ball: bool = False, limited: bool = False, **setup: object) -> World:
        xml = (BALL if ball else ARM).format(limited=str(limited).lower())
        model = SolidModel.from_string(xml)
        return World(Setup(model, **setup), solid=model.rest())  # type: ignore[arg-type]

    return make
