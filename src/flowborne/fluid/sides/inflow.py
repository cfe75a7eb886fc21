"""A side through which fluid comes in with a given velocity."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flowborne.fluid.grid import Array
from flowborne.fluid.sides.side import Boundary, Place, Profile, ScalarProfile


@dataclass(frozen=True)
class BoundaryInflow(Boundary):
    """Velocity given by `profile`; carried scalars enter with the values in `scalars`."""

    profile: Profile
    scalars: dict[str, ScalarProfile] = field(default_factory=dict)
    kind = "inflow"
    supplies = True

    def prescribed_velocity(self, place: Place, component: int, time: float) -> Array:
        return np.asarray(self.profile(*place.face_coordinates(component), time)[component], float)

    def entering_scalar(self, name: str, place: Place, time: float) -> Array | None:
        if name not in self.scalars:
            return None
        return self.scalars[name](*place.cell_coordinates(), time)
