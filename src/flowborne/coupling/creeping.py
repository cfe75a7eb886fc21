"""Creeping flow: viscosity and pressure solved for in turn until they agree.

One viscous solve and one of pressure and bodies is first order in nu dt / h^2. Where that is large
both are repeated. A sweep is the viscous solve with a pressure p, then the pressure solve, which
gives p_out, and p is right when the velocity after viscosity alone has no net outflow:

    r(p) = D u_v + J v_v - sources = 0
    z(p) = p_out - p - dt r / Y               Y = sum over the faces of a cell of (a A)^2 / D

for the friction D on each face. The last term is what viscosity adds to the pressure that such an
outflow asks for, mu r / V in the bulk (Cahouet and Chabert 1988). Sweeps are accelerated by those
before (Anderson 1965). The last thing done is a pressure solve, so momentum and volumes balance
however early they end.

Method: docs/method/viscosity.md.
"""

from __future__ import annotations

import numpy as np

from flowborne.coupling.world import Fluid
from flowborne.kernels.arrays import ROUNDING, Array, Indices

CREEPING = 3.0
"""nu dt / h^2 from which a step takes more than one sweep: below it one is off by 2 % of the drag
of a rod between walls in its first step, and less in those that follow."""

SWEEPS = 20
"""Most sweeps of a step."""

AGREED = 1e-4
"""Largest dt r / Y, relative to the pressure, at which sweeps end. At 1e-3 a rod has .995 of its
drag, and a scallop drifts by .5 mm in a cycle instead of .1."""


def viscous_number(viscosity: float, density: float, dt: float, h: float) -> float:
    """nu dt / h^2: how many cells wide friction spreads in a step, squared."""
    return viscosity / density * dt / h**2


def creeps(fluid: Fluid, dt: float) -> bool:
    """Whether friction is so strong that one sweep is not enough for a step."""
    given = fluid.viscosity, fluid.density, dt, fluid.grid.spacing
    return viscous_number(*given) >= CREEPING


class Sweeps:
    """The pressures that the sweeps of a step have tried, p^ = p dt in (nx, ny, nz), and what they
    led to.

    volume  (nx, ny, nz) open volumes of the cells, m^3
    yields  (nx, ny, nz) Y, see `ViscousSystem.yields`, m^4 s/kg
    label   (nx, ny, nz) number of the closed region of each cell, -1 in all others: of a pressure
            there only differences act
    error   size of dt r / Y after the last sweep, relative to that of the pressure
    """

    def __init__(self, volume: Array, yields: Array, label: Indices, dt: float) -> None:
        self.volume, self.weight, self.label = volume, np.sqrt(volume), label
        self.stiffness = np.divide(dt, yields, out=np.zeros(yields.shape), where=yields > 0.0)
        self.tried: list[Array] = []
        self.steps: list[Array] = []
        self.count, self.error = 0, np.inf

    def next(self, pressure: Array, found: Array, outflow: Array) -> Array | None:
        """The pressure to try next; None when the last one will do, or SWEEPS are over.

        pressure  of the last viscous solve
        found     of the pressure solve after it; 0 in cells without fluid
        outflow   r, m^3/s
        """
        fluid = found != 0.0
        tried, after, given = (
            self._weighed(field * fluid) for field in (pressure, found, self.stiffness * outflow)
        )
        scale = float(np.linalg.norm(after))
        self.error = float(np.linalg.norm(given)) / scale if scale > 0.0 else 0.0
        self.count += 1
        if self.error <= AGREED or self.count >= SWEEPS:
            return None
        self.tried.append(tried)
        self.steps.append(after - tried - given)
        ahead = tried + self.steps[-1]
        if len(self.steps) > 1:
            changes, moves = (np.diff(fields, axis=0).T for fields in (self.steps, self.tried))
            parts = np.linalg.lstsq(changes, self.steps[-1], rcond=ROUNDING)[0]
            ahead = ahead - (moves + changes) @ parts
        weight = self.weight.ravel()
        unweighted = np.divide(ahead, weight, out=np.zeros(ahead.size), where=weight > 0.0)
        return unweighted.reshape(pressure.shape)

    def forget(self) -> None:
        """Begin anew, as the bodies answer otherwise now."""
        self.tried, self.steps = [], []

    def _weighed(self, pressure: Array) -> Array:
        """(n,) a pressure without its mean in each closed region, times sqrt(V)."""
        inside = (self.label >= 0) & (pressure != 0.0)
        number, volume, free = self.label[inside], self.volume[inside], pressure.copy()
        total, room = (np.bincount(number, v) for v in (volume * pressure[inside], volume))
        free[inside] -= np.divide(total, room, out=np.zeros(room.size), where=room > 0.0)[number]
        return np.asarray((self.weight * free).ravel())
