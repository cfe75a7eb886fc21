"""What every scheme that advects the fluid's velocity is given, does and returns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from flowborne.coupling.fractions import Geometry
from flowborne.coupling.mouths import Jet
from flowborne.fluid.boundary import Boundaries
from flowborne.fluid.control_volumes import ControlVolumes
from flowborne.fluid.grid import Array, Faces, Grid
from flowborne.fluid.state import FluidState
from flowborne.fluid.transport import Transport
from flowborne.solids.model import SolidModel
from flowborne.solids.state import SolidState


@dataclass(frozen=True)
class Departure:
    """Fluid and bodies at the start of a step, t^n.

    grid, sides  of the fluid
    density      kg/m^3
    inviscid     whether the fluid has no viscosity
    state        of the fluid
    cut          the cut grid
    volumes      control volumes
    jets         of the mouths
    sources      (nx, ny, nz) volume per time that sources bring into each cell, m^3/s
    rate         (nx, ny, nz) the same of sources and mouths
    solid        the bodies
    bodies       and their state
    """

    grid: Grid
    sides: Boundaries
    density: float
    inviscid: bool
    state: FluidState
    cut: Geometry
    volumes: ControlVolumes
    jets: tuple[Jet, ...]
    sources: Array
    rate: Array
    solid: SolidModel
    bodies: SolidState


@dataclass(frozen=True)
class AdvectionResult:
    """The fluid after advection.

    velocity  Faces u*, m/s
    volumes   control volumes at the end of the step
    lost      (3,) momentum that the scheme made (or lost, when negative), N s
    crossed   (3,) momentum that the flow carried in through the sides, N s
    stopped   (3,) momentum that sides with a prescribed velocity gave to the flow, N s
    expelled  (3,) momentum that came in through mouths and sources, N s
    jets      of the mouths; those that take fluid in have the velocity of that fluid
    """

    velocity: Faces
    volumes: ControlVolumes
    lost: Array
    crossed: Array
    stopped: Array
    expelled: Array
    jets: tuple[Jet, ...]


class Advection:
    """A scheme that advects the fluid's velocity.

    explicit_half_pressure  whether half of the last pressure may act before (see `half_pressure`)
    """

    explicit_half_pressure: ClassVar[bool]

    def carry(self, start: Departure, velocity: Faces, transport: Transport) -> AdvectionResult:
        """The fluid after `transport.dt`.

        velocity   Faces at the start, with half of the last pressure, m/s
        transport  leak-proof fluxes, and the control volumes at both ends of the step
        """
        raise NotImplementedError
