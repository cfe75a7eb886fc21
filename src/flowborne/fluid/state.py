"""The fluid's part of the state."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flowborne.fluid.grid import Array, Faces, Grid


@dataclass
class FluidState:
    """Everything that the fluid carries from one step to the next.

    velocity            u on the faces, m/s; zero where a face is wholly closed
    acceleration        given by the last step beside what the flow carried, away from bodies,
                        m/s^2
    advecting_velocity  u half a step on, as the last two velocities tell, m/s
    pressure            (nx, ny, nz) dynamic pressure, Pa (hydrostatic part left out)
    earlier             (nx, ny, nz) that of the step before, Pa
    scalars             name -> (nx, ny, nz), carried for pictures
    cells               (nx, ny, nz) open volume of each cell, m^3; empty before the first step
    pose                (nq,) positions of the bodies that left these volumes
    """

    velocity: Faces
    acceleration: Faces
    advecting_velocity: Faces
    pressure: Array
    earlier: Array
    scalars: dict[str, Array] = field(default_factory=dict)
    cells: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    pose: Array = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def at_rest(cls, grid: Grid, scalars: tuple[str, ...] = ()) -> FluidState:
        """Still fluid without pressure or dye."""
        return cls(
            grid.zeros_faces(),
            grid.zeros_faces(),
            grid.zeros_faces(),
            np.zeros(grid.shape),
            np.zeros(grid.shape),
            {name: np.zeros(grid.shape) for name in scalars},
        )

    def copy(self) -> FluidState:
        return FluidState.from_arrays({k: v.copy() for k, v in self.arrays().items()})

    def arrays(self) -> dict[str, Array]:
        """Every array by a name; `from_arrays` is the way back."""
        named = {
            "pressure": self.pressure,
            "earlier": self.earlier,
            "cells": self.cells,
            "pose": self.pose,
        }
        for name in ("velocity", "acceleration", "advecting_velocity"):
            for axis, values in zip("xyz", getattr(self, name), strict=True):
                named[f"{name}_{axis}"] = values
        named.update({f"scalar_{name}": values for name, values in self.scalars.items()})
        return named

    @classmethod
    def from_arrays(cls, arrays: dict[str, Array]) -> FluidState:
        def faces(name: str) -> Faces:
            return arrays[f"{name}_x"], arrays[f"{name}_y"], arrays[f"{name}_z"]

        return cls(
            faces("velocity"),
            faces("acceleration"),
            faces("advecting_velocity"),
            arrays["pressure"],
            arrays["earlier"],
            {
                name.removeprefix("scalar_"): values
                for name, values in arrays.items()
                if name.startswith("scalar_")
            },
            arrays["cells"],
            arrays["pose"],
        )
