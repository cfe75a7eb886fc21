"""Forces are points with attributes, and arrows at the present frame show them."""

import numpy as np

from stage import FOLDER, bpy, character, force_on, new_scene, recorded, refusal

FRAMES, UNIT = 12, 0.01

scene = new_scene(11, 22)
scene.unit_settings.scale_length = UNIT
rig = character()
assert "this armature has no run" in refusal(rig, "forces")
run = recorded(rig, unit=UNIT)
assert bpy.ops.flowborne.forces() == {"FINISHED"}
thing = bpy.data.objects["flowborne forces rig"]
assert len(thing.data.vertices) == 2 * FRAMES  # no force acts on the trunk


def values(name: str) -> np.ndarray:
    data = thing.data.attributes[name].data
    return np.array([each.vector if name == "force" else each.value for each in data])


assert (values("frame") == np.repeat(np.arange(11, 23), 2)).all()
assert (values("bone") == np.tile([1, 2], FRAMES)).all()
forces = np.array([force_on(k)[2:] for k in range(FRAMES)])
assert np.abs(values("force") - forces.reshape(-1, 3)).max() < 1e-6
longest = np.linalg.norm(forces, axis=-1).max()


def arrows():
    """Their places, directions and lengths, as drawn."""
    graph = bpy.context.evaluated_depsgraph_get()
    found = [
        each.matrix_world.copy()
        for each in graph.object_instances
        if each.is_instance and each.parent.original == thing
    ]
    return [(m.translation, m.to_3x3().col[2].normalized(), m.to_scale()[2]) for m in found]


def check(size: float) -> None:
    for frame in (11, 15, 22):
        scene.frame_set(frame)
        drawn = arrows()
        assert len(drawn) == 2
        with np.load(run / "states" / f"{frame - 11:06}.npz") as state:
            for number, (place, way, length) in enumerate(drawn, start=2):
                force = state["fluid_force"][number]
                strength = np.linalg.norm(force)
                assert np.abs(np.array(place) - state["fluid_centre"][number] / UNIT).max() < 1e-4
                assert np.abs(np.array(way) - force / strength).max() < 1e-5
                assert abs(length - size * strength / longest) < 1e-4 * size
    scene.frame_set(5)
    assert not arrows()


check(1.0)  # half the length of the armature
bpy.ops.wm.save_mainfile()
bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "shot.blend"))
scene, thing = bpy.context.scene, bpy.data.objects["flowborne forces rig"]
check(1.0)
