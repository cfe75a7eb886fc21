"""The kinds of sides but the far ones, and what each says about the fluid beyond."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flowborne.fluid.sides.side import Boundary, Place, Profile, ScalarProfile
from flowborne.kernels.arrays import FREE, PERIODIC, PRESCRIBED, Array


@dataclass(frozen=True)
class BoundaryClosed(Boundary):
    """Free-slip wall: beyond it the field is mirrored."""

    kind = "closed"
    steady = True


@dataclass(frozen=True)
class BoundaryNoSlip(Boundary):
    """Wall that the fluid sticks to; it may slide in its own plane with `velocity` (m/s)."""

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    kind = "no-slip"
    tangential = PRESCRIBED
    steady = True

    def prescribed_velocity(self, place: Place, component: int, time: float) -> float:
        return self.velocity[component] if component != place.axis else 0.0


@dataclass(frozen=True)
class BoundaryInflow(Boundary):
    """Velocity given by `profile`; carried scalars enter with the values in `scalars`.

    It is steady if the profile has an attribute of that name that says so.
    """

    profile: Profile
    scalars: dict[str, ScalarProfile] = field(default_factory=dict)
    kind = "inflow"
    tangential = PRESCRIBED
    supplies = True

    @property
    def steady(self) -> bool:  # type: ignore[override]
        return getattr(self.profile, "steady", False)

    def prescribed_velocity(self, place: Place, component: int, time: float) -> Array:
        return np.asarray(self.profile(*place.face_coordinates(component), time)[component], float)

    def entering_scalar(self, name: str, place: Place, time: float) -> Array | None:
        if name not in self.scalars:
            return None
        return self.scalars[name](*place.cell_coordinates(), time)


@dataclass(frozen=True)
class BoundaryOpen(Boundary):
    """Dynamic pressure is zero here; fluid leaves and enters freely.

    What leaves has its own velocity; what comes in has the mean velocity of the fluid along the
    whole side, so that a uniform flow stays as it is and, seen from a frame that moves with the
    mean, no energy comes in. With its own velocity, a jet that once comes in would go on for ever,
    and low pressure behind the side would draw it in ever faster (Bruneau and Fabrie 1994).
    """

    kind = "open"
    normal = FREE
    steady = True


@dataclass(frozen=True)
class BoundaryPeriodic(Boundary):
    """Joined to the opposite side: the last faces are the first ones."""

    kind = "periodic"
    normal = tangential = PERIODIC
    steady = True
