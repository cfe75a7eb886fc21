"""What is not wrong with a scene, and still worth knowing before it runs."""

from __future__ import annotations

from collections.abc import Iterator

from flowborne.scenes.bodies import SLIDE, joint_kind
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_control import RuleFixed
from flowborne.solids.model import SolidModel


def notes_of(scene: Scene, model: SolidModel) -> Iterator[str]:
    """Sentences for people, without a full stop.

    A descent of fixed steps comes to rest where the objective is the same at both ends of a probe:
    half a probe off an optimum that is a kink, at most, and never nearer than its step.
    """
    if not isinstance(scene.controller.rule, RuleFixed):
        return
    time = scene.controller.every * scene.frame_time
    for number, table in enumerate(scene.control, start=1):
        step = min([table.strength, *(other.strength for other in table.in_phases)]) * time
        if table.probe > step:
            unit = "m" if joint_kind(model, table.joints[0]) == SLIDE else "degrees"
            yield (
                f"[[control]] {number}: probes of {table.probe:g} {unit} are wider than steps of "
                f"{step:.3g}, so that a sharp optimum is met to half a probe only; rule "
                "'resilient' of [controller] narrows both"
            )
