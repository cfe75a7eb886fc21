"""One undo takes a bake back: strips, action, and the active action."""

import bpy

from stage import bake, character, new_scene, recorded

new_scene()
name = character().name
recorded(bpy.data.objects[name])
active = bpy.data.objects[name].animation_data.action.name
bpy.ops.ed.undo_push(message="before")
bake(bpy.data.objects[name])
bpy.ops.ed.undo_push(message="bake")
assert len(bpy.data.actions) == 2
bpy.ops.ed.undo()
data = bpy.data.objects[name].animation_data
assert data.action.name == active
assert not data.nla_tracks
assert len(bpy.data.actions) == 1
