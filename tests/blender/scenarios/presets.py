"""A preset selects the deforming bones below the root whose names have its words."""

from blender.presets import PRESETS, preset

from stage import bpy, character, new_scene, refusal

NAMES = {
    "HAIR": ["hair_back.L", "Ponytail02", "HairStrand", "Bangs"],
    "TAIL": ["tail", "DEF-Tail.003", "FoxTail1"],
    "WING": ["wing.L", "LeftWing", "primary_feathers.001"],
    "ARMS": ["DEF-upper_arm.L", "mixamorig:LeftForeArm", "forearm.R", "upperarm_l", "hand.L"],
    "SPINE": ["spine.001", "Spine2", "chest", "UPPER_CHEST"],
    "SOFT": ["belly", "ear.L", "DEF-breast.R"],
}
EACH = [name for names in NAMES.values() for name in names] + [
    "Armor",
    "handle",
    "tailor",
    "neck",
    "heart",
]
assert {which: preset(EACH, which) for which in PRESETS} == NAMES

new_scene()
rig = character()
assert bpy.ops.flowborne.preset(kind="TAIL") == {"FINISHED"}
assert [bone.name for bone in rig.pose.bones if bone.select] == ["tail"]
assert rig.data.bones.active.name == "tail"
said = refusal(rig, "preset", kind="WING")
assert "no deforming bone below the root of 'rig'" in said, said
assert "feather" in said
rig.data.bones["tail"].use_deform = False
assert "no deforming bone" in refusal(rig, "preset", kind="TAIL")
rig.data.bones["trunk"].name = "spine"
assert "no deforming bone" in refusal(rig, "preset", kind="SPINE")
