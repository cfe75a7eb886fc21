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
from .presets import PRESETS, named_in, preset
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


def start_job(context: Any, engine: str, only_check: bool = False) -> Job:
    """Export the active character, and start its run, or only a check of its scene, in a new folder
    next to the .blend.

    raises  one of ERRORS
    """
    armature = armature_of(context)
    settings = armature.flowborne
    command = engine_command(engine)
    reaction = reaction_of(context, armature, settings)
    if not bpy.data.filepath:
        raise ReactionError("the run is written next to the .blend file: save it first")
    numbers = folders_of(armature)
    job = Job(command, _folder(armature, max(numbers, default=0) + 1), reaction)
    earlier = 0 if reaction.loop else reaction.lead
    export_character(context, armature, job.folder / CHARACTER, earlier)
    job.start(only_check)
    settings.folder = _relative(job.folder)
    JOBS[str(job.folder)] = job
    return job


def _folder(armature: Any, number: int) -> Path:
    blend = Path(bpy.data.filepath)
    plain = re.sub(r"[^\w-]", "-", armature.name)
    return blend.with_name(f"{blend.stem}-flowborne") / f"{plain}-{number}"


def _relative(folder: Path) -> str:
    return str(bpy.path.relpath(str(folder)))


def folders_of(armature: Any) -> dict[int, Path]:
    """Number -> folder of the jobs of an armature next to the .blend, in the order of numbers."""
    plain = _folder(armature, 0)
    start = plain.name[:-1]
    ends = [path.name.removeprefix(start) for path in plain.parent.glob(f"{start}*")]
    return {n: _folder(armature, n) for n in sorted(int(end) for end in ends if end.isdecimal())}


def job_of(settings: Any, engine: str) -> Job:
    """The last job of an armature, also one of an earlier session. Raises one of ERRORS."""
    if not settings.folder:
        raise ReactionError("this armature has no run: start one")
    return job_in(Path(bpy.path.abspath(settings.folder)), engine)


def job_in(folder: Path, engine: str) -> Job:
    """The job of a folder, also one of an earlier session. Raises one of ERRORS."""
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
    only_check: BoolProperty(options={"SKIP_SAVE"})

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            if self.resume:
                self._job = job_of(armature_of(context).flowborne, engine_of(context))
                self._job.engine = engine_command(engine_of(context))
                self._job.start()
            else:
                self._job = start_job(context, engine_of(context), self.only_check)
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
    thin: FloatProperty(
        name="Thin Keys",
        description="Leave keys out where a rotation changes by no more than this; 0 keeps all",
        subtype="ANGLE",
        min=0.0,
    )

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            armature = armature_of(context)
            job = job_of(armature.flowborne, engine_of(context))
            reaction = job.reaction
            motion = read_motion(job.run).after(reaction.lead, reaction.loop)
            chosen = {
                "FREE": [*motion.moving[: reaction.floats], *reaction.bones],
                "SELECTED": [bone.name for bone in armature.pose.bones if bone.select],
                "ALL": motion.moving,
            }[self.bones]
            place, thin = (reaction.first, reaction.unit), math.degrees(self.thin)
            strip = bake(context, armature, motion, *place, chosen, thin)
            done = f"baked {len(chosen)} bones to '{strip.name}'"
            if reaction.loop and job.frames_done >= reaction.frames:
                done += f"; the ends of the loop are {motion.ends_apart(chosen):.2g}° apart"
            self.report({"INFO"}, done)
            return {"FINISHED"}
        return {"CANCELLED"}


class FlowbornePreset(bpy.types.Operator):
    """Select the bones whose names say that they are of this kind"""

    bl_idname = "flowborne.preset"
    bl_label = "Select by Name"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender's way

    kind: EnumProperty(
        name="Kind",
        items=[(key, key.capitalize(), ", ".join(words)) for key, words in PRESETS.items()],
    )

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            armature = armature_of(context)
            can_react = [
                bone.name for bone in armature.data.bones if bone.use_deform and bone.parent
            ]
            found = preset(can_react, self.kind)
            if not found:
                raise ReactionError(
                    f"no deforming bone below the root of '{armature.name}' has one of these words "
                    f"in its name: {', '.join(PRESETS[self.kind])}. Select bones in Pose Mode"
                )
            _select(armature, found)
            self.report({"INFO"}, f"selected {', '.join(found)}")
            return {"FINISHED"}
        return {"CANCELLED"}


class FlowborneSelect(bpy.types.Operator):
    """Select the bones that a warning names"""

    bl_idname = "flowborne.select"
    bl_label = "Select"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender's way

    text: StringProperty(options={"HIDDEN"})

    @classmethod
    def description(cls, context: Any, properties: Any) -> str:
        return str(properties.text)

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            armature = armature_of(context)
            _select(armature, [*named_in(self.text, armature.data.bones.keys())])
            return {"FINISHED"}
        return {"CANCELLED"}


def _select(armature: Any, names: list[str]) -> None:
    """Select these pose bones alone, and make the first one active."""
    for bone in armature.pose.bones:
        bone.select = bone.name in names
    armature.data.bones.active = armature.data.bones[names[0]]


class FlowborneChoose(bpy.types.Operator):
    """Show this run, to bake or resume it"""

    bl_idname = "flowborne.choose"
    bl_label = "Choose"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender's way

    number: IntProperty(options={"HIDDEN"})

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            armature = armature_of(context)
            armature.flowborne.folder = _relative(_folder(armature, self.number))
            return {"FINISHED"}
        return {"CANCELLED"}


def line_of(job: Job) -> str:
    """The state of a job in one line, or its message."""
    if job.message:
        return job.message
    left, said = job.seconds_left, job.state.value
    if job.state is not State.CHECKED:
        said += f", frame {job.frames_done}/{job.reaction.frames}"
    if left is not None:
        return f"{said}, {left:.0f} s left"
    return f"{said}: {job.cost}" if job.cost and job.state is not State.DONE else said


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
        for name in ("density", "floats", "objective", "follow", "strength", "rounds"):
            layout.prop(settings, name)
        if settings.rounds == 1:
            layout.prop(settings, "preroll")
        try:
            job = job_of(settings, engine_of(context)) if settings.folder else None
        except ERRORS as error:
            layout.label(text=str(error), icon="ERROR")
            job = None
        if job is None or job.state not in ACTIVE:
            layout.operator(FlowborneRun.bl_idname)
            layout.operator(FlowborneRun.bl_idname, text="Check").only_check = True
        if job is None:
            return
        for line in line_of(job).split("\n"):
            layout.label(text=line, icon="ERROR" if job.state is State.FAILED else "NONE")
        for warning in job.warnings:
            if any(named_in(warning, armature.data.bones.keys())):
                layout.operator(FlowborneSelect.bl_idname, text=warning).text = warning
            else:
                layout.label(text=warning, icon="ERROR")
        if job.state in ACTIVE:
            layout.operator(FlowborneCancel.bl_idname)
        elif job.state is not State.DONE:
            layout.operator(FlowborneRun.bl_idname, text="Resume").resume = True
        layout.operator_menu_enum(FlowborneBake.bl_idname, "bones")


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
            line, *_ = line_of(job).split("\n")
            name = FlowborneChoose.bl_idname
            row = self.layout.operator(
                name, text=f"{folder.name}: {line}", depress=str(folder) == chosen
            )
            row.number = number


CLASSES = (
    FlowborneSettings,
    FlowbornePreferences,
    FlowborneRun,
    FlowborneCancel,
    FlowborneBake,
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


def unregister() -> None:
    """End the runs of this session, and unregister everything."""
    for job in JOBS.values():
        job.close()
    JOBS.clear()
    del bpy.types.Object.flowborne
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
