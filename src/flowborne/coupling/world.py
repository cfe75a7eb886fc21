"""The world: the whole state, and what stays constant during a run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from flowborne.base.arguments import (
    NOT_NEGATIVE,
    PART,
    POSITIVE,
    TEXT,
    VECTOR,
    check,
    one_of,
    or_none,
    several,
    such,
    takes,
)
from flowborne.base.one_line import one_line
from flowborne.coupling.band import Band, Projection
from flowborne.coupling.fractions import Geometry
from flowborne.coupling.mouths import Mouth
from flowborne.coupling.shapes import Shapes, shapes
from flowborne.coupling.thrusters import Thruster
from flowborne.fluid.boundary import Boundaries, Source
from flowborne.fluid.control_volumes import ControlVolumes
from flowborne.fluid.grid import Grid
from flowborne.fluid.projection import PressureGradient
from flowborne.fluid.state import FluidState, under
from flowborne.fluid.wake import wake_shape
from flowborne.fluid.window import Window, crosses
from flowborne.kernels.arrays import Array
from flowborne.solids.dynamics import Kinematics
from flowborne.solids.force import Force
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.motors import Motors
from flowborne.solids.prescribed import PrescribedSystem
from flowborne.solids.trajectories import NOTHING_TOLD, Told, Trajectory
from flowborne.solids.wind import Wind
from flowborne.solvers.pressure import PressureSystem

TRIAL_TOLERANCE = 1e-5
"""Relative residual of the pressure in a hypothetical step: gradients are right to 1e-3."""


@dataclass(frozen=True)
class Fluid:
    """The fluid's fixed properties.

    grid          where the fluid is
    density       rho, kg/m^3 (any slab world is per unit depth)
    viscosity     dynamic viscosity mu, Pa s; 0 is inviscid, and bodies are then free slip
    boundaries    the six sides
    sources       interior sources
    scalars       names of the carried scalars
    body_force    (3,) uniform force per mass on the fluid, m/s^2, besides gravity
    tolerance     relative residual of the pressure solve
    one_way       whether the bodies do not act on the fluid, which acts on them as a wind alone
    window        how the grid follows bodies; None if it stays where it is
    raises        ValueError when the grid is to move across sides beyond which there is no fluid,
                  SceneError for a property of another kind
    """

    __repr__ = one_line

    grid: Grid
    density: float
    viscosity: float = 0.0
    boundaries: Boundaries = field(default_factory=Boundaries)
    sources: tuple[Source, ...] = ()
    scalars: tuple[str, ...] = ()
    body_force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tolerance: float = 1e-9
    one_way: bool = False
    window: Window | None = None

    def __post_init__(self) -> None:
        check(
            self,
            grid=one_of(Grid, wanted="a Grid"),
            density=POSITIVE,
            viscosity=NOT_NEGATIVE,
            boundaries=one_of(Boundaries, wanted="Boundaries"),
            sources=several(one_of(Source), "sources"),
            scalars=several(TEXT, "names of dyes"),
            body_force=VECTOR,
            tolerance=PART,
        )
        for axis in () if self.window is None else self.window.axes:
            for side in self.boundaries.pair(axis):
                if not crosses(side):
                    raise ValueError(
                        f"the grid cannot move along {'xyz'[axis]}, as a side there is {side.kind}"
                    )


@dataclass(frozen=True, eq=False)
class Setup:
    """The constant part of a world, shared by all its copies.

    solid    the articulated bodies; a world without any has `SolidModel.empty()`
    fluid    the fluid, or None (simple wind and gravity only)
    motions  prescribed motions of some dofs
    winds    simple winds (paper eq. 2, or a uniform force)
    forces   on single bodies, from outside
    mouths   patches of skin through which fluid is expelled; needs a fluid that is not one-way
    thrusters
             discs that push a body and the fluid apart; likewise
    trial    whether steps are hypothetical, and may be longer than those of the world itself
    balances whether steps report momenta, divergence, the fastest flow and the added-mass part of
             forces; else they are nan, as in trials
    splits   whether the added-mass part of the fluid's force, which costs a solve, is split off in
             each step; else when its report is asked for it, and the matrix is then made again
    basis    a setup of the same bodies on the same grid, whose shapes are those of this one
    raises   SceneError for parts of another kind
    """

    __repr__ = one_line

    solid: SolidModel
    fluid: Fluid | None = None
    motions: tuple[Trajectory, ...] = ()
    winds: tuple[Wind, ...] = ()
    forces: tuple[Force, ...] = ()
    mouths: tuple[Mouth, ...] = ()
    thrusters: tuple[Thruster, ...] = ()
    trial: bool = False
    balances: bool = True
    splits: bool = False
    basis: Setup | None = None

    def __post_init__(self) -> None:
        check(
            self,
            solid=one_of(SolidModel, wanted="a SolidModel"),
            fluid=or_none(one_of(Fluid, wanted="a Fluid")),
            motions=several(such(lambda each: hasattr(each, "dofs")), "motions"),
            winds=several(such(lambda each: hasattr(each, "wrench")), "winds"),
            forces=several(such(lambda each: hasattr(each, "wrench")), "forces"),
            mouths=several(one_of(Mouth), "mouths"),
            thrusters=several(one_of(Thruster), "thrusters"),
        )

    @property
    def hypothetical(self) -> Setup:
        """The same for hypothetical steps: their pressure is solved as far as a gradient needs."""
        fluid = self.fluid
        if fluid is not None:
            fluid = replace(fluid, tolerance=max(fluid.tolerance, TRIAL_TOLERANCE))
        return self.but(fluid=fluid, trial=True, balances=False, splits=False)

    @property
    def rehearsed(self) -> Setup:
        """The same for hypothetical steps that go on as those of the world itself do."""
        return self.hypothetical.but(trial=False)

    def but(self, **parts: Any) -> Setup:
        """The same with other `parts`, but the same bodies on the same grid: sampled once."""
        return replace(self, basis=self.basis or self, **parts)

    def on(self, grid: Grid) -> Setup:
        """The same on a grid that has moved."""
        assert self.fluid is not None
        return self if grid == self.fluid.grid else self.but(fluid=replace(self.fluid, grid=grid))

    def where(self, other: Setup) -> Setup:
        """The same on the grid of another."""
        return self if other.fluid is None else self.on(other.fluid.grid)

    @cached_property
    def shapes(self) -> Shapes:
        """The bodies' geometries sampled on the fluid's grid: none if the fluid is one-way."""
        if self.basis is not None:
            return self.basis.shapes
        assert self.fluid is not None
        solid = SolidModel.empty() if self.fluid.one_way else self.solid
        return shapes(solid, self.fluid.grid)


@dataclass
class World:
    """The whole state. Copies are cheap and share only `setup`.

    solid   positions and velocities of the bodies
    fluid   None when the setup has no fluid
    time    s
    steps   number of steps taken
    ahead   s by which v is ahead of the positions: half of the last part of a step of its own
    parts   most parts that a step of the world itself has been divided into, see `bodies_step`
    memory  the controller's own arrays, by name
    told    what joints, bodies and thrusters are told from outside in this frame: not part of the
            state
    cut     the positions (nq,) for which the grid was cut last, the bodies there, and that cut:
            made from the state, and not part of it
    volumes the cut that the last step ended with, and its control volumes; likewise
    still   the cut that did not change in the last step, the band of its leak-proof projection, and
            that projection, which a copy makes anew; likewise
    pressed the control volumes that the last step ended with, the gradient of the pressure on them,
            and its matrix; likewise
    driven  what the equations of the bodies in the last step were made from, and these; likewise
    motors  what the actuators do in the step, None where none acts; likewise
    splitting
            make the added-mass part of forces, for each part of the last step; likewise
    """

    __repr__ = one_line

    setup: Setup
    solid: SolidState
    fluid: FluidState | None = None
    time: float = 0.0
    steps: int = 0
    ahead: float = 0.0
    parts: int = 1
    memory: dict[str, Array] = field(default_factory=dict)
    told: Told = NOTHING_TOLD
    cut: tuple[Array, Kinematics, Geometry] | None = field(default=None, repr=False, compare=False)
    volumes: tuple[Geometry, ControlVolumes] | None = field(default=None, repr=False, compare=False)
    still: tuple[Geometry, Band | None, Projection] | None = field(
        default=None, repr=False, compare=False
    )
    pressed: tuple[ControlVolumes, PressureGradient, PressureSystem] | None = field(
        default=None, repr=False, compare=False
    )
    driven: tuple[tuple[object, ...], PrescribedSystem] | None = field(
        default=None, repr=False, compare=False
    )
    motors: Motors | None = field(default=None, repr=False, compare=False)
    splitting: tuple[Callable[[], Array], ...] = field(default=(), repr=False, compare=False)

    def __getstate__(self) -> dict[str, object]:
        kept = dict.fromkeys(("cut", "volumes", "still", "pressed", "driven", "motors"))
        return vars(self) | kept | {"splitting": ()}

    @classmethod
    @takes(setup=one_of(Setup, wanted="a Setup"))
    def at_rest(cls, setup: Setup) -> World:
        """World of `setup` in its model's rest pose, in still fluid."""
        fluid, state = setup.fluid, None
        if fluid is not None:
            grid = fluid.grid
            wake = wake_shape(grid, fluid.boundaries.sea(grid))
            state = FluidState.at_rest(grid, fluid.scalars, wake)
        return cls(setup, setup.solid.rest(), state)

    def flow(self) -> tuple[Fluid, FluidState]:
        """The fluid and its state. Raises ValueError when the world has none."""
        if self.setup.fluid is None or self.fluid is None:
            raise ValueError("this world has no fluid; give its setup one")
        return self.setup.fluid, self.fluid

    def advance_clock(self, dt: float) -> None:
        """Count a step of dt (s)."""
        self.time += dt
        self.steps += 1

    def copy(self) -> World:
        copy = self.for_step()
        copy.fluid = None if self.fluid is None else self.fluid.copy()
        return copy

    def for_step(self) -> World:
        """A copy to be stepped, which leaves this one as it is; it shares what steps of either
        replace."""
        fluid = None if self.fluid is None else self.fluid.for_step()
        memory = {name: values.copy() for name, values in self.memory.items()}
        copy = replace(self, solid=self.solid.copy(), fluid=fluid, memory=memory)
        copy.still = copy.pressed = copy.driven = None
        return copy

    def arrays(self) -> dict[str, Array]:
        """The whole state as named arrays; `from_arrays` is the way back, bit for bit."""
        clock = [self.time, self.steps, self.ahead, self.parts]
        named: dict[str, Array] = {"clock": np.array(clock)}
        named |= {"solid/q": self.solid.q, "solid/v": self.solid.v}
        if self.solid.act.size:
            named["solid/act"] = self.solid.act
        if self.fluid is not None:
            named |= {f"fluid/{k}": v for k, v in self.fluid.arrays().items()}
            named["grid/origin"] = np.array(self.flow()[0].grid.origin)
        return named | {f"memory/{k}": v for k, v in self.memory.items()}

    @classmethod
    def from_arrays(cls, setup: Setup, arrays: dict[str, Array]) -> World:
        """World of `setup` in the state that `arrays` gave. Raises KeyError when one is missing."""
        time, steps, ahead, parts = arrays["clock"]
        if setup.fluid is not None:
            x, y, z = arrays["grid/origin"].tolist()
            setup = setup.on(replace(setup.fluid.grid, origin=(x, y, z)))
        return cls(
            setup,
            SolidState(arrays["solid/q"], arrays["solid/v"], arrays.get("solid/act", np.zeros(0))),
            None if setup.fluid is None else FluidState.from_arrays(under("fluid/", arrays)),
            float(time),
            int(steps),
            float(ahead),
            int(parts),
            under("memory/", arrays),
        )
