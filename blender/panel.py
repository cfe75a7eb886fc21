# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties, operators and the panel, in the sidebar of the 3D view."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

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

from .bake import bake
from .character import armature_of, export_character, reaction_of
from .job import ACTIVE, CHARACTER, Job, JobError, State, engine_command
from .motion import MotionError, read_motion
from .reaction import OBJECTIVES, ReactionError

ERRORS = (JobError, MotionError, ReactionError)

PERIOD = 0.5
"""s between looks at a job."""

JOBS: dict[str, Job] = {}
"""Folder -> job of this session."""


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
        poll=lambda _, thing: thing.field is not None and thing.field.type == "WIND",
    )
    flow: FloatVectorProperty(name="Flow", description="m/s", default=(0.0, 8.0, 0.0))
    simulated: BoolProperty(
        name="Simulate the Flow",
        description="Slower: eddies and the reaction of the medium; otherwise a uniform wind",
    )
    resolution: IntProperty(
        name="Cells", description="Along the longest side", default=48, min=16, max=512
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


class FlowbornePreferences(bpy.types.AddonPreferences):
    """Where flowborne is installed."""

    bl_idname = __package__

    engine: StringProperty(
        name="Environment",
        description="Folder of the Python environment in which flowborne is installed",
        subtype="DIR_PATH",
    )

    def draw(self, context: Any) -> None:
        self.layout.prop(self, "engine")


def start_job(context: Any, engine: str) -> Job:
    """Export the active character, and start its run in a new folder next to the .blend.

    raises  one of ERRORS
    """
    armature = armature_of(context)
    settings = armature.flowborne
    command = engine_command(engine)
    reaction = reaction_of(context, armature, settings)
    if not bpy.data.filepath:
        raise ReactionError("the run is written next to the .blend file: save it first")
    blend = Path(bpy.data.filepath)
    plain = re.sub(r"[^\w-]", "-", armature.name)
    above = blend.with_name(f"{blend.stem}-flowborne")
    number = 1 + sum(1 for _ in above.glob(f"{plain}-[0-9]*"))
    job = Job(command, above / f"{plain}-{number}", reaction)
    export_character(context, armature, job.folder / CHARACTER)
    job.start()
    settings.folder = bpy.path.relpath(str(job.folder))
    JOBS[str(job.folder)] = job
    return job


def job_of(settings: Any, engine: str) -> Job:
    """The last job of an armature, also one of an earlier session. Raises one of ERRORS."""
    if not settings.folder:
        raise ReactionError("this armature has no run: start one")
    folder = Path(bpy.path.abspath(settings.folder))
    if str(folder) not in JOBS:
        JOBS[str(folder)] = Job.load(engine_command(engine) if engine else (), folder)
    return JOBS[str(folder)]


def engine_of(context: Any) -> str:
    """The environment from the preferences."""
    addon = context.preferences.addons.get(__package__)
    return "" if addon is None else addon.preferences.engine


@contextmanager
def _reported(operator: Any) -> Iterator[None]:
    """Context in which an error of ours is reported to the user."""
    try:
        yield
    except ERRORS as error:
        operator.report({"ERROR"}, str(error))


class FlowborneRun(bpy.types.Operator):
    """Compute how the selected bones react. Escape cancels"""

    bl_idname = "flowborne.run"
    bl_label = "Run"

    resume: BoolProperty(options={"SKIP_SAVE"})

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            if self.resume:
                self._job = job_of(armature_of(context).flowborne, engine_of(context))
                self._job.engine = engine_command(engine_of(context))
                self._job.start()
            else:
                self._job = start_job(context, engine_of(context))
            manager = context.window_manager
            self._timer = manager.event_timer_add(PERIOD, window=context.window)
            manager.modal_handler_add(self)
            return {"RUNNING_MODAL"}
        return {"CANCELLED"}

    def modal(self, context: Any, event: Any) -> set[str]:
        if event.type == "ESC":
            self._job.cancel()
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        state = self._job.step()
        for area in context.screen.areas if context.screen else ():
            area.tag_redraw()
        if state in ACTIVE:
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        self.report({"ERROR" if state is State.FAILED else "INFO"}, line_of(self._job))
        return {"FINISHED"}


class FlowborneCancel(bpy.types.Operator):
    """Stop the run after its last whole frame; it can be resumed"""

    bl_idname = "flowborne.cancel"
    bl_label = "Cancel"

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            job_of(armature_of(context).flowborne, engine_of(context)).cancel()
        return {"FINISHED"}


class FlowborneBake(bpy.types.Operator):
    """Put the frames so far on the NLA, as a strip above the animation"""

    bl_idname = "flowborne.bake"
    bl_label = "Bake"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender's way

    bones: EnumProperty(
        name="Bones",
        items=[
            ("FREE", "Free Bones", "Those that forces and objectives move, a floating root too"),
            ("SELECTED", "Selected Bones", "Selected in Pose Mode"),
            ("ALL", "All Bones", "All that the run moves"),
        ],
    )

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            armature = armature_of(context)
            job = job_of(armature.flowborne, engine_of(context))
            motion = read_motion(job.run)
            chosen = {
                "FREE": [*motion.moving[: job.reaction.floats], *job.reaction.bones],
                "SELECTED": [bone.name for bone in armature.pose.bones if bone.select],
                "ALL": motion.moving,
            }[self.bones]
            reaction = job.reaction
            strip = bake(context, armature, motion, reaction.first, reaction.unit, chosen)
            self.report({"INFO"}, f"baked {len(chosen)} bones to '{strip.name}'")
            return {"FINISHED"}
        return {"CANCELLED"}


def line_of(job: Job) -> str:
    """The state of a job in one line, or its message."""
    if job.message:
        return job.message
    left, frames = job.seconds_left, f"frame {job.frames_done}/{job.reaction.frames}"
    return f"{job.state.value}, {frames}" + ("" if left is None else f", {left:.0f} s left")


class FlowbornePanel(bpy.types.Panel):
    """Settings and state of the active armature."""

    bl_label = "Flowborne"
    bl_idname = "FLOWBORNE_PT_panel"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Flowborne"

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        try:
            armature = armature_of(context)
        except ReactionError as error:
            layout.label(text=str(error), icon="INFO")
            return
        settings = armature.flowborne
        free = sum(bone.select for bone in armature.pose.bones)
        layout.label(text=f"{armature.name}: {free} free bones (selected in Pose Mode)")
        layout.prop(settings, "medium")
        if settings.medium == "OWN":
            layout.prop(settings, "own_density")
        layout.prop(settings, "wind")
        if settings.wind is None:
            layout.prop(settings, "flow")
        layout.prop(settings, "simulated")
        if settings.simulated:
            layout.prop(settings, "resolution")
        for name in ("density", "floats", "objective", "follow", "strength"):
            layout.prop(settings, name)
        try:
            job = job_of(settings, engine_of(context)) if settings.folder else None
        except ERRORS as error:
            layout.label(text=str(error), icon="ERROR")
            job = None
        if job is None or job.state not in ACTIVE:
            layout.operator(FlowborneRun.bl_idname)
        if job is None:
            return
        for line in line_of(job).split("\n"):
            layout.label(text=line, icon="ERROR" if job.state is State.FAILED else "NONE")
        for warning in job.warnings:
            layout.label(text=warning, icon="ERROR")
        if job.state in ACTIVE:
            layout.operator(FlowborneCancel.bl_idname)
        elif job.state is not State.DONE:
            layout.operator(FlowborneRun.bl_idname, text="Resume").resume = True
        layout.operator_menu_enum(FlowborneBake.bl_idname, "bones")


CLASSES = (
    FlowborneSettings,
    FlowbornePreferences,
    FlowborneRun,
    FlowborneCancel,
    FlowborneBake,
    FlowbornePanel,
)


def register() -> None:
    """Register all classes, and the settings of objects."""
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Object.flowborne = PointerProperty(type=FlowborneSettings)


def unregister() -> None:
    """End the runs of this session, and unregister everything."""
    for job in JOBS.values():
        job.close()
    JOBS.clear()
    del bpy.types.Object.flowborne
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
