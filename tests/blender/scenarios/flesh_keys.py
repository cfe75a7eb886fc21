"""Flesh leaves mesh, shape keys and other modifiers as they are; one undo takes it back."""

import numpy as np

from stage import CLOSE, add_skin, bake, bpy, character, new_scene, recorded, select, shown, skin_of

scene = new_scene()
rig = character()
body = bpy.data.objects["rig body"]
body.shape_key_add(name="Basis")
wide = body.shape_key_add(name="wide")
for n, point in enumerate(wide.data):
    point.co.x += 0.05 * np.sin(n)
body.data.shape_keys.name = "keys"
for frame in (1, 12):
    wide.value = (frame - 1) / 11.0
    wide.keyframe_insert("value", frame=frame)
run = recorded(rig)
own = add_skin(rig, run)
select(rig)
bpy.ops.ed.undo_push(message="before")


def facts():
    """What belongs to the user: the mesh, its keys and groups, the modifiers' names."""
    body = bpy.data.objects["rig body"]
    keys = body.data.shape_keys
    return (
        [tuple(vertex.co) for vertex in body.data.vertices],
        [[tuple(point.co) for point in block.data] for block in keys.key_blocks],
        [*body.data.attributes.keys()],
        [*body.vertex_groups.keys()],
        keys.animation_data.action.name,
        {*bpy.data.objects.keys()},
    )


before, names = facts(), [modifier.name for modifier in body.modifiers]
counts = [len(kind) for kind in (bpy.data.meshes, bpy.data.objects, bpy.data.node_groups)]
assert bpy.ops.flowborne.flesh() == {"FINISHED"}
bpy.ops.ed.undo_push(message="flesh")
after = facts()
assert after[:5] == before[:5]
bake(rig)
free = np.array(shown(body, 1))[own]
assert np.abs(free - skin_of(run, 0)).max() < CLOSE

# The key adds to the flesh: in the axes that the armature then deforms.
body.modifiers["Armature"].show_viewport = False
moved = {frame: shown(body, frame) for frame in (5, 12)}
body.modifiers[0].show_viewport = False
plain = {frame: shown(body, frame) for frame in moved}
body.modifiers[0].show_viewport = True
wide.id_data.animation_data.action = None
wide.value = 0.0
basis = np.array([vertex.co for vertex in body.data.vertices])
for frame, points in moved.items():
    apart = points - plain[frame] - (shown(body, frame) - basis)
    assert np.abs(apart).max() < CLOSE
    assert np.abs(plain[frame] - basis).max() > 0.01

bpy.ops.ed.undo()
body = bpy.data.objects["rig body"]
assert facts() == before
assert [modifier.name for modifier in body.modifiers] == names
assert [len(kind) for kind in (bpy.data.meshes, bpy.data.objects, bpy.data.node_groups)] == counts

# A new mesh with modifiers in front of the armature's, and an armature that preserves volume.
rig = bpy.data.objects["rig"]
body.shape_key_clear()
body.modifiers["Armature"].use_deform_preserve_volume = True
mirror = body.modifiers.new("Mirror", "MIRROR")
mirror.use_mirror_merge = False
body.modifiers.move(1, 0)
body.modifiers.new("Smooth", "SUBSURF").levels = 0
select(rig)
assert bpy.ops.flowborne.flesh() == {"FINISHED"}
bake(rig)
assert [modifier.type for modifier in body.modifiers] == ["MIRROR", "NODES", "ARMATURE", "SUBSURF"]
for k in (0, 4, 11):
    drawn = shown(body, 1 + k)
    assert len(drawn) == 2 * len(body.data.vertices)
    assert np.abs(drawn[own] - skin_of(run, k)).max() < CLOSE
