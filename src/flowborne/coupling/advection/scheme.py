"""What every scheme that carries the fluid's velocity is given, does and returns."""

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
    """Fluid and bodies at the start of a step, and what carries the fluid through it.

    grid, sides  where the fluid is
    density      kg/m^3
    state        of the fluid
    velocity     Faces, with half of the last pressure, m/s
    transport    the leak-proof fluxes, and the control volumes at both ends
    cut          the cut grid
    jets         of the mouths
    sources      (nx, ny, nz) what sources bring into each cell, m^3/s
    solid        the bodies,
    bodies       and their state
    """

    grid: Grid
    sides: Boundaries
    density: float
    state: FluidState
    velocity: Faces
    transport: Transport
    cut: Geometry
    jets: tuple[Jet, ...]
    sources: Array
    solid: SolidModel
    bodies: SolidState


@dataclass(frozen=True)
class Carried:
    """The fluid a step later.

    velocity  Faces u*, m/s
    volumes   control volumes at the end of the step
    lost      (3,) momentum that the scheme made (or lost, when negative), N s
    crossed   (3,) momentum that the flow carried in through the sides, N s
    stopped   (3,) momentum that the sides which prescribe a velocity gave to what reached them, N s
    expelled  (3,) momentum that came in through mouths and sources, N s
    jets      of the mouths, those that drink with the velocity of what they drank
    """

    velocity: Faces
    volumes: ControlVolumes
    lost: Array
    crossed: Array
    stopped: Array
    expelled: Array
    jets: tuple[Jet, ...]


class Advection:
    """A scheme that carries the fluid's velocity.

    half_kick  whether half of the last pressure may act before it (see `half_kick`)
    """

    half_kick: ClassVar[bool]

    def carry(self, start: Departure) -> Carried:
        """The fluid after `start.transport.dt`."""
        raise NotImplementedError
