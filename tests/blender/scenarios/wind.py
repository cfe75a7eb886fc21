"""The flow is along z of a Wind empty with its strength, or the vector of the panel."""

import math

import numpy as np
from blender.character import flow_of

from stage import bpy, character, new_scene

new_scene()
rig = character()
rig.flowborne.flow = 1.0, 2.0, 3.0
assert flow_of(rig.flowborne) == (1.0, 2.0, 3.0)
bpy.ops.object.effector_add(type="WIND", rotation=(math.radians(90), 0.0, 0.0))
wind = bpy.context.object
wind.scale = 2.0, 2.0, 2.0
wind.field.strength = 7.0
bpy.context.view_layer.update()
rig.flowborne.wind = wind
assert np.abs(np.array(flow_of(rig.flowborne)) - (0.0, -7.0, 0.0)).max() < 1e-5
