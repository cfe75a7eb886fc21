"""IK limits give the cone of a free bone too; the smallest of all limits counts."""

import math

from blender.character import cone_of
from blender.reaction import ReactionError

from stage import character, message, new_scene

new_scene()
bone = character().pose.bones["tail"]
bone.ik_min_x, bone.ik_max_x = math.radians(-35.0), math.radians(50.0)
assert cone_of(bone) is None
bone.use_ik_limit_x = True
assert abs(cone_of(bone) - 35.0) < 1e-4
limit = bone.constraints.new("LIMIT_ROTATION")
limit.owner_space = "LOCAL"
limit.use_limit_z, limit.min_z, limit.max_z = True, math.radians(-60.0), math.radians(20.0)
assert abs(cone_of(bone) - 20.0) < 1e-4
bone.lock_ik_y = True
assert "bone 'tail': its Limit Rotation or IK limit locks an axis" in message(
    ReactionError, cone_of, bone
)
bone.lock_ik_y = False
bone.ik_max_x = 0.0
assert "excludes the rest pose" in message(ReactionError, cone_of, bone)
