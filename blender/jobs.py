# SPDX-License-Identifier: GPL-3.0-or-later
"""The jobs of this session, and those in the folders next to the .blend."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import bpy

from .character import armature_of, export_character, reaction_of
from .environment import Install, engine_command
from .job import CHARACTER, Job
from .motion import MotionError
from .process import JobError
from .reaction import ReactionError

ERRORS = (JobError, MotionError, ReactionError)

JOBS: dict[str, Job | Install] = {}
"""Folder -> job of this session."""


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
    job = Job(command, folder_of(armature, max(numbers, default=0) + 1), reaction)
    first = reaction.first - (0 if reaction.loop else reaction.lead)
    export_character(context, armature, job.folder / CHARACTER, first, context.scene.frame_end)
    job.start(only_check)
    settings.folder = relative(job.folder)
    JOBS[str(job.folder)] = job
    return job


def start_install(context: Any) -> Install:
    """Start to make an environment, in the folder that Blender keeps for the extension.

    raises  JobError when Blender is offline, or this cannot work
    """
    if not bpy.app.online_access:
        raise JobError(
            "online access is off, and pip downloads what flowborne needs: allow it (Preferences, "
            "System, Network, Allow Online Access), or name an environment that has flowborne"
        )
    if any(job.active for job in JOBS.values()):
        raise JobError("a job is in progress: wait for its end, or cancel it")
    install = install_of()
    install.start(bpy.path.abspath(preferences_of(context).source))
    return install


def install_of() -> Install:
    """The installation of this session."""
    folder = bpy.utils.extension_path_user(__package__, path="environment")
    install = JOBS.setdefault(folder, Install(Path(folder)))
    assert isinstance(install, Install)
    return install


def folder_of(armature: Any, number: int) -> Path:
    """The folder of a job of an armature, next to the .blend."""
    blend = Path(bpy.data.filepath)
    plain = re.sub(r"[^\w-]", "-", armature.name)
    return blend.with_name(f"{blend.stem}-flowborne") / f"{plain}-{number}"


def relative(folder: Path) -> str:
    """A folder as a path from that of the .blend."""
    return str(bpy.path.relpath(str(folder)))


def folders_of(armature: Any) -> dict[int, Path]:
    """Number -> folder of the jobs of an armature next to the .blend, in the order of numbers."""
    plain = folder_of(armature, 0)
    start = plain.name[:-1]
    ends = [path.name.removeprefix(start) for path in plain.parent.glob(f"{start}*")]
    return {n: folder_of(armature, n) for n in sorted(int(end) for end in ends if end.isdecimal())}


def job_of(settings: Any, engine: str) -> Job:
    """The last job of an armature, also one of an earlier session. Raises one of ERRORS."""
    if not settings.folder:
        raise ReactionError("this armature has no run: start one")
    return job_in(Path(bpy.path.abspath(settings.folder)), engine)


def job_in(folder: Path, engine: str) -> Job:
    """The job of a folder, also one of an earlier session. Raises one of ERRORS."""
    job = JOBS.get(str(folder))
    if not isinstance(job, Job):
        job = JOBS[str(folder)] = Job.load(engine_command(engine) if engine else (), folder)
    job.step()  # its operator ends when another file is opened
    return job


def preferences_of(context: Any) -> Any:
    """The preferences of the extension; None where it is not installed as one."""
    addon = context.preferences.addons.get(__package__)
    return None if addon is None else addon.preferences


def engine_of(context: Any) -> str:
    """The environment from the preferences."""
    preferences = preferences_of(context)
    return "" if preferences is None else preferences.engine
