"""The fluid's part of the state."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Faces


@dataclass
class FluidState:
    """The fluid at t^n, and what the next step needs of the last one, from t^{n-1} to t^n.

    A step replaces the arrays of velocity and pressure: one kept over it has the old values.

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
        return cls(
            grid.zeros_faces(),
            grid.zeros_faces(),
            grid.zeros_faces(),
            np.zeros(grid.shape),
            np.zeros(grid.shape),
            wake=np.zeros(wake),
            scalars={name: np.zeros(grid.shape) for name in scalars},
        )

    def copy(self) -> FluidState:
        return FluidState.from_arrays({k: v.copy() for k, v in self.arrays().items()})

    def arrays(self) -> dict[str, Array]:
        """Every array by a name; `from_arrays` is the way back."""
        whole = "pressure", "previous_pressure", "cell_volume", "pose", "wake", "sea"
        named = {name: getattr(self, name) for name in whole}
        for name in ("velocity", "velocity_change", "acceleration"):
            for axis, values in zip("xyz", getattr(self, name), strict=True):
                named[f"{name}_{axis}"] = values
        return named | {f"scalar_{name}": values for name, values in self.scalars.items()}

    @classmethod
    def from_arrays(cls, arrays: dict[str, Array]) -> FluidState:
        def faces(name: str) -> Faces:
            return arrays[f"{name}_x"], arrays[f"{name}_y"], arrays[f"{name}_z"]

        return cls(
            faces("velocity"),
            faces("velocity_change"),
            faces("acceleration"),
            arrays["pressure"],
            arrays["previous_pressure"],
            arrays["cell_volume"],
            arrays["pose"],
            arrays["wake"],
            arrays["sea"],
            under("scalar_", arrays),
        )


def under(prefix: str, arrays: dict[str, Array]) -> dict[str, Array]:
    """The arrays whose names begin with `prefix`, by the rest of their names."""
    return {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}
