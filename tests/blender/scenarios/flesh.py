"""Flesh moves the mesh as in the run, with an armature in any place, linear between frames."""

import numpy as np

from stage import (
    CLOSE,
    FOLDER,
    JOINTS,
    add_skin,
    bake,
    bpy,
    character,
    new_scene,
    place,
    recorded,
    select,
    shown,
    skin_of,
)

UNIT = 0.5

scene = new_scene(11, 22)
scene.unit_settings.scale_length = UNIT
rig = character()
place(rig)
body = bpy.data.objects["rig body"]
body.data.materials.append(bpy.data.materials.new("hide"))
run = recorded(rig, unit=UNIT)
own = add_skin(rig, run, UNIT)
size = 2.5 * JOINTS[-1]
before = {frame: shown(body, frame) for frame in (11, 15)}


def check(bones: bool = True) -> None:
    """The mesh behind the trunk is the skin of the run in every frame."""
    for k in range(scene.frame_end - scene.frame_start + 1):
        apart = np.abs(shown(body, 11 + k)[own] - skin_of(run, k, UNIT)).max()
        assert (apart < CLOSE * size) == bones, f"frame {k}: {apart:.2g} apart"


def strengthen(value: float) -> None:
    """Set Strength in the modifier, in which Blender 5.3 has inputs elsewhere than 5.0."""
    modifier = body.modifiers[0]
    items = modifier.node_group.interface.items_tree
    (key,) = (item.identifier for item in items if item.name == "Strength")
    if hasattr(modifier, "properties"):
        getattr(modifier.properties.inputs, key).value = value
    else:
        modifier[key] = value


select(rig)
assert bpy.ops.flowborne.flesh() == {"FINISHED"}
assert [modifier.type for modifier in body.modifiers] == ["NODES", "ARMATURE"]
check(bones=False)  # they follow the animation, and the flesh goes with them
bake(rig)
check()
assert bpy.ops.flowborne.flesh() == {"FINISHED"}
assert len(body.modifiers) == 2
check()
trunk = np.array([vertex.co.y for vertex in body.data.vertices]) < 0.7
for frame, points in before.items():
    assert np.abs(shown(body, frame)[trunk] - points[trunk]).max() < CLOSE * size

body.modifiers["Armature"].show_viewport = False
for low, share in ((11, 0.25), (15, 0.5), (21, 0.75)):
    ends = [shown(body, frame) for frame in (low, low + 1)]
    between = (1.0 - share) * ends[0] + share * ends[1]
    assert np.abs(shown(body, low + share) - between).max() < CLOSE * size
for frame, held in ((3, 11), (40, 22)):
    assert np.abs(shown(body, frame) - shown(body, held)).max() < CLOSE * size
still = shown(body, 15)
strengthen(0.0)
body.update_tag()
plain = np.array([body.matrix_world @ vertex.co for vertex in body.data.vertices])
assert np.abs(shown(body, 15) - plain).max() < CLOSE * size < np.abs(still - plain).max()
strengthen(1.0)
body.modifiers["Armature"].show_viewport = True

bpy.ops.wm.save_mainfile()
bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "shot.blend"))
scene, body = bpy.context.scene, bpy.data.objects["rig body"]
check()
assert body.active_material.name == "hide"
