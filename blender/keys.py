# SPDX-License-Identifier: GPL-3.0-or-later
"""Actions with one slot, and the keys in them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy

from .motion import Array


def new_action(name: str, owner: str = "") -> tuple[Any, Any, Any]:
    """An action of objects, its slot, named like its owner, and the bag of that slot's curves."""
    action = bpy.data.actions.new(name)
    slot = action.slots.new(id_type="OBJECT", name=owner or name)
    strip = action.layers.new("Layer").strips.new(type="KEYFRAME")
    return action, slot, strip.channelbag(slot, ensure=True)


def add_keys(bag: Any, bone: Any, path: str, frames: Sequence[float], values: Array) -> None:
    """Add keys of a property of a bone: values (frames, k), linear between them."""
    for index, column in enumerate(values.T):
        where = bone.path_from_id(path)
        curve = bag.fcurves.ensure(where, index=index, group_name=bone.name)
        points, before = curve.keyframe_points, len(curve.keyframe_points)
        points.add(len(frames))
        for point, *key in zip(points[before:], frames, column, strict=True):
            point.co, point.interpolation = key, "LINEAR"
        curve.update()
