"""The panel draws in every state of a job, and Run looks after one until it ends."""

from types import SimpleNamespace

from blender.jobs import JOBS, job_of
from blender.operators import FlowborneRun
from blender.panel import FlowbornePanel
from blender.process import State

from stage import add_skin, bpy, character, new_scene, recorded


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
assert "Check" in drawn()
assert "resolution" not in drawn()
rig.flowborne.simulated = True
assert "resolution" in drawn()
assert "stiffness" not in drawn()
rig.flowborne.flesh = "REACT"
assert {"stiffness", "objective"} <= {*drawn()}
rig.flowborne.flesh = "FOLLOW"
assert "objective" not in drawn()
run = recorded(rig)
assert "done, frame 11/11" in drawn()
assert "flowborne.flesh" not in drawn()
add_skin(rig, run)
JOBS.clear()
assert "flowborne.flesh" in drawn()
job = job_of(rig.flowborne, "")
(run / "states" / "000011.npz").unlink()
for state, shown in (
    (State.RUNNING, "flowborne.cancel"),
    (State.CANCELLED, "Resume"),
    (State.FAILED, "flowborne.bake"),
    (State.CHECKED, "checked"),
):
    job.state = state
    assert shown in drawn(), drawn()
job.message = "two\nlines"
assert {"two", "lines"} <= {*drawn()}
(run / "summary.json").write_text('{"warnings": ["tail is 1.5 cells thick"]}')
assert "tail is 1.5 cells thick" in drawn()
rig.flowborne.folder = "//nowhere"
assert any("cannot be read" in line for line in drawn())

cancelled, reported = [], []
job = SimpleNamespace(
    state=State.RUNNING,
    active=True,
    line="cancelled, frame 3/11",
    step=lambda: job.state,
    cancel=lambda: cancelled.append(job.state),
)
manager = bpy.context.window_manager
operator = SimpleNamespace(
    _job=job,
    _timer=manager.event_timer_add(1.0, window=bpy.context.window),
    report=lambda kind, text: reported.append((kind, text)),
)


def after(event):
    return FlowborneRun.modal(operator, bpy.context, SimpleNamespace(type=event))


assert after("MOUSEMOVE") == after("TIMER") == {"PASS_THROUGH"}
assert not cancelled
assert after("ESC") == {"PASS_THROUGH"}
assert cancelled == [State.RUNNING]
job.state, job.active = State.CANCELLED, False
assert after("MOUSEMOVE") == {"PASS_THROUGH"}
assert after("TIMER") == {"FINISHED"}
assert reported == [({"INFO"}, "cancelled, frame 3/11")]
