"""How far to go down the gradient. Paper: section 2.1."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flowborne.control.gradients import Poses

Array = NDArray[np.float64]

GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


class Rule(Protocol):
    """Turns a gradient into a displacement of the controlled dofs."""

    def step(self, poses: Poses, gradient: Array, limit: Array) -> Array:
        """(n,) displacement, rad or m, each at most `limit` (n,), what strength allows."""
        ...


def descent(gradient: Array, limit: Array) -> Array:
    """(n,) the longest displacement along -gradient with no dof beyond its limit.

    The dof that is asked most of, relative to what it can, goes as far as its strength lets it,
    and the others in proportion: the length does not fade with the gradient. A single dof moves by
    -sign(gradient) limit. No gradient, no displacement.

    gradient  (n,) per rad or m
    limit     (n,) positive, rad or m
    """
    demand = gradient / limit
    largest = float(np.max(np.abs(demand)))
    if largest == 0.0:
        return np.zeros_like(gradient)
    return -limit * (demand / largest)


@dataclass(frozen=True)
class FixedStep:
    """One step as long as strength allows, whatever the size of the gradient.

    So the frames to an optimum are the distance over strength times frame time, rounded up, and
    what remains there is a chatter of at most one step.

    source  Lentine et al. 2011, section 2.1
    """

    def step(self, poses: Poses, gradient: Array, limit: Array) -> Array:
        return descent(gradient, limit)


@dataclass(frozen=True)
class GoldenSection:
    """Search for the least objective along -gradient; the step then goes there, within strength.

    reach      rad or m, travel at the far end of the search of the dof that moves most; None: as
               far as strength allows in one decision
    tolerance  length, as a part of the search, to which the least is bracketed
    raises     ValueError when reach is not positive or tolerance is outside (0, 1)
    source     Lentine et al. 2011
    """

    reach: float | None = None
    tolerance: float = 0.02

    def __post_init__(self) -> None:
        if self.reach is not None and not 0.0 < self.reach < np.inf:
            raise ValueError(f"reach of the golden section is {self.reach}: give a positive number")
        if not 0.0 < self.tolerance < 1.0:
            raise ValueError(f"tolerance of the golden section is {self.tolerance}: give 0 to 1")

    def step(self, poses: Poses, gradient: Array, limit: Array) -> Array:
        strongest = descent(gradient, limit)
        if not strongest.any():
            return strongest
        scale = 1.0 if self.reach is None else self.reach / float(np.max(np.abs(strongest)))
        return min(scale * self._least(poses, scale * strongest), 1.0) * strongest

    def _least(self, poses: Poses, far: Array) -> float:
        """Part of the displacement `far` at which the objective is least, of all tried."""
        low, high = 0.0, 1.0
        inner, outer = 1.0 - GOLDEN, GOLDEN
        at = [low, inner, outer, high]
        found = {t: float(f) for t, f in zip(at, self._values(poses, far, at), strict=True)}
        while high - low > self.tolerance:
            if found[inner] <= found[outer]:
                high, outer = outer, inner
                inner = new = high - GOLDEN * (high - low)
            else:
                low, inner = inner, outer
                outer = new = low + GOLDEN * (high - low)
            found[new] = float(self._values(poses, far, [new])[0])
        return min(found, key=lambda t: (found[t], t))

    def _values(self, poses: Poses, far: Array, at: list[float]) -> Array:
        return poses.values(np.array([poses.within_range(t * far) for t in at]))
