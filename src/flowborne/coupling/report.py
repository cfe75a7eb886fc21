"""What a step says about itself."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from time import perf_counter

import numpy as np

from flowborne.base.errors import BreakdownError, PartError, WorkerError
from flowborne.kernels.arrays import Array, Integers

BREAKDOWNS = ArithmeticError, np.linalg.LinAlgError, BreakdownError, PartError, WorkerError
"""Errors with which a step may end; their text says what happened."""


class Outcome(Enum):
    """How a step ended, as a sentence."""

    DONE = "the step is done"
    PRESSURE_NOT_CONVERGED = "the pressure solve did not reach its tolerance"
    VISCOSITY_NOT_CONVERGED = "the viscous solve did not reach its tolerance"
    NOT_SETTLED = "contacts, torque limits or Coriolis forces did not settle"
    NOT_FINITE = "a velocity or a pressure is not a finite number"
    ADVECTION_NOT_FINITE = "a velocity of the fluid is not a finite number after advection"


@dataclass
class Momentum:
    """Linear momentum budget of a step, N s, each (3,); angular parts are about the origin.

    solid            momentum of the bodies half a step on, which keeps what it is given exactly
                     (see solids.momentum.halfway_momentum)
    fluid            momentum of the fluid (density x control volume of each face)
    exchanged        impulse that the pressure solve gave to the bodies
    exchange_error   |impulse given to the bodies + impulse taken from the fluid and the walls|
                     relative to the impulses given to bodies and faces, added up in size
    advection        change of the fluid's momentum in advection that no boundary accounts for: none
                     in flux form
    boundary         impulse of the sides of the domain on the fluid: their pressure, and what they
                     stop of the flow that reaches them
    crossed          momentum that the flow itself carried in through the sides
    jet              momentum that came into the fluid through mouths and sources
    forces           what body forces, driven regions and friction at walls and bodies gave to it
    budget_error     |change of the fluid's momentum in the step less all of these| relative to the
                     impulses given to bodies and faces
    """

    solid: Array = field(default_factory=lambda: np.zeros(3))
    fluid: Array = field(default_factory=lambda: np.zeros(3))
    exchanged: Array = field(default_factory=lambda: np.zeros(3))
    exchange_error: float = 0.0
    advection: Array = field(default_factory=lambda: np.zeros(3))
    boundary: Array = field(default_factory=lambda: np.zeros(3))
    crossed: Array = field(default_factory=lambda: np.zeros(3))
    jet: Array = field(default_factory=lambda: np.zeros(3))
    forces: Array = field(default_factory=lambda: np.zeros(3))
    budget_error: float = 0.0


@dataclass
class StepReport:
    """What `step` did.

    dt               s
    velocity         (nv,) at the end of the step: v is that half a step before, then half a step
                     after it, and this is the mean of both
    acceleration     (nv,) change of v in the step by dt
    actuator         (nv,) generalised force of the drives (and of locked dofs), N or N m
    pressure_wrench  (nbody, 6) force and torque about the world origin of the dynamic pressure
    viscous_wrench   (nbody, 6) the same of the shear stress
    buoyancy_wrench  (nbody, 6) the same of the hydrostatic pressure (Archimedes)
    wind_wrench      (nbody, 6) the same of the simple winds
    jet_wrench       (nbody, 6) the same of the reaction of what mouths expel
    added_mass_wrench
                     (nbody, 6) part of `pressure_wrench` with which the fluid resists the change of
                     the bodies' velocities (see `solve.added_mass_impulse`); nan where the setup
                     does not split forces, as in trials
    centre           (nbody, 3) centres of mass at the end of the step, m; 0 where neither a fluid
                     nor a wind acts
    iterations       of the pressure solves
    residual         true relative residual of the last of them
    divergence       largest |net volume flux of a cell| / cell volume after the solve, 1/s
    fastest          largest speed of the fluid across an open face after the solve, m/s
    momentum         the budget
    work             of the drives, J
    expelled         volume that mouths expelled, less what they took in, m^3
    dye_error        |change of the amount of a dye less what was brought| relative to it, the
                     largest of all dyes
    seconds          where the time went: advection, viscosity, projection, geometry, solids
    contacts         number of active contacts
    limited          (k,) dofs whose torque limit was reached
    unsettled        (k,) dofs whose contacts, joint limits or drives still changed when the step
                     gave up; none when Coriolis forces alone did
    """

    dt: float
    outcome: Outcome
    velocity: Array
    acceleration: Array
    actuator: Array
    pressure_wrench: Array
    viscous_wrench: Array
    buoyancy_wrench: Array
    wind_wrench: Array
    jet_wrench: Array
    added_mass_wrench: Array
    centre: Array
    iterations: int = 0
    residual: float = 0.0
    divergence: float = 0.0
    fastest: float = 0.0
    momentum: Momentum = field(default_factory=Momentum)
    work: float = 0.0
    expelled: float = 0.0
    dye_error: float = 0.0
    seconds: dict[str, float] = field(default_factory=dict)
    contacts: int = 0
    limited: Integers = field(default_factory=lambda: np.zeros(0, np.int64))
    unsettled: Integers = field(default_factory=lambda: np.zeros(0, np.int64))

    def fluid_wrench(self) -> Array:
        """(nbody, 6) everything that the fluid and the winds do to each body."""
        stresses = self.pressure_wrench + self.viscous_wrench + self.buoyancy_wrench
        return stresses + self.jet_wrench + self.wind_wrench

    def central_wrench(self) -> Array:
        """(nbody, 6) `fluid_wrench` about each body's centre of mass."""
        return about(self.fluid_wrench(), self.centre)

    def central_added_mass(self) -> Array:
        """(nbody, 6) `added_mass_wrench` about each body's centre of mass."""
        return about(self.added_mass_wrench, self.centre)


def about(wrench: Array, points: Array) -> Array:
    """(n, 6) wrenches about the world origin as wrenches about points (n, 3)."""
    force, torque = wrench[:, :3], wrench[:, 3:]
    return np.concatenate([force, torque - np.cross(points, force)], axis=1)


class Timer:
    """Seconds by part of a step."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = perf_counter()

    def lap(self, part: str) -> None:
        """Book the time since the last lap to `part`."""
        now = perf_counter()
        self.seconds[part] = self.seconds.get(part, 0.0) + now - self._last
        self._last = now
