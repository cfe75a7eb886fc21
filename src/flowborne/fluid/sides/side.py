"""What every side of the domain does, and where it lies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import ClassVar

import numpy as np

from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import FREE, PRESCRIBED, Array

Profile = Callable[[Array, Array, Array, float], tuple[Array, Array, Array]]
"""velocity(x, y, z, time) -> (u, v, w): broadcasting arrays in m and s to m/s."""

ScalarProfile = Callable[[Array, Array, Array, float], Array]
"""value(x, y, z, time) of a carried scalar: broadcasting arrays in m and s."""

Slices = tuple[slice, ...]


@dataclass(frozen=True)
class Place:
    """Where a side lies: at the lower or the upper end of an axis of a grid."""

    grid: Grid
    axis: int
    upper: bool

    @cached_property
    def layer(self) -> Slices:
        """Index of the layer of a field that is next to the side, or of the faces on it."""
        layers = [slice(None)] * 3
        layers[self.axis] = slice(-1, None) if self.upper else slice(1)
        return tuple(layers)

    @property
    def at(self) -> float:
        """Where it lies along its axis, m."""
        return (self.grid.upper if self.upper else self.grid.origin)[self.axis]

    def face_coordinates(self, component: int) -> tuple[Array, Array, Array]:
        """x, y, z on the side at which a component of velocity lives, m; not to be written."""
        return _face_coordinates(self, component)

    def cell_coordinates(self) -> tuple[Array, Array, Array]:
        """x, y, z of the middles of the cells' faces on the side, m; broadcasting."""
        return self._on_side(self.grid.cell_coordinates(), sparse=True)

    def _on_side(
        self, coordinates: tuple[Array, Array, Array], sparse: bool
    ) -> tuple[Array, Array, Array]:
        along = list(coordinates)
        along[self.axis] = np.array([self.at])
        x, y, z = np.meshgrid(*along, indexing="ij", sparse=sparse)
        return x, y, z


@lru_cache(maxsize=64)
def _face_coordinates(place: Place, component: int) -> tuple[Array, Array, Array]:
    found = place._on_side(place.grid.face_coordinates(component), sparse=False)
    for coordinates in found:
        coordinates.flags.writeable = False
    return found


class Boundary:
    """One side of the domain; by default a wall that nothing crosses and nothing sticks to.

    Solvers derive all that they need from the ghosts beyond a side, for each component

        u_ghost = a u_inside + b        a = PRESCRIBED  -1, b = 2 u: the mean on the side is u
                                            FREE         1, b = 0
                                            PERIODIC     0, the ghost is inside the opposite side

    The pressure has the opposite a as the normal velocity (between the two with a column of fluid
    beyond, see `pressure_weight`), and b = 0: where the side prescribes the flux no pressure acts
    on its faces, where it is free p = 0 on it, and what enters there has the mean velocity of the
    fluid along all of it.

    A kind of side overrides what it does otherwise. Fields are indexed as in `Place`.

    kind        its name in scenes and messages
    normal      a of the velocity across it
    tangential  a of the velocity along it
    supplies    whether fluid enters with the prescribed velocity. An inflow has a wall's a, but
                dye comes in through it, a window may move across it, and its faces get their
                velocity again after each substep
    endless     whether the fluid beyond is a sea, which answers the flow inside. An open side has
                the same a, and nothing beyond it
    steady      whether what it prescribes to the velocity never changes, whatever the flow
    """

    kind: ClassVar[str]
    normal: ClassVar[int] = PRESCRIBED
    tangential: ClassVar[int] = FREE
    supplies: ClassVar[bool] = False
    endless: ClassVar[bool] = False
    steady: ClassVar[bool] = False

    def among(self, pairs: Sequence[Pair]) -> Boundary:
        """The side in a domain whose sides are these, the lower and the upper one of each axis."""
        return self

    def prescribed_velocity(self, place: Place, component: int, time: float) -> Array | float:
        """Component u of velocity on it at `time` (s), where a is PRESCRIBED, m/s. Broadcasts over
        the layer at the side. A viscous fluid has friction with a side that prescribes a tangential
        velocity.
        """
        return 0.0

    def pressure_weight(self, place: Place) -> Array | float:
        """Acceleration of its faces by the pressure in the cells next to it, relative to that with
        p = 0 on the side: 0 if the flux is prescribed, 1 on an open side, (h/2) / (h/2 + l) with a
        column of fluid of length l beyond. Of the pressure a = 1 - 2 weight, and that on the side
        is (1 - weight) times that in the cell. Broadcasts over the layer at the side.
        """
        return 0.0 if self.normal == PRESCRIBED else 1.0

    def irrotational_inflow(self, place: Place) -> bool:
        """Whether fluid that comes in has no vorticity: its tangential velocity is then that of
        `tangential_change`, and not the mean along a free side."""
        return False

    def velocity_beyond(self, velocity: Array, place: Place, component: int, time: float) -> Array:
        """A component of velocity a cell beyond the side, from that in the layer at it, m/s.

        velocity  indexed as `Place.face_coordinates` of the component
        """
        return velocity

    def entering_scalar(self, name: str, place: Place, time: float) -> Array | None:
        """Values of a scalar in fluid that enters; None for those in the cells at the side."""
        return None


Pair = tuple[Boundary | type[Boundary], Boundary | type[Boundary]]
"""Lower and upper side across an axis, or their kinds."""


def tangential_change(normal: Array, place: Place, component: int, periodic: bool) -> Array:
    """What a tangential component has more one cell beyond the side than in the layer inside it,
    m/s, in fluid without vorticity.

    There it changes across the side as the normal one does along it, du_t/dx_n = du_n/dx_t: so the
    circulation around each node (in rooms: each edge) of the side is 0.

    normal    velocity across the side on its faces, m/s
    periodic  whether the side is joined to itself along the component's axis
    returns   like the layer of the component's faces at the side; at both ends, where a face of
              the side is missing, as next to them
    """
    n = normal.shape[component]
    face = np.arange(n + 1) if periodic else np.arange(n + 1).clip(1, n - 1)
    above, below = (np.take(normal, cells, component, mode="wrap") for cells in (face, face - 1))
    return above - below if place.upper else -(above - below)
