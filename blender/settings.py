# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user sets: for an armature, and in the preferences of the extension."""

from __future__ import annotations

import math

import bpy
from bpy.props import (
    BoolProperty,
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from .reaction import OBJECTIVES

FLESH = {
    "NONE": ("None", "The mesh is rigid around each bone"),
    "REACT": ("Bones React", "The bones react, and the mesh around them is soft"),
    "FOLLOW": ("Bones Follow", "The bones follow the animation, and the soft mesh reacts"),
}
"""Choice -> label and description."""


class FlowborneSettings(bpy.types.PropertyGroup):
    """Settings of an armature; `folder` is that of its last job."""

    folder: StringProperty(subtype="DIR_PATH", options={"PATH_SUPPORTS_BLEND_RELATIVE"})
    medium: EnumProperty(
        name="Medium",
        items=[("AIR", "Air", "1.2 kg/m³"), ("WATER", "Water", "1000 kg/m³"), ("OWN", "Own", "")],
    )
    own_density: FloatProperty(name="Density", description="kg/m³", default=100.0, min=1e-3)
    wind: PointerProperty(
        name="Wind",
        description="Wind force field: the flow is along its z, strength in m/s",
        type=bpy.types.Object,
        poll=lambda _, thing: thing.field is not None and thing.field.type != "NONE",
    )
    flow: FloatVectorProperty(name="Flow", description="m/s", default=(0.0, 8.0, 0.0))
    simulated: BoolProperty(
        name="Simulate the Flow",
        description="Slower: eddies and the reaction of the medium; otherwise a uniform wind",
    )
    resolution: IntProperty(
        name="Cells", description="Along the longest side", default=48, min=16, max=512
    )
    ink: PointerProperty(
        name="Ink",
        description="Object in whose bounding box the simulated flow is coloured",
        type=bpy.types.Object,
    )
    flesh: EnumProperty(
        name="Flesh",
        description="Whether the mesh around the selected bones is soft, and what the bones do",
        items=[(key, label, text) for key, (label, text) in FLESH.items()],
    )
    stiffness: FloatProperty(
        name="Stiffness",
        description="Young's modulus of the flesh, kPa: muscle 50, rubber 1000",
        default=50.0,
        min=0.1,
    )
    density: FloatProperty(
        name="Body", description="Density of the character, kg/m³", default=1000.0, min=1e-3
    )
    floats: BoolProperty(name="Root Floats", description="Forces move the root bone")
    objective: EnumProperty(
        name="Objective",
        items=[(key, key.replace("-", " ").capitalize(), "") for key in OBJECTIVES],
    )
    follow: FloatProperty(
        name="Follow",
        description="Weight of the distance from the animation, N m s per rad²",
        min=0.0,
    )
    strength: FloatProperty(
        name="Strength",
        description="Largest angular velocity of a free bone",
        subtype="ANGLE",
        default=math.radians(90.0),
        min=math.radians(0.1),
    )
    rounds: IntProperty(
        name="Rounds",
        description="Times a cycle is played; the last is baked. 1: the animation is no cycle",
        default=1,
        min=1,
    )
    preroll: IntProperty(
        name="Pre-roll",
        description="Frames before the range in which bones settle; they are not baked",
        min=0,
    )
