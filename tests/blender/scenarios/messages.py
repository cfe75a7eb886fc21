"""What is missing is said, with the remedy; no folder is left behind."""

from blender.jobs import start_job
from blender.process import JobError
from blender.reaction import ReactionError

from stage import FOLDER, bpy, character, message, new_scene, refusal, select


def said(engine: str, error: type[Exception]) -> str:
    return message(error, start_job, bpy.context, engine)


new_scene()
rig = character()
python = FOLDER / "python"
python.touch()
select(rig)
assert "no bone is free: select the bones" in said(str(python), ReactionError)
select(rig, "tail")
assert "there is no flowborne in ''" in said("", JobError)
assert "there is no flowborne in '/nowhere'" in said("/nowhere", JobError)
assert "there is no flowborne in ''" in refusal(rig, "run")
rig.flowborne.objective, rig.flowborne.flow = "least-drag", (0.0, 0.0, 0.0)
assert "needs a flow" in said(str(python), ReactionError)
rig.flowborne.objective = "effort"
bpy.data.objects["rig body"].hide_set(True)
assert "no visible mesh is bound to armature 'rig'" in said(str(python), ReactionError)
bpy.data.objects["rig body"].hide_set(False)
rig.hide_set(True)
assert "armature 'rig' is hidden" in said(str(python), ReactionError)
bpy.context.scene.frame_end = bpy.context.scene.frame_start
assert "the frame range is empty" in said(str(python), ReactionError)
assert "this armature has no run" in refusal(rig)
assert not (FOLDER / "shot-flowborne").exists()
