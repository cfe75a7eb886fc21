# SPDX-License-Identifier: GPL-3.0-or-later
"""The ink of a run as a volume object with a material."""

from __future__ import annotations

from typing import Any

import bpy
from mathutils import Matrix

from .job import Job
from .motion import read_motion

NAME = "flowborne ink"

DENSITY = 20.0
"""Density of the material where the flow is all ink, 1/m."""


def add_ink(context: Any, job: Job) -> Any:
    """A new volume object that plays the files of a job's `start_export`.

    It is where the bake is: of a cycle the last round, at the place of the first.
    """
    reaction, unit = job.reaction, job.reaction.unit
    skipped = reaction.lead if reaction.loop else 0
    motion = read_motion(job.run)
    turn, shift = motion.back(skipped)
    volume = bpy.data.volumes.new(NAME)
    first, *_ = sorted(job.volumes.parent.glob(f"{job.volumes.stem}_*.vdb"))
    volume.filepath = bpy.path.relpath(str(first))
    volume.is_sequence, volume.sequence_mode = True, "CLIP"
    volume.frame_start = reaction.first - reaction.lead + skipped
    volume.frame_offset = skipped - 1  # the first file has number 0
    volume.frame_duration = job.frames_done + 1 - skipped
    volume.grids.load()  # or there is no grid of this name
    volume.velocity_grid = "velocity"
    thing = bpy.data.objects.new(NAME, volume)
    thing.matrix_world = Matrix.Diagonal((1.0 / unit,) * 3).to_4x4() @ Matrix.LocRotScale(
        shift, Matrix(turn), None
    )
    volume.materials.append(_material(unit))
    context.scene.collection.objects.link(thing)
    return thing


def _material(unit: float) -> Any:
    """A material that is dark where there is ink; `unit` is m per unit of Blender."""
    material = bpy.data.materials.new(NAME)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    ink = nodes.new("ShaderNodeVolumePrincipled")
    ink.inputs["Density Attribute"].default_value = "dye"
    ink.inputs["Density"].default_value = DENSITY * unit
    ink.inputs["Color"].default_value = 0.1, 0.02, 0.15, 1.0
    output = nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(ink.outputs["Volume"], output.inputs["Volume"])
    return material
