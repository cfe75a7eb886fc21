"""Whether the controlled joints of a scene have a pose in which they can come to rest."""

from __future__ import annotations

from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_solids import MotionConstantTable


def can_settle(scene: Scene) -> bool:
    """Whether nothing in a scene keeps the optimum of its objectives moving.

    A clip, an earlier run, a joint that is driven, a mouth, a plan of several knots, phases, and
    an objective that asks for a motion each do.
    """
    moved = scene.clip is not None or scene.earlier is not None or bool(scene.mouths)
    moved |= any(
        not isinstance(table, MotionConstantTable) or table.rate != 0.0 for table in scene.motion
    )
    planned = scene.controller.knots is not None
    phased = any(table.in_phases for table in scene.control)
    return not (moved or planned or phased) and all(
        table.rests and table.phases is None for table in scene.objectives
    )
