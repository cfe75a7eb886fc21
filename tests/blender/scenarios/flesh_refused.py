"""What flesh cannot do is said with the remedy; a new run starts from the mesh without flesh."""

import numpy as np
from blender.character import reaction_of
from blender.stand_in import stand_in

from stage import add_skin, bpy, character, new_scene, recorded, refusal, select, shown

new_scene()
rig = character()
body = bpy.data.objects["rig body"]
run = recorded(rig)
assert "choose it in Flesh, and start a new run" in refusal(rig, "flesh")
add_skin(rig, run)
select(rig, "tail")
plain = shown(body, 3)
assert bpy.ops.flowborne.flesh() == {"FINISHED"}
with stand_in(bpy.context, rig, [body], "copy") as (_, scene):
    (copy,) = (each for each in scene.objects if each.type == "MESH")
    assert [modifier.type for modifier in copy.modifiers] == ["ARMATURE"]

body.modifiers.clear()
body.parent_type = "ARMATURE"
assert "mesh 'rig body' is bound to the armature by its parent: give it an" in refusal(rig, "flesh")
body.parent_type = "OBJECT"
body.modifiers.new("Armature", "ARMATURE").object = rig
assert np.abs(shown(body, 3) - plain).max() < 1e-6
other = body.copy()  # a mesh without weights for flesh needs no modifier
bpy.context.scene.collection.objects.link(other)
other.data = body.data.copy()
other.vertex_groups.clear()
other.modifiers.clear()
other.parent_type = "ARMATURE"
assert bpy.ops.flowborne.flesh() == {"FINISHED"}
assert (len(body.modifiers), len(other.modifiers)) == (2, 0)
body.modifiers.remove(body.modifiers[0])
for name in ("tail", "tip"):
    body.vertex_groups.remove(body.vertex_groups[name])
assert "no visible mesh of armature 'rig' has weights for tail, tip" in refusal(rig, "flesh")
assert [modifier.type for modifier in body.modifiers] == ["ARMATURE"]
rig.data.bones["tip"].name = "end"
assert "armature 'rig' has no bone 'tip' of the run: rename it back" in refusal(rig, "flesh")

select(rig, "tail")
settings = rig.flowborne
found = reaction_of(bpy.context, rig, settings)
assert (found.young, found.follows) == (0.0, False)
settings.flesh, settings.stiffness, settings.objective = "FOLLOW", 20.0, "least-drag"
settings.flow = 0.0, 0.0, 0.0
found = reaction_of(bpy.context, rig, settings)
assert (found.young, found.follows) == (20e3, True)
settings.flesh = "REACT"
settings.objective = "effort"
assert not reaction_of(bpy.context, rig, settings).follows
