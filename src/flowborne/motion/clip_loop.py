"""A clip that goes on from its own end: where each turn begins, and how the ends are joined."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.motion.clip_curves import UP, Columns
from flowborne.quaternions import about, angle, inverse, product, turned, twist

Array = NDArray[np.float64]

CLOSED = 1e-4
"""rad or m within which a clip that ends as it begins is taken for one whole cycle."""


@dataclass(frozen=True)
class Stride:
    """What moves the first cycle onto the second: a turn about the vertical and a level shift.

    The height is no part of it: over many cycles on level ground the least difference between the
    clip's two ends would lift the feet off or sink them.

    turn   rad
    shift  m, x + iy, after the turn about the world's origin
    """

    turn: float = 0.0
    shift: complex = 0.0j

    def times(self, cycles: int) -> tuple[Array, Array]:
        """(4,) turn and (3,) shift that this many strides add up to; fewer than 0 go back."""
        if abs(np.sin(self.turn / 2.0)) < 1e-12:
            total = self.shift * cycles
        else:
            ratio = np.sin(cycles * self.turn / 2.0) / np.sin(self.turn / 2.0)
            total = self.shift * np.exp(0.5j * (cycles - 1) * self.turn) * ratio
        turn = about(UP, np.array(cycles * self.turn))
        return turn, np.array([total.real, total.imag, 0.0])


def stride_between(columns: Columns, begin: Array, end: Array) -> Stride:
    """Stride that brings the first free joint of a row as near to another row as it can."""
    if not len(columns.free):
        return Stride()
    first = columns.free[0]
    last, before = columns.quaternions(end)[first], columns.quaternions(begin)[first]
    turn = float(twist(product(last, inverse(before)), UP))
    shift = columns.places(end)[0] - turned(about(UP, np.array(turn)), columns.places(begin)[0])
    return Stride(turn, complex(shift[0], shift[1]))


def mismatch(columns: Columns, begin: Array, end: Array, stride: Stride) -> tuple[float, str]:
    """Largest difference, rad or m, between a row and another moved on by a stride; its joint."""
    moved = columns.moved(begin, *stride.times(1))
    turns = angle(product(inverse(columns.quaternions(moved)), columns.quaternions(end)))
    off = np.abs(columns.places(end) - columns.places(moved)).max(axis=-1)
    hinges = np.abs(columns.angles(end) - columns.angles(moved))
    differences = np.concatenate([turns, off, hinges])
    worst = int(np.argmax(differences))
    return float(differences[worst]), columns.names[columns.owners[worst]]
