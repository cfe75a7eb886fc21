"""The fluid's part of the state."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from flowborne.base.one_line import one_line
from flowborne.fluid.grid import Grid, faces_of
from flowborne.kernels.arrays import Array, Faces

ON_FACES = "velocity", "velocity_change", "acceleration"
WHOLE = "pressure", "previous_pressure", "cell_volume", "pose", "wake", "sea"
"""The fields of `FluidState` in their order: those of three arrays, and those of one."""


@dataclass
class FluidState:
    """The fluid at t^n, and what the next step needs of the last one, from t^{n-1} to t^n.

    A step writes over the arrays of velocity and acceleration, and replaces all others: one of
    these that is kept over it has the old values.

    velocity           u^n on the faces, m/s; 0 where a face is wholly closed
    velocity_change    u^n - u^{n-1} on the faces, m/s; 0 before the first step, and next to bodies
                       but those that stand in a trial
    acceleration       a^{n-1/2} on the faces, m/s^2: the part of that change that is not advection,
                       per time; 0 next to bodies
    pressure           p^{n-1/2}, (nx, ny, nz), Pa: dynamic, without the hydrostatic part
    previous_pressure  p^{n-3/2}, (nx, ny, nz), Pa
    cell_volume        V^n, (nx, ny, nz) open volume of each cell, m^3; empty before the first step
    pose               q^n, (nq,) positions of the bodies for which the volumes hold
    wake               (sides, bins, k) what has left a domain in a sea, by the side that it left
                       through (see `fluid.wake`); empty elsewhere
    sea                (3,) velocity of the sea, m/s; empty before the first step and without one
    scalars            c^n, name -> (nx, ny, nz): dye and smoke
    """

    __repr__ = one_line

    velocity: Faces
    velocity_change: Faces
    acceleration: Faces
    pressure: Array
    previous_pressure: Array
    cell_volume: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    pose: Array = field(default_factory=lambda: np.zeros(0))
    wake: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    sea: Array = field(default_factory=lambda: np.zeros(0))
    scalars: dict[str, Array] = field(default_factory=dict)

    @classmethod
    def at_rest(
        cls, grid: Grid, scalars: tuple[str, ...] = (), wake: tuple[int, int, int] = (0, 0, 0)
    ) -> FluidState:
        """Still fluid without pressure or dye, with a wake of this shape."""
        faces = grid.zeros_faces(), grid.zeros_faces(), grid.zeros_faces()
        dyes = {name: np.zeros(grid.shape) for name in scalars}
        cells = np.zeros(grid.shape), np.zeros(grid.shape)
        return cls(*faces, *cells, wake=np.zeros(wake), scalars=dyes)

    def copy(self) -> FluidState:
        return FluidState.from_arrays({k: v.copy() for k, v in self.arrays().items()})

    def for_step(self) -> FluidState:
        """A copy of its own of what a step writes over, with the arrays of the rest."""
        velocity, acceleration = (
            faces_of([u.copy() for u in faces]) for faces in (self.velocity, self.acceleration)
        )
        return replace(self, velocity=velocity, acceleration=acceleration)

    def arrays(self) -> dict[str, Array]:
        """Every array by a name; `from_arrays` is the way back."""
        named = {name: getattr(self, name) for name in WHOLE}
        for name in ON_FACES:
            for axis, values in zip("xyz", getattr(self, name), strict=True):
                named[f"{name}_{axis}"] = values
        return named | {f"scalar_{name}": values for name, values in self.scalars.items()}

    @classmethod
    def from_arrays(cls, arrays: dict[str, Array]) -> FluidState:
        fields: dict[str, Any] = {name: arrays[name] for name in WHOLE}
        for name in ON_FACES:
            fields[name] = faces_of([arrays[f"{name}_{axis}"] for axis in "xyz"])
        return cls(**fields, scalars=under("scalar_", arrays))


def under(prefix: str, arrays: dict[str, Array]) -> dict[str, Array]:
    """The arrays whose names begin with `prefix`, by the rest of their names."""
    return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}
