"""A click on a warning selects the bones that it names; its tooltip is the whole warning."""

from types import SimpleNamespace

from blender.panel import FlowborneSelect
from blender.presets import named_in

from stage import bpy, character, new_scene, select

new_scene()
rig = character()
select(rig, "trunk")
text = "[domain]: tip is 0.016 m thick, 1.6 cells (tail too), and below 2 cells"
assert bpy.ops.flowborne.select(text=text) == {"FINISHED"}
assert {bone.name for bone in rig.pose.bones if bone.select} == {"tail", "tip"}
assert FlowborneSelect.description(bpy.context, SimpleNamespace(text=text)) == text
names = ["tail", "tail.001", "tail-a", "hair 2"]
assert [*named_in("joint 'tail.001' and hair 2, tail.", names)] == ["tail", "tail.001", "hair 2"]
assert [*named_in("tail.001, tail-a, tails", names)] == ["tail.001", "tail-a"]
