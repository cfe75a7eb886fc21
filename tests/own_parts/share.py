"""A rule: a part of what strength allows."""

from dataclasses import dataclass

from flowborne.parts import FullStep, Poses, descent, rule


@rule("share")
@dataclass(frozen=True)
class Share(FullStep):
    part: float = 0.5

    def step(self, poses: Poses, gradient, limit):
        return self.part * descent(gradient, limit)
