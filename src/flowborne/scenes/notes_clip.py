"""Notes and a warning on how the file of a clip was read."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne.coupling.world import Setup
from flowborne.motion.bvh import MAX_BONE_STRETCH
from flowborne.motion.clip_reading import MIN_STANDING_COSINE, leg_length, standing_axis, unit_text
from flowborne.motion.human.clip_skeleton import lost_bones
from flowborne.motion.human.skeleton import PARENTS
from flowborne.scenes.capture import capture_of
from flowborne.scenes.schema import Scene


def clip_notes(scene: Scene) -> Iterator[str]:
    """Sentences on how a clip's file was read, without a full stop."""
    yield from _read_as(scene)
    yield from _lost_bones(scene)


def _read_as(scene: Scene) -> Iterator[str]:
    """What was found out about a clip's file and its person, and what is not in it."""
    table, capture = scene.clip, capture_of(scene)
    if table is None or capture is None or table.file is None:
        return
    if capture.note:
        yield f"[clip]: {table.file} {capture.note}"
    if capture.skeleton is None or capture.posture is None:
        return
    found = []
    if table.unit == "auto":
        legs = leg_length(capture.clip, capture.mapping)
        found.append(f"unit = {unit_text(capture.unit)}, which makes legs of {legs:.2f} m")
    if table.up == "auto" and capture.up != "y":
        found.append(f"up = '{capture.up}'")
    if found:
        yield f"[clip]: {table.file} is read with {', and '.join(found)}"
    if capture.held:
        yield f"[clip]: not in {table.file}, held: {', '.join(capture.held)}"
    links = [f"{name} turns as '{capture.mapping[name]}'" for name in sorted(capture.links)]
    if links:
        yield f"[clip]: {table.file} has joints between the human's: {', '.join(links)}"
    stray, bone = max(
        (capture.clip.deviations.get(b, (0.0, 0))[0], b) for b in capture.mapping.values()
    )
    if stray > MAX_BONE_STRETCH:
        yield (
            f"[clip]: bones of {table.file} stretch, that to '{bone}' by {2e3 * stray:.3g} mm; "
            "each has its middle length here"
        )
    if (
        capture.posture[2] < MIN_STANDING_COSINE
        and standing_axis(capture.posture, capture.up) is None
    ):
        yield f"[clip]: the person of {table.file} lies rather than stands, whichever axis is up"


def _lost_bones(scene: Scene) -> Iterator[str]:
    """Joints of a clip that lie on each other."""
    capture = capture_of(scene)
    if scene.clip is None or scene.clip.file is None or capture is None or capture.skeleton is None:
        return
    skeleton = capture.skeleton
    lost = lost_bones(capture.clip, capture.mapping)
    for joint in lost:
        length = 100.0 * float(np.linalg.norm(skeleton[joint] - skeleton[PARENTS[joint]]))
        yield (
            f"[clip]: {scene.clip.file} has no bone above '{capture.mapping[joint]}', as BVH files "
            f"of the CMU database; one of {length:.2g} cm is put in, so that head and shoulders "
            "are where anatomy has them, higher than in the file"
        )


def lying(scene: Scene, setup: Setup) -> Iterator[str]:
    """A person who would stand with another axis of the file up."""
    capture = capture_of(scene)
    if scene.clip is None or capture is None or capture.posture is None:
        return
    other = standing_axis(capture.posture, capture.up)
    if capture.posture[2] < MIN_STANDING_COSINE and other is not None:
        yield (
            f"[clip]: with up = '{capture.up}' the person of {scene.clip.file} lies; "
            f"up = '{other}' makes it stand"
        )
