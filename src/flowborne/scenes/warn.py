"""What a scene says that can be run and is implausible.

A warning is one sentence for people, without a full stop: where, what is implausible with its
value, and after a semicolon a value that would do. A kind of warning is a function in WARNINGS.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from flowborne.coupling.world import Setup
from flowborne.scenes.notes_clip import lying
from flowborne.scenes.schema import Scene
from flowborne.scenes.warn_bodies import (
    bodies_not_met,
    fixed_outside,
    floors_in_fluid,
    implausible_density,
    mass_apart,
)
from flowborne.scenes.warn_drives import angles_in_radians, limp_joints, too_slow
from flowborne.scenes.warn_size import lost_in_domain, thin_bodies
from flowborne.scenes.warn_speed import fast_bodies, fast_flow

Warn = Callable[[Scene, Setup], Iterator[str]]
"""Warnings of one kind about a scene and what was built of it."""

WARNINGS: tuple[Warn, ...] = (
    thin_bodies,
    lost_in_domain,
    implausible_density,
    mass_apart,
    bodies_not_met,
    floors_in_fluid,
    fixed_outside,
    fast_bodies,
    fast_flow,
    angles_in_radians,
    too_slow,
    limp_joints,
    lying,
)
"""In the order in which they are listed."""


def warnings_of(scene: Scene, setup: Setup) -> list[str]:
    """All warnings about a scene, the same before, during and after a run."""
    return [warning for warn in WARNINGS for warning in warn(scene, setup)]


def headline(warnings: list[str]) -> str:
    """How many there are: "2 warnings", or "nothing wrong" without any."""
    count = len(warnings)
    return f"{count} warning{'s' * (count > 1)}" if count else "nothing wrong"
