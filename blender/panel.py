# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel, in the sidebar of the 3D view, and the preferences of the extension."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import PointerProperty, StringProperty

from .character import armature_of, is_selected
from .environment import Install
from .ghost import remove_stale
from .job import Job
from .jobs import ERRORS, JOBS, engine_of, folders_of, install_of, job_in, job_of
from .operators import (
    FlowborneBake,
    FlowborneCancel,
    FlowborneChoose,
    FlowborneFlesh,
    FlowborneForces,
    FlowborneInk,
    FlowborneInstall,
    FlowbornePreset,
    FlowborneRun,
    FlowborneSelect,
)
from .presets import named_in
from .process import State
from .reaction import ReactionError
from .settings import FlowborneSettings


class FlowbornePreferences(bpy.types.AddonPreferences):
    """Where flowborne is installed."""

    bl_idname = __package__

    engine: StringProperty(
        name="Environment",
        description="Folder of the Python environment in which flowborne is installed",
        subtype="DIR_PATH",
    )
    source: StringProperty(
        name="Install From",
        description="Folder or wheel of flowborne, for Make Environment",
        subtype="FILE_PATH",
    )

    def draw(self, context: Any) -> None:
        self.layout.prop(self, "engine")
        self.layout.prop(self, "source")
        install = install_of()
        if install.active:
            self.layout.operator(FlowborneCancel.bl_idname).folder = str(install.folder)
        else:
            self.layout.operator(FlowborneInstall.bl_idname)
        show_line(self.layout, install)


def show_line(layout: Any, job: Job | Install) -> None:
    """Draw the state of a job, or its message."""
    for line in job.line.split("\n") if job.state is not State.NEW else ():
        layout.label(text=line, icon="ERROR" if job.state is State.FAILED else "NONE")


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
        free = sum(map(is_selected, armature.pose.bones))
        layout.label(text=f"{armature.name}: {free} free bones (selected in Pose Mode)")
        layout.operator_menu_enum(FlowbornePreset.bl_idname, "kind")
        layout.prop(settings, "medium")
        if settings.medium == "OWN":
            layout.prop(settings, "own_density")
        layout.prop(settings, "wind")
        if settings.wind is None:
            layout.prop(settings, "flow")
        layout.prop(settings, "simulated")
        if settings.simulated:
            layout.prop(settings, "resolution")
            layout.prop(settings, "ink")
        layout.prop(settings, "flesh")
        if settings.flesh != "NONE":
            layout.prop(settings, "stiffness")
        steered = () if settings.flesh == "FOLLOW" else ("objective", "follow", "strength")
        for name in ("density", "floats", *steered, "rounds"):
            layout.prop(settings, name)
        if settings.rounds == 1:
            layout.prop(settings, "preroll")
        try:
            job = job_of(settings, engine_of(context)) if settings.folder else None
        except ERRORS as error:
            layout.label(text=str(error), icon="ERROR")
            job = None
        if job is None or not job.active:
            layout.operator(FlowborneRun.bl_idname)
            layout.operator(FlowborneRun.bl_idname, text="Check").only_check = True
        if job is None:
            return
        show_line(layout, job)
        for warning in job.warnings:
            if any(named_in(warning, armature.data.bones.keys())):
                layout.operator(FlowborneSelect.bl_idname, text=warning).text = warning
            else:
                layout.label(text=warning, icon="ERROR")
        if job.active:
            layout.operator(FlowborneCancel.bl_idname).folder = str(job.folder)
        elif not job.complete:
            layout.operator(FlowborneRun.bl_idname, text="Resume").resume = True
        layout.operator_menu_enum(FlowborneBake.bl_idname, "bones")
        layout.operator(FlowborneForces.bl_idname)
        if job.reaction.young:
            layout.operator(FlowborneFlesh.bl_idname)
        if job.reaction.ink and not job.active:
            layout.operator(FlowborneInk.bl_idname)


class FlowborneRunsPanel(bpy.types.Panel):
    """The runs of the active armature next to the .blend."""

    bl_label = "Runs"
    bl_idname = "FLOWBORNE_PT_runs"
    bl_parent_id = FlowbornePanel.bl_idname
    bl_category = FlowbornePanel.bl_category
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - Blender's way

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.object is not None and bool(bpy.data.filepath)

    def draw(self, context: Any) -> None:
        try:
            armature = armature_of(context)
        except ReactionError:
            return
        chosen = bpy.path.abspath(armature.flowborne.folder)
        for number, folder in folders_of(armature).items():
            try:
                job = job_in(folder, engine_of(context))
            except ERRORS as error:
                self.layout.label(text=str(error), icon="ERROR")
                continue
            line, *_ = job.line.split("\n")
            name = FlowborneChoose.bl_idname
            row = self.layout.operator(
                name, text=f"{folder.name}: {line}", depress=str(folder) == chosen
            )
            row.number = number


CLASSES = (
    FlowborneSettings,
    FlowbornePreferences,
    FlowborneInstall,
    FlowborneRun,
    FlowborneCancel,
    FlowborneBake,
    FlowborneForces,
    FlowborneFlesh,
    FlowborneInk,
    FlowbornePreset,
    FlowborneSelect,
    FlowborneChoose,
    FlowbornePanel,
    FlowborneRunsPanel,
)


def register() -> None:
    """Register all classes, and the settings of objects."""
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Object.flowborne = PointerProperty(type=FlowborneSettings)
    for handlers in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        handlers.append(remove_stale)


def unregister() -> None:
    """End the runs of this session, and unregister everything."""
    for job in JOBS.values():
        job.close()
    JOBS.clear()
    remove_stale()
    for handlers in (bpy.app.handlers.undo_post, bpy.app.handlers.redo_post):
        handlers.remove(remove_stale)
    del bpy.types.Object.flowborne
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
