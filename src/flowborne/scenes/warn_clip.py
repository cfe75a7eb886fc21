"""Warnings about a clip: a person who lies."""

from __future__ import annotations

from collections.abc import Iterator

from flowborne.coupling.world import Setup
from flowborne.motion.clip_reading import UPRIGHT, standing_axis
from flowborne.scenes.capture import capture_of
from flowborne.scenes.schema import Scene


def lying(scene: Scene, setup: Setup) -> Iterator[str]:
    """A person who would stand with another axis of the file up."""
    capture = capture_of(scene)
    if scene.clip is None or capture is None or capture.posture is None:
        return
    other = standing_axis(capture.posture, capture.up)
    if capture.posture[2] < UPRIGHT and other is not None:
        yield (
            f"[clip]: with up = '{capture.up}' the person of {scene.clip.file} lies; "
            f"up = '{other}' makes it stand"
        )
