"""A force field that is no uniform wind is refused with the remedy."""

from blender.character import flow_of
from blender.reaction import ReactionError

from stage import bpy, character, message, new_scene

new_scene()
rig = character()
for kind, said in (("TURBULENCE", "Turbulence"), ("VORTEX", "Vortex")):
    bpy.ops.object.effector_add(type=kind)
    rig.flowborne.wind = bpy.context.object
    assert f"is {said}, but the flow of a run is uniform" in message(
        ReactionError, flow_of, rig.flowborne
    )
rig.flowborne.wind.field.type = "NONE"
assert "choose an object with a Wind field" in message(ReactionError, flow_of, rig.flowborne)
rig.flowborne.wind = None
assert flow_of(rig.flowborne) == (0.0, 8.0, 0.0)
