"""A second run starts from the animation, not from the first bake, and leaves all as it was."""

from blender.character import export_character

from stage import FOLDER, bake, bpy, character, new_scene, recorded, select

scene = new_scene()
rig = character()
select(rig, "tail")
bpy.ops.object.mode_set(mode="POSE")
scene.frame_set(7)
export_character(bpy.context, rig, FOLDER / "first.glb", 1, 12)
assert (rig.mode, scene.frame_current) == ("POSE", 7)
assert [bone.name for bone in rig.pose.bones if bone.select] == ["tail"]
assert bpy.context.selected_objects == [rig]
recorded(rig)
bake(rig)
export_character(bpy.context, rig, FOLDER / "second.glb", 1, 12)
assert not rig.animation_data.nla_tracks[-1].mute


def numbers(name):
    content = (FOLDER / name).read_bytes()
    return content[20 + int.from_bytes(content[12:16], "little") :]


assert numbers("first.glb") == numbers("second.glb")
