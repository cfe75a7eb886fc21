"""Finite differences of the objective over the controlled dofs. Paper: sections 2.1 and 4.3."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Protocol, Self

import numpy as np
from pydantic import Field, Tag

from flowborne.base.registry import Registry
from flowborne.base.tables import BUILT_IN, OWN, OwnTable, Table, by_kind_or_own
from flowborne.kernels.arrays import Array, Integers


class Poses(Protocol):
    """The objective as a function of the pose: the only input of gradients and rules.

    count  n, number of controlled dofs
    """

    @property
    def count(self) -> int: ...

    def within_range(self, displacement: Array) -> Array:
        """(n,) the part of a displacement that the joints' ranges allow."""
        ...

    def values(self, displacements: Array) -> Array:
        """(m,) objective in poses displaced by the rows of (m, n), each row on its own."""
        ...

    def gradient(self, displacement: Array) -> Array:
        """(n,) gradient with respect to the displacement in a displaced pose, per rad or m."""
        ...


@dataclass(frozen=True)
class OffsetPoses:
    """Poses relative to a displaced one: displacements add up.

    poses  relative to the present pose
    by     (n,) rad or m
    """

    poses: Poses
    by: Array

    @property
    def count(self) -> int:
        return self.poses.count

    def within_range(self, displacement: Array) -> Array:
        return self.poses.within_range(self.by + displacement) - self.by

    def values(self, displacements: Array) -> Array:
        return self.poses.values(self.by + displacements)

    def gradient(self, displacement: Array) -> Array:
        return self.poses.gradient(self.by + displacement)


@dataclass(frozen=True)
class Estimate:
    """Objective and its gradient in a pose.

    value     objective in the pose (central differences: mean of the trials)
    gradient  (n,) per rad or m
    """

    value: float
    gradient: Array


class Gradient(Protocol):
    """Estimates the gradient of the objective."""

    def of(self, indices: Integers, scale: Array) -> Gradient:
        """The same for some of the dofs, with these parts (m,) of their displacements."""
        ...

    def estimate(self, poses: Poses) -> Estimate:
        """Objective and gradient in the present pose."""
        ...


GRADIENTS: Registry[Gradient] = Registry(
    "gradient", methods=("of", "estimate"), taken=("central", "one-sided"), given=("displacement",)
)
"""Gradients that users have registered; `displacement` comes from the probes, rad or m per dof."""


@dataclass(frozen=True)
class FiniteDifference:
    """Common part of both differences.

    displacement  d in rad or m, one for all dofs or one each. A dof that is closer than d to the
                  end of its range is displaced to the end
    resolution    differences smaller than this part of the objective count as zero, so that
                  rounding in a symmetric pose moves no dof
    raises        ValueError if a displacement is not positive and finite or resolution is negative
    """

    displacement: float | tuple[float, ...]
    resolution: float = 1e-10

    def __post_init__(self) -> None:
        d = np.atleast_1d(np.asarray(self.displacement, dtype=np.float64))
        if not (np.all(np.isfinite(d)) and np.all(d > 0.0)):
            raise ValueError(
                f"displacement of the difference is {self.displacement}: "
                "give positive numbers in rad or m"
            )
        if not 0.0 <= self.resolution < 1.0:
            raise ValueError(f"resolution is {self.resolution}: give a number from 0 to below 1")

    def of(self, indices: Integers, scale: Array) -> Self:
        """The same for the dofs at some indices (m,) of all, with parts (m,) of their d."""
        d = np.asarray(self.displacement, dtype=np.float64)
        return replace(self, displacement=tuple((scale * (d[indices] if d.ndim else d)).tolist()))

    def displacements(self, count: int) -> Array:
        """(n,) d of each dof. Raises ValueError when there are not as many as dofs."""
        d = np.asarray(self.displacement, dtype=np.float64)
        if d.ndim and d.shape != (count,):
            raise ValueError(f"{d.size} displacements for {count} controlled dofs: give one each")
        return np.broadcast_to(d, (count,))

    def slope(self, rise: Array, run: Array, size: float) -> Array:
        """(n,) rise over run; zero where the rise is below resolution or there is no run."""
        real = (np.abs(rise) > self.resolution * size) & (run > 0.0)
        return np.divide(rise, run, out=np.zeros_like(rise), where=real)


@dataclass(frozen=True)
class GradientCentral(FiniteDifference):
    """(f(+d) - f(-d)) / 2d for every dof: 2n evaluations, error O(d^2).

    source  Lentine et al. 2011, sections 2.1 and 4.3
    """

    def estimate(self, poses: Poses) -> Estimate:
        n = poses.count
        d = np.diag(self.displacements(n))
        tried = np.array([poses.within_range(row) for row in np.concatenate([d, -d])])
        values = poses.values(tried)
        forward, backward = values[:n], values[n:]
        run = np.diagonal(tried[:n]) - np.diagonal(tried[n:])
        size = float(np.max(np.abs(values)))
        return Estimate(float(np.mean(values)), self.slope(forward - backward, run, size))


@dataclass(frozen=True)
class GradientOneSided(FiniteDifference):
    """(f(+d) - f(0)) / d for every dof with one f(0) for all: n + 1 evaluations, error O(d).

    A dof that cannot move forward within its range is displaced backward.

    source  Lentine et al. 2011
    """

    def estimate(self, poses: Poses) -> Estimate:
        n = poses.count
        tried = np.zeros((n + 1, n))
        for row, wanted in zip(tried[1:], np.diag(self.displacements(n)), strict=True):
            forward, backward = poses.within_range(wanted), poses.within_range(-wanted)
            row[:] = forward if np.abs(forward).sum() >= np.abs(backward).sum() else backward
        values = poses.values(tried)
        travel = np.diagonal(tried[1:])
        size = float(np.max(np.abs(values)))
        rise = (values[1:] - values[0]) * np.sign(travel)
        return Estimate(float(values[0]), self.slope(rise, np.abs(travel), size))


class GradientTable(Table):
    """Keys of every gradient."""

    gradient: ClassVar[type[GradientCentral | GradientOneSided]]

    def trials(self, dofs: int) -> int:
        """Number of trials for a number of dofs."""
        return 2 * dofs

    def build(self, displacement: tuple[float, ...]) -> Gradient:
        """The gradient that the table describes, with d of each dof in rad or m."""
        return self.gradient(displacement)


class GradientCentralTable(GradientTable):
    """Central differences: two trials a dof."""

    gradient = GradientCentral
    kind: Literal["central"]


class GradientOneSidedTable(GradientTable):
    """One-sided differences: a trial a dof and one of the present pose."""

    gradient = GradientOneSided
    kind: Literal["one-sided"]

    def trials(self, dofs: int) -> int:
        return dofs + 1


class GradientOwnTable(GradientTable, OwnTable):
    """A user's gradient; all further keys are its parameters."""

    registry = GRADIENTS

    def build(self, displacement: tuple[float, ...]) -> Gradient:
        return GRADIENTS.make(self.kind, self.parameters, displacement=displacement)


AnyGradient = Annotated[
    Annotated[
        GradientCentralTable | GradientOneSidedTable, Field(discriminator="kind"), Tag(BUILT_IN)
    ]
    | Annotated[GradientOwnTable, Tag(OWN)],
    *by_kind_or_own(GRADIENTS),
]
