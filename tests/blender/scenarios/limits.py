"""Limit Rotation in local space gives the cone of a free bone; other limits are refused."""

import math

from blender.character import cone_of, reaction_of
from blender.reaction import ReactionError

from stage import bpy, character, message, new_scene, select

new_scene()
rig = character()
bone = rig.pose.bones["tail"]
assert cone_of(bone) is None
limit = bone.constraints.new("LIMIT_ROTATION")
limit.owner_space = "LOCAL"
assert cone_of(bone) is None
limit.use_limit_x, limit.min_x, limit.max_x = True, math.radians(-40), math.radians(60)
limit.use_limit_z, limit.min_z, limit.max_z = True, math.radians(-90), math.radians(25)
assert abs(cone_of(bone) - 25.0) < 1e-4
select(rig, "tail", "tip")
assert {
    name: round(cone, 3)
    for name, cone in reaction_of(bpy.context, rig, rig.flowborne).cones.items()
} == {"tail": 25.0}
limit.min_z = 0.0
for space, said in (("LOCAL", "locks an axis"), ("WORLD", "is not Local Space")):
    limit.owner_space = space
    assert said in message(ReactionError, cone_of, bone)
limit.mute = True
assert cone_of(bone) is None
