"""A linked armature is refused with the remedy; its library override is baked."""

from blender.character import check_armature
from blender.reaction import ReactionError

from stage import FOLDER, bake, bpy, character, check_equal, message, new_scene, recorded, refusal

new_scene()
character()
library = str(FOLDER / "library.blend")
bpy.ops.wm.save_as_mainfile(filepath=library)
new_scene()
with bpy.data.libraries.load(library, link=True) as (found, chosen):
    chosen.objects = [name for name in found.objects if name == "rig"]
(rig,) = chosen.objects
bpy.context.scene.collection.objects.link(rig)
bpy.context.view_layer.update()
said = refusal(rig)
assert "no run: start one" in said, said
assert "make a library override" in message(ReactionError, check_armature, rig)
own = rig.override_create(remap_local_usages=True)
bpy.context.view_layer.update()
run = recorded(own)
bake(own)
check_equal(own, run, ("tail", "tip"))
