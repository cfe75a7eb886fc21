"""The arrays of a run's states: what each of them is, and all states of one, read lazily."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flowborne.runs.states import read_state


class Quantity(NamedTuple):
    """What an array of the states is.

    dimensions  names of its axes in one state
    unit        "1" where it has none; in a slab forces are per metre of depth
    meaning     in a few words
    """

    dimensions: tuple[str, ...]
    unit: str
    meaning: str


QUANTITIES = {
    "time": Quantity((), "s", "time"),
    "q": Quantity(("position_number",), "m, rad or 1", "generalised positions as MuJoCo has them"),
    "v": Quantity(("dof",), "m/s or rad/s", "generalised velocities as MuJoCo has them"),
    "geom_position": Quantity(("geom", "axis"), "m", "origin of each geometry"),
    "geom_rotation": Quantity(("geom", "row", "column"), "1", "geometry's frame to the world's"),
    "body_position": Quantity(("body", "axis"), "m", "origin of each body's frame"),
    "body_rotation": Quantity(("body", "row", "column"), "1", "body's frame to the world's"),
    "fluid_centre": Quantity(("body", "axis"), "m", "centroid of a body and its flesh"),
    "fluid_force": Quantity(
        ("body", "axis"),
        "N",
        "force of fluid and winds on a body, mean over the frame without the added-mass part",
    ),
    "flesh_vertices": Quantity(("vertex", "axis"), "m", "vertices on the skin of flesh"),
    "velocity_x": Quantity(("x_face", "y", "z"), "m/s", "velocity on the faces across x"),
    "velocity_y": Quantity(("x", "y_face", "z"), "m/s", "velocity on the faces across y"),
    "velocity_z": Quantity(("x", "y", "z_face"), "m/s", "velocity on the faces across z"),
    "pressure": Quantity(("x", "y", "z"), "Pa", "pressure in the cells"),
    "open": Quantity(("x", "y", "z"), "1", "part of each cell that no body takes up"),
}
"""The arrays of a state by name; `scalar_<dye>` are as `open`."""

DYE = re.compile(r"scalar_(.+)")


class StateArray:
    """One array of all states, read from the files as it is asked for.

    `array[3]` and `array[-1]` are those of one state; `array[2:9]` and `numpy.asarray(array)` those
    of several, one after the other along the first axis.

    quantity  what it is, in which unit
    shape     (n, ...), n the number of states
    dtype     of its numbers
    """

    def __init__(self, states: tuple[Path, ...], name: str, quantity: Quantity) -> None:
        self._states, self._name, self.quantity = states, name, quantity
        first = self._read(0)
        self.shape: tuple[int, ...] = (len(states), *first.shape)
        self.dtype = first.dtype

    def __len__(self) -> int:
        """Number of states."""
        return len(self._states)

    def __getitem__(self, number: int | slice) -> NDArray[Any]:
        """(...) of one state, or (k, ...) of a slice of them."""
        if isinstance(number, slice):
            chosen = range(len(self))[number]
            empty = np.empty((0, *self.shape[1:]), self.dtype)
            return np.stack([self._read(n) for n in chosen]) if chosen else empty
        return self._read(number)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return self[:].astype(self.dtype if dtype is None else dtype, copy=False)

    def _read(self, number: int) -> NDArray[Any]:
        return read_state(self._states[number], (self._name,))[self._name]


def quantity(name: str) -> Quantity:
    """What an array of the states is."""
    if dye := DYE.fullmatch(name):
        return Quantity(("x", "y", "z"), "1", f"dye '{dye[1]}' in the cells")
    return QUANTITIES[name]
