"""The panel draws without a character, with one, and in every state of a job."""

from types import SimpleNamespace

from blender.job import State
from blender.panel import FlowbornePanel, job_of

from stage import bpy, character, new_scene, recorded


class Layout:
    """Notes what is drawn."""

    def __init__(self) -> None:
        self.drawn = []

    def label(self, text="", icon="NONE"):
        self.drawn.append(text)

    def prop(self, owner, name):
        assert name in owner.bl_rna.properties
        self.drawn.append(name)

    def operator(self, name, text=""):
        self.drawn.append(text or name)
        return SimpleNamespace()

    def operator_menu_enum(self, name, choice):
        self.drawn.append(name)


def drawn():
    layout = Layout()
    FlowbornePanel.draw(SimpleNamespace(layout=layout), bpy.context)
    return layout.drawn


new_scene()
assert drawn() == ["no armature is active: select the armature of the character"]
rig = character()
assert "flowborne.run" in drawn()
assert "resolution" not in drawn()
rig.flowborne.simulated = True
assert "resolution" in drawn()
recorded(rig)
assert "done, frame 11/11" in drawn()
job = job_of(rig.flowborne, "")
for state, shown in (
    (State.RUNNING, "flowborne.cancel"),
    (State.CANCELLED, "Resume"),
    (State.FAILED, "flowborne.bake"),
):
    job.state = state
    assert shown in drawn(), drawn()
job.message = "two\nlines"
assert {"two", "lines"} <= {*drawn()}
rig.flowborne.folder = "//nowhere"
assert any("cannot be read" in line for line in drawn())
