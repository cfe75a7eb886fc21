"""Step rules of the gradient descent. Paper: section 2.1."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Protocol

import numpy as np
from pydantic import Field, Tag

from flowborne.base.registry import Registry
from flowborne.base.tables import BUILT_IN, OWN, OwnTable, Positive, Steps, Table, by_kind_or_own
from flowborne.control.gradients import Poses
from flowborne.control.surroundings import Surroundings
from flowborne.kernels.arrays import Array

GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


class Rule(Protocol):
    """Turns a gradient into a displacement of the controlled dofs."""

    def step_scale(self, scale: Array, before: Array, gradient: Array) -> Array:
        """(n,) part of strength and probe that a decision uses, above 0 and at most 1.

        scale     (n,) of the last decision; 1 before the first
        before    (n,) gradient of the last decision, per rad or m
        gradient  (n,) of this one, found with probes of the last scale
        """
        ...

    def step(self, poses: Poses, gradient: Array, limit: Array) -> Array:
        """(n,) displacement, rad or m, each at most `limit` (n,), what strength allows."""
        ...


RULES: Registry[Rule] = Registry(
    "rule",
    methods=("step_scale", "step"),
    taken=("fixed", "resilient", "golden-section", "quasi-newton"),
)
"""Rules that users have registered."""


def descent(gradient: Array, limit: Array) -> Array:
    """(n,) the longest displacement along -gradient with no dof beyond its limit.

    The dof with the largest gradient relative to its limit moves by its limit, and the others in
    proportion: the length does not shrink with the gradient. A single dof moves by
    -sign(gradient) limit. A zero gradient gives no displacement.

    gradient  (n,) per rad or m
    limit     (n,) positive, rad or m
    """
    demand = gradient / limit
    largest = float(np.max(np.abs(demand)))
    if largest == 0.0:
        return np.zeros_like(gradient)
    return -limit * (demand / largest)


class FullStep:
    """Always the full strength and probe."""

    def step_scale(self, scale: Array, before: Array, gradient: Array) -> Array:
        return np.ones_like(scale)


@dataclass(frozen=True)
class FixedStep(FullStep):
    """A step as long as strength allows, for any size of the gradient.

    The number of frames to an optimum is the distance divided by strength times frame time, rounded
    up; a chatter of at most one step remains there.

    source  Lentine et al. 2011, section 2.1
    """

    def step(self, poses: Poses, gradient: Array, limit: Array) -> Array:
        return descent(gradient, limit)


@dataclass(frozen=True)
class ResilientStep(FixedStep):
    """Steps and probes that shorten if the descent reverses, and grow if it continues.

    Far from an optimum the step is that of `FixedStep`. If the gradient of a dof changes its sign,
    the dof has passed the optimum, and its next step and probe are half as long. The oscillation
    decays, and a probe wider than a kink no longer moves the dof. If the sign stays, step and probe
    grow again, up to strength and the scene's probe, so that a moving optimum is followed.

    shorten, lengthen  factors on the scale after a change of sign, and after none
    least              scale below which nothing shortens
    raises             ValueError unless 0 < shorten < 1 < lengthen and 0 < least <= 1
    source             Riedmiller and Braun 1993 (RPROP), without a step back
    """

    shorten: float = 0.5
    lengthen: float = 1.2
    least: float = 1.0 / 64.0

    def __post_init__(self) -> None:
        if not 0.0 < self.shorten < 1.0 < self.lengthen < np.inf:
            raise ValueError(
                f"shorten is {self.shorten} and lengthen {self.lengthen}: "
                "give one between 0 and 1 and one above 1"
            )
        if not 0.0 < self.least <= 1.0:
            raise ValueError(f"least scale is {self.least}: give a number above 0, at most 1")

    def step_scale(self, scale: Array, before: Array, gradient: Array) -> Array:
        same = np.sign(before) * np.sign(gradient)
        factor = np.where(same < 0.0, self.shorten, np.where(same > 0.0, self.lengthen, 1.0))
        return np.clip(scale * factor, self.least, 1.0)


@dataclass(frozen=True)
class GoldenSection(FullStep):
    """Line search for the minimum along -gradient; the step leads there, within strength.

    reach      rad or m, displacement of the dof that moves most at the far end of the search; None:
               as far as strength allows in one decision
    tolerance  length of the final bracket, relative to the search
    raises     ValueError if reach is not positive or tolerance is outside (0, 1)
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
        """Part of the displacement `far` with the smallest objective of all tried."""
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


@dataclass(frozen=True)
class QuasiNewton(FullStep):
    """Minimum within strength, by limited-memory BFGS, which couples the joints.

    Gradients in several poses show how the slope of one joint changes with another joint. The
    search therefore follows the floor of a narrow valley, where steepest descent zigzags. All poses
    are evaluated in the present flow. The step goes to the best of them.

    gradients  maximum number of gradients in a decision, including that of the present pose; each
               takes one further trial, and so does the last pose
    raises     ValueError if gradients < 1
    source     Byrd, Lu, Nocedal and Zhu 1995 (L-BFGS-B, in SciPy)
    """

    gradients: int = 8

    def __post_init__(self) -> None:
        if self.gradients < 1:
            raise ValueError(f"gradients are {self.gradients}: give at least 1")

    def step(self, poses: Poses, gradient: Array, limit: Array) -> Array:
        steepest = float(np.max(np.abs(limit * gradient)))
        if steepest == 0.0:
            return np.zeros_like(gradient)
        from scipy.optimize import minimize  # takes 0.2 s, which other rules save

        tried: list[tuple[float, Array]] = []

        def slope(share: Array) -> tuple[float, Array]:
            """Objective and gradient where each dof is displaced by a share (n,) of its limit, in
            units of strength and of the steepest slope."""
            displacement = poses.within_range(share * limit)
            tried.append((float(poses.values(displacement[None])[0]), displacement))
            if len(tried) > self.gradients:
                raise _EnoughError
            there = poses.gradient(displacement) if share.any() else gradient
            return tried[-1][0] / steepest, there * limit / steepest

        ends = np.array([poses.within_range(-limit), poses.within_range(limit)]) / limit
        with suppress(_EnoughError):
            minimize(slope, np.zeros_like(gradient), jac=True, method="L-BFGS-B", bounds=ends.T)
        return min(tried, key=lambda one: one[0])[1]


class _EnoughError(Exception):
    """The maximum number of gradients has been estimated."""


class RuleTable(Table):
    """Keys of every rule: the parameters of its class.

    estimates  maximum number of gradients in a decision
    """

    rule: ClassVar[type[Rule]]

    @property
    def estimates(self) -> int:
        return 1

    def build(self, around: Surroundings) -> Rule:
        """The rule that the table describes."""
        return self.rule(**self.model_dump(exclude={"kind"}))


class RuleFixed(RuleTable):
    """The longest step down the gradient that strength allows."""

    rule = FixedStep
    kind: Literal["fixed"]


class RuleResilient(RuleTable):
    """Steps and probes that halve if the descent reverses, and grow again if it continues.

    least  smallest part of strength and probe. In a fluid a probe that moves a body by less than
           about a cell depends on the grid
    """

    rule = ResilientStep
    kind: Literal["resilient"]
    least: Annotated[float, Field(gt=0, le=1)] = 1.0 / 64.0


class RuleGoldenSection(RuleTable):
    """Golden-section search along the gradient.

    reach      degrees or m, displacement of the joint that moves most at the far end of the search;
               by default what strength allows
    tolerance  length of the final bracket, relative to the search
    """

    kind: Literal["golden-section"]
    reach: Positive | None = None
    tolerance: Annotated[float, Field(gt=0, lt=1)] = 0.02

    def build(self, around: Surroundings) -> GoldenSection:
        unit = around.unit(around.controlled[0])
        return GoldenSection(None if self.reach is None else unit * self.reach, self.tolerance)


class RuleQuasiNewton(RuleTable):
    """Limited-memory BFGS over all joints with the same objectives.

    gradients  maximum number in a decision, each in another pose
    """

    rule = QuasiNewton
    kind: Literal["quasi-newton"]
    gradients: Steps = 8

    @property
    def estimates(self) -> int:
        return self.gradients


class RuleOwn(RuleTable, OwnTable):
    """A user's rule; all further keys are its parameters."""

    registry = RULES

    def build(self, around: Surroundings) -> Rule:
        return RULES.make(self.kind, self.parameters)


AnyRule = Annotated[
    Annotated[
        RuleFixed | RuleResilient | RuleGoldenSection | RuleQuasiNewton,
        Field(discriminator="kind"),
        Tag(BUILT_IN),
    ]
    | Annotated[RuleOwn, Tag(OWN)],
    *by_kind_or_own(RULES),
]
