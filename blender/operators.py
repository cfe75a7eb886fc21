# SPDX-License-Identifier: GPL-3.0-or-later
"""What the buttons of the panel do."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from .bake import bake, turned_away
from .character import armature_of, control_of, selected_bones
from .environment import Install, engine_command
from .flesh import add_flesh
from .forces import add_forces
from .ghost import remove_ghosts, show_ghost
from .ink import add_ink
from .job import Job
from .jobs import (
    ERRORS,
    JOBS,
    engine_of,
    folder_of,
    job_of,
    preferences_of,
    relative,
    start_install,
    start_job,
)
from .motion import Motion, read_motion, read_skin
from .presets import PRESETS, named_in, preset
from .process import State
from .reaction import ReactionError

PERIOD = 0.5
"""s between looks at a job."""


@contextmanager
def _reported(operator: Any) -> Iterator[None]:
    """Context in which an error of ours is reported to the user."""
    try:
        yield
    except ERRORS as error:
        operator.report({"ERROR"}, str(error))


class _Watch:
    """A modal operator that looks after a job until it ends. Escape cancels the job."""

    report: Callable[..., None]

    def _watch(self, context: Any, job: Job | Install, armature: str = "") -> set[str]:
        manager, self._job, self._armature = context.window_manager, job, armature
        self._timer = manager.event_timer_add(PERIOD, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        job = self._job
        if event.type == "ESC":
            job.cancel()
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        job.step()
        for area in context.screen.areas if context.screen else ():
            area.tag_redraw()
        things = bpy.data.objects
        if isinstance(job, Job) and job.state is State.RUNNING and self._armature in things:
            show_ghost(context, things[self._armature], job)
        if job.active:
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        if isinstance(job, Job):
            remove_ghosts(job)
            if job.state is State.EXPORTED:
                with _reported(self):
                    add_ink(context, job)
        elif job.state is State.DONE:
            preferences_of(context).engine = str(job.folder)
            context.preferences.is_dirty = True
        self.report({"ERROR" if job.state is State.FAILED else "INFO"}, job.line)
        return {"FINISHED"}


class FlowborneInstall(_Watch, bpy.types.Operator):
    """Make an environment with Blender's Python, and install flowborne in it. Escape cancels"""

    bl_idname = "flowborne.install"
    bl_label = "Make Environment"

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            return self._watch(context, start_install(context))
        return {"CANCELLED"}


class FlowborneRun(_Watch, bpy.types.Operator):
    """Compute how the selected bones react. Escape cancels"""

    bl_idname = "flowborne.run"
    bl_label = "Run"

    resume: BoolProperty(options={"SKIP_SAVE"})
    only_check: BoolProperty(options={"SKIP_SAVE"})

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            if self.resume:
                job = _last(context)[1]
                job.engine = engine_command(engine_of(context))
                job.start()
            else:
                job = start_job(context, engine_of(context), self.only_check)
            return self._watch(context, job, armature_of(context).name)
        return {"CANCELLED"}


class FlowborneInk(_Watch, bpy.types.Operator):
    """Write the ink of the run to files, and add a volume object that plays them. Escape cancels"""

    bl_idname = "flowborne.ink"
    bl_label = "Show Ink"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender's way

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            job = _last(context)[1]
            job.engine = engine_command(engine_of(context))
            job.start_export()
            return self._watch(context, job)
        return {"CANCELLED"}


class FlowborneCancel(bpy.types.Operator):
    """Stop this job. A run stops after its last whole frame, and can be resumed"""

    bl_idname = "flowborne.cancel"
    bl_label = "Cancel"

    folder: StringProperty(options={"HIDDEN"})

    def execute(self, context: Any) -> set[str]:
        if self.folder in JOBS:
            JOBS[self.folder].cancel()
        return {"FINISHED"}


def _last(context: Any) -> tuple[Any, Job]:
    """The active armature and its last job. Raises one of ERRORS."""
    armature = armature_of(context)
    return armature, job_of(armature.flowborne, engine_of(context))


def _result(context: Any) -> tuple[Any, Job, Motion]:
    """The active armature, its last job, and what it gives. Raises one of ERRORS."""
    armature, job = _last(context)
    return armature, job, read_motion(job.run).after(job.reaction.lead, job.reaction.loop)


class FlowborneForces(bpy.types.Operator):
    """Add the forces on the bodies as points with attributes, and arrows by geometry nodes"""

    bl_idname = "flowborne.forces"
    bl_label = "Show Forces"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender's way

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            armature, job, motion = _result(context)
            add_forces(context, armature, motion, job.reaction.first, job.reaction.unit)
            return {"FINISHED"}
        return {"CANCELLED"}


class FlowborneFlesh(bpy.types.Operator):
    """Let the flesh of the run move the mesh, by a modifier in front of the armature's"""

    bl_idname = "flowborne.flesh"
    bl_label = "Show Flesh"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender's way

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            armature, job = _last(context)
            reaction = job.reaction
            motion, skin = read_motion(job.run, reaction.lead), read_skin(job.run, reaction.lead)
            first, unit = reaction.first, reaction.unit
            moved = add_flesh(context, armature, motion, skin, reaction.bones, first, unit)
            self.report({"INFO"}, f"flesh moves {', '.join(mesh.name for mesh in moved)}")
            return {"FINISHED"}
        return {"CANCELLED"}


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
            armature, job, motion = _result(context)
            reaction = job.reaction
            chosen = {
                "FREE": lambda: [*motion.moving[: reaction.floats], *reaction.bones],
                "SELECTED": lambda: [bone.name for bone in selected_bones(armature)],
                "ALL": lambda: motion.moving,
            }[self.bones]()
            thin = math.degrees(self.thin)
            strip = bake(context, armature, motion, reaction.first, reaction.unit, chosen, thin)
            done = f"baked {len(chosen)} bones to '{strip.name}'"
            if reaction.loop and job.frames_done >= reaction.frames:
                done += f"; the ends of the loop are {motion.ends_apart(chosen):.2g}° apart"
            away = turned_away(context, armature, motion, reaction.first, chosen)
            if away and not thin:
                turned = ", ".join(f"{name} by {angle:.2g}°" for name, angle in away.items())
                done += (
                    f"; constraints or drivers turn bones away from the run: {turned}. Mute them"
                )
            self.report({"WARNING" if away and not thin else "INFO"}, done)
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
    """Select these pose bones alone, or the controls whose place they copy."""
    chosen = [control_of(armature.pose.bones[name]) for name in names]
    for bone in armature.pose.bones:
        bone.select = bone in chosen
    armature.data.bones.active = chosen[0].bone


class FlowborneChoose(bpy.types.Operator):
    """Show this run, to bake or resume it"""

    bl_idname = "flowborne.choose"
    bl_label = "Choose"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - Blender's way

    number: IntProperty(options={"HIDDEN"})

    def execute(self, context: Any) -> set[str]:
        with _reported(self):
            armature = armature_of(context)
            armature.flowborne.folder = relative(folder_of(armature, self.number))
            return {"FINISHED"}
        return {"CANCELLED"}
