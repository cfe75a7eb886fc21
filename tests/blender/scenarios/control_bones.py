"""Rigify: controls are selected and baked, and the deforming bones equal the run."""

import os
import time

import bpy
import numpy as np
from blender.bake import turned_away
from blender.character import reaction_of, selected_bones
from blender.jobs import start_job
from blender.motion import read_motion
from blender.process import IDLE, State
from blender.reaction import ReactionError
from blender.stand_in import parents_of

from stage import BONES, JOINTS, animation, bake, bind, curves, message, new_scene, select

DEFORMING = tuple(f"DEF-{bone}" for bone in BONES)


def generated(kind: str):
    """A rig that Rigify makes of three bones, the last two of this type, with a box bound to it."""
    meta = bpy.data.objects.new("meta", bpy.data.armatures.new("meta"))
    scene.collection.objects.link(meta)
    bpy.context.view_layer.objects.active = meta
    bpy.ops.object.mode_set(mode="EDIT")
    shown = meta.data.collections.new("Bones")
    shown.rigify_ui_row = 1
    parent = None
    for number, name in enumerate(BONES):
        edited = meta.data.edit_bones.new(name)
        edited.head, edited.tail = (0.0, JOINTS[number], 1.0), (0.0, JOINTS[number + 1], 1.0)
        edited.parent, parent = parent, edited
        edited.use_connect = number == 2
        shown.assign(edited)
    bpy.ops.object.mode_set(mode="OBJECT")
    meta.pose.bones["trunk"].rigify_type = "basic.super_copy"
    meta.pose.bones["tail"].rigify_type = kind
    assert bpy.ops.pose.rigify_generate() == {"FINISHED"}
    rig = bpy.context.object
    bpy.data.objects.remove(meta)
    bind(rig, DEFORMING)
    for frame in range(scene.frame_start, scene.frame_end + 1):
        control = rig.pose.bones["trunk"]
        control.rotation_quaternion = 1.0, 0.02 * frame, 0.0, 0.05 * frame
        control.location = 0.02 * frame, 0.0, 0.1
        control.keyframe_insert("rotation_quaternion", frame=frame)
        control.keyframe_insert("location", frame=frame)
    return rig


def check_as_in_run(rig):
    position, rotation = animation(rig)
    for name in DEFORMING[1:]:
        n = rig.pose.bones.find(name)
        places, axes = motion.of(name)
        assert np.abs(axes - rotation[:, n]).max() < 1e-5, name
        assert np.abs(places - position[:, n]).max() < 1e-4, name


new_scene(1, 8)
bpy.ops.preferences.addon_enable(module="rigify")
scene = bpy.context.scene
rig = generated("limbs.simple_tentacle")
assert parents_of(rig.data.bones) == {
    "DEF-trunk": "root",
    "root": "",
    "DEF-tail": "DEF-trunk",  # Rigify has ORG-trunk here, which is in the same place
    "DEF-tip": "DEF-tail",
}
bpy.ops.flowborne.preset(kind="TAIL")
assert [bone.name for bone in rig.pose.bones if bone.select] == ["tweak_tail"]
select(rig, "tip")
said = message(ReactionError, reaction_of, bpy.context, rig, rig.flowborne)
assert "bone 'tip' deforms nothing" in said, said
select(rig, "tweak_tail", "tweak_tip", "ORG-tip")  # the last is hidden
assert [bone.name for bone in selected_bones(rig)] == ["DEF-tail", "DEF-tip"]
rig.flowborne.density = 60.0
job = start_job(bpy.context, os.environ["FLOWBORNE_ENGINE"])
assert bpy.data.scenes[:] == [scene]
until = time.monotonic() + 300.0
while job.step() not in IDLE:
    time.sleep(0.02)
    assert time.monotonic() < until
assert job.state is State.DONE, job.message
motion = read_motion(job.run)
assert motion.moving == ("root", *DEFORMING[1:])  # the trunk is rigid with the root
before = curves(rig.animation_data.action)
strip = bake(rig)
baked = {path.split('"')[1] for path, _ in curves(strip.action)}
assert baked == {"tweak_tail", "tweak_tip", "tweak_tip.001"}
check_as_in_run(rig)
assert turned_away(bpy.context, rig, motion, 1, DEFORMING[1:]) == {}
assert curves(rig.animation_data.nla_tracks[0].strips[0].action) == before

folder = rig.flowborne.folder
rig = generated("basic.copy_chain")
rig.flowborne.folder = folder
select(rig)
strip = bake(rig)
assert {path.split('"')[1] for path, _ in curves(strip.action)} == {"tail", "tip"}
check_as_in_run(rig)

rig.pose.bones["tail"].constraints.new("LIMIT_ROTATION").use_limit_x = True
away = turned_away(bpy.context, rig, motion, 1, DEFORMING[1:])
assert away["DEF-tail"] > 1.0, away

bpy.ops.object.armature_wolf_metarig_add()
bpy.ops.pose.rigify_generate()
rig = bpy.context.object
rig.data.collections["DEF"].is_visible = True
select(rig, "DEF-spine.001")
said = message(ReactionError, reaction_of, bpy.context, rig, rig.flowborne)
assert "'DEF-spine.001' hangs on control 'MCH-torso.parent'" in said, said
select(rig, "DEF-ear.L")
assert reaction_of(bpy.context, rig, rig.flowborne).bones == ("DEF-ear.L",)
