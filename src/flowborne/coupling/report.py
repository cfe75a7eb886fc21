"""What a step says about itself."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from contextlib import ContextDecorator
from contextvars import ContextVar
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from operator import itemgetter
from time import perf_counter
from typing import Annotated, Any, NamedTuple, get_type_hints
from weakref import ref

import numpy as np

from flowborne.base.errors import BreakdownError, PartError, WorkerError
from flowborne.base.one_line import one_line
from flowborne.coupling.world import World
from flowborne.kernels.arrays import Array, Integers
from flowborne.solids.scratch import cross
from flowborne.solids.sensed import Sensed

BREAKDOWNS = ArithmeticError, np.linalg.LinAlgError, BreakdownError, PartError, WorkerError
"""Errors with which a step may end; their text says what happened."""

Rule = Callable[[Sequence[Any]], Any]
"""Makes one value of several ones in the order of time."""


class Outcome(Enum):
    """How a step ended, as a sentence."""

    DONE = "the step is done"
    PRESSURE_NOT_CONVERGED = "the pressure solve did not reach its tolerance"
    VISCOSITY_NOT_CONVERGED = "the viscous solve did not reach its tolerance"
    NOT_SETTLED = "contacts, torque limits or Coriolis forces did not settle"
    NOT_FINITE = "a velocity or a pressure is not a finite number"
    ADVECTION_NOT_FINITE = "a velocity of the fluid is not a finite number after advection"


last = itemgetter(-1)
mean = partial(np.mean, axis=0)
total = partial(np.sum, axis=0)


LATE = "forces are split when asked, which is too late now: ask before the next frame or step"


class Asked:
    """Wrenches (nbody, 6) that are made when they are first asked for.

    make  makes them; the world has it until its next step
    kept  whether it costs nothing and is kept here
    done  whether they have been asked for
    """

    def __init__(self, make: Callable[[], Array], kept: bool = False) -> None:
        self._make = (lambda: make) if kept else ref(make)
        self.done = False

    def __call__(self) -> Array:
        if not self.done:
            if (make := self._make()) is None:
                raise ValueError(LATE)
            self._value, self.done = make(), True
        return self._value


def in_turn(parts: Sequence[Asked]) -> Asked:
    return Asked(lambda: np.asarray(mean([part() for part in parts])), kept=True)


def union(values: Sequence[Integers]) -> Integers:
    return np.unique(np.concatenate(values))


class Joined(NamedTuple):
    """How a field of a report is made of several: that of a step of those of its parts, and that of
    a frame, which is a column of the history, of those of its steps.

    parts, frame  rules; None where there is no column
    unit          suffix of the column
    axes          suffixes of the three columns of a vector
    """

    parts: Rule
    frame: Rule | None = None
    unit: str = ""
    axes: str = ""


Mean = Annotated[Array, Joined(mean)]
Last = Annotated[Array, Joined(last)]
Momentum = Annotated[Array, Joined(last, last, "Ns", "xyz")]
Impulse = Annotated[Array, Joined(total, total, "Ns", "xyz")]
Worst = Annotated[float, Joined(max, max)]


no_momentum = partial(np.zeros, 3)


no_values = partial(np.zeros, 0)


def no_dofs() -> Integers:
    return np.zeros(0, np.int64)


@dataclass(frozen=True, eq=False)
class StepReport:
    """What `step` did.

    Momenta and impulses are linear, (3,), N s. Errors of their exchange and of the budget are
    relative to the impulses given to bodies and faces, added up in size. The history has columns
    of the same names, with a suffix for the unit, of all from `work` to `fastest`. In trials
    momenta, their errors, `divergence` and `fastest` are nan.

    dt               s
    velocity         (nv,) at the end of the step: v is that half a step before, then half a step
                     after it, and this is the mean of both
    acceleration     (nv,) change of v in the step by dt
    actuator         (nv,) generalised force of the drives (and of locked dofs), N or N m; where
                     there is none, that of the model's actuators
    pressure_wrench  (nbody, 6) force and torque about the world origin of the dynamic pressure
    viscous_wrench   (nbody, 6) the same of the shear stress
    buoyancy_wrench  (nbody, 6) the same of the hydrostatic pressure (Archimedes)
    wind_wrench      (nbody, 6) the same of the simple winds
    applied_wrench   (nbody, 6) the same of forces from outside and of thrusters, apart from these
    jet_wrench       (nbody, 6) the same of the reaction of what mouths expel
    thrust           (nt,) of thrusters, N
    jet_power        (nt,) that they give to the fluid and their bodies, W
    disc_water       (nt,) part of their discs that is water
    added_mass       of which `added_mass_wrench` is made
    centre           (nbody, 3) centres of mass at the end of the step, m; 0 where no fluid, wind or
                     force acts
    work             of the drives and of the model's actuators, J
    momentum_solid   of the bodies half a step on, which keeps what it is given exactly
                     (see solids.momentum.halfway_momentum)
    momentum_fluid   of the fluid (density x control volume of each face)
    momentum_exchanged
                     impulse that the pressure solve gave to the bodies
    momentum_advection
                     change of the fluid's momentum in advection that no boundary accounts for: none
                     in flux form
    momentum_boundary
                     impulse of the sides of the domain on the fluid: their pressure, and what they
                     stop of the flow that reaches them
    momentum_crossed carried in by the flow itself through the sides
    momentum_forces  given to the fluid by body forces, thrusters, driven regions and friction at
                     walls and bodies
    momentum_jet     brought into the fluid by mouths and sources
    expelled         volume that mouths expelled, less what they took in, m^3
    momentum_exchange_error
                     |impulse given to the bodies + impulse taken from the fluid and the walls|
    momentum_budget_error
                     |change of the fluid's momentum in the step less all of these|
    divergence       largest |net volume flux of a cell| / cell volume after the solve, 1/s
    dye_budget_error |change of the amount of a dye less what was brought| relative to it, the
                     largest of all dyes
    solver_iterations
                     of the pressure solves
    residual         true relative residual of the last of them
    sweeps           of viscosity and pressure: more than 1 where the flow creeps (see
                     `coupling.creeping`)
    sweep_error      by how much they were apart after the last one, relative to the pressure
    contacts         number of active contacts
    fastest          largest speed of the fluid across an open face after the solve, m/s
    seconds          where the time went: advection, viscosity, projection, geometry, solids
    output           (n,) force of each output of the model's actuators, N or N m
    output_power     (n,) force times the rate of the actuator's length, W
    limited          (k,) dofs whose torque limit was reached
    unsettled        (k,) dofs whose contacts, joint limits or drives still changed when the step
                     gave up; none when Coriolis forces alone did
    """

    __repr__ = one_line

    dt: Annotated[float, Joined(sum)]
    outcome: Annotated[Outcome, Joined(last)]
    velocity: Last
    acceleration: Last
    actuator: Mean
    pressure_wrench: Mean
    viscous_wrench: Mean
    buoyancy_wrench: Mean
    wind_wrench: Mean
    applied_wrench: Mean
    jet_wrench: Mean
    added_mass: Annotated[Asked, Joined(in_turn)]
    centre: Mean
    thrust: Mean = field(default_factory=no_values)
    jet_power: Mean = field(default_factory=no_values)
    disc_water: Mean = field(default_factory=no_values)
    work: Annotated[float, Joined(sum, sum, "J")] = 0.0
    momentum_solid: Momentum = field(default_factory=no_momentum)
    momentum_fluid: Momentum = field(default_factory=no_momentum)
    momentum_exchanged: Impulse = field(default_factory=no_momentum)
    momentum_advection: Impulse = field(default_factory=no_momentum)
    momentum_boundary: Impulse = field(default_factory=no_momentum)
    momentum_crossed: Impulse = field(default_factory=no_momentum)
    momentum_forces: Impulse = field(default_factory=no_momentum)
    momentum_jet: Impulse = field(default_factory=no_momentum)
    expelled: Annotated[float, Joined(sum, sum, "m3")] = 0.0
    momentum_exchange_error: Worst = 0.0
    momentum_budget_error: Worst = 0.0
    divergence: Annotated[float, Joined(max, max, "1/s")] = 0.0
    dye_budget_error: Worst = 0.0
    solver_iterations: Annotated[int, Joined(sum, max)] = 0
    residual: Annotated[float, Joined(last, max)] = 0.0
    sweeps: Annotated[int, Joined(max, max)] = 0
    sweep_error: Worst = 0.0
    contacts: Annotated[int, Joined(last, max)] = 0
    fastest: Annotated[float, Joined(max, max, "m/s")] = 0.0
    seconds: Annotated[dict[str, float], Joined(last)] = field(default_factory=dict)
    output: Mean = field(default_factory=no_values)
    output_power: Mean = field(default_factory=no_values)
    limited: Annotated[Integers, Joined(union)] = field(default_factory=no_dofs)
    unsettled: Annotated[Integers, Joined(last)] = field(default_factory=no_dofs)

    @property
    def added_mass_wrench(self) -> Array:
        """(nbody, 6) part of `pressure_wrench` with which the fluid resists the change of the
        bodies' velocities (see `solve.added_mass_impulse`); nan in trials. It is solved for at the
        first call. Raises ValueError after the next step."""
        return self.added_mass()

    def fluid_wrench(self) -> Array:
        """(nbody, 6) everything that the fluid and the winds do to each body."""
        stresses = self.pressure_wrench + self.viscous_wrench + self.buoyancy_wrench
        return stresses + self.jet_wrench + self.wind_wrench

    def central_wrench(self) -> Array:
        """(nbody, 6) `fluid_wrench` about each body's centre of mass."""
        return about(self.fluid_wrench(), self.centre)

    def central_applied(self) -> Array:
        """(nbody, 6) `applied_wrench` about each body's centre of mass."""
        return about(self.applied_wrench, self.centre)

    def central_added_mass(self) -> Array:
        """(nbody, 6) `added_mass_wrench` about each body's centre of mass."""
        return about(self.added_mass_wrench, self.centre)

    def sensed(self, world: World) -> Sensed:
        """What can be sensed of the bodies and joints of `world` after the step."""
        state = self.velocity, self.acceleration, self.dt, self.actuator
        wrenches = self.central_wrench(), self.central_added_mass
        return Sensed(world.setup.solid, world.solid.q, *state, *wrenches, self.output)


def about(wrench: Array, points: Array) -> Array:
    """(n, 6) wrenches about the world origin as wrenches about points (n, 3)."""
    force, torque = wrench[:, :3], wrench[:, 3:]
    return np.concatenate([force, torque - cross(points, force)], axis=1)


def joined(reports: Sequence[StepReport]) -> StepReport:
    """The report of a step from those of its parts: means of forces, sums of what was exchanged,
    and the state at the end."""
    if len(reports) == 1:
        return reports[0]
    values = {name: [getattr(report, name) for report in reports] for name in FIELDS}
    return StepReport(**{name: made.parts(values[name]) for name, made in FIELDS.items()})


FIELDS: dict[str, Joined] = {
    name: hint.__metadata__[0]
    for name, hint in get_type_hints(StepReport, include_extras=True).items()
}
"""How each field of a step's report is joined."""

_timing: ContextVar[tuple[dict[str, float], str] | None] = ContextVar("timing", default=None)


class Timer(ContextDecorator):
    """Seconds by part of a step, complete at the end of the block.

    Those of the block, or of the calls of a function that this decorates, count for `part`; those
    of a timed block or function inside it for its own part alone.
    """

    def __init__(self, part: str) -> None:
        self._part = part

    def _recreate_cm(self) -> Timer:
        return Timer(self._part)

    def __enter__(self) -> dict[str, float]:
        self._around = around = _timing.get()
        self._seconds = defaultdict[str, float](float) if around is None else around[0]
        self._token = _timing.set((self._seconds, self._part))
        self._started = perf_counter()
        return self._seconds

    def __exit__(self, *_: object) -> None:
        _timing.reset(self._token)
        spent = perf_counter() - self._started
        self._seconds[self._part] += spent
        if self._around is not None:
            self._seconds[self._around[1]] -= spent


timed = Timer
"""As one says it, around a block or a function."""
