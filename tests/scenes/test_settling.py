"""Which scenes have a pose in which their controlled joints can come to rest."""

import pytest

from flowborne.control.objective_kinds import ObjectiveInputMotionTable
from flowborne.control.phases import PhaseIntervalsTable
from flowborne.scenes.control import ControllerTable
from flowborne.scenes.load import load_scene


@pytest.mark.parametrize(
    ("name", "rests"),
    [
        ("ns-block-drag-max", True),
        ("block-effort-wind", True),
        ("human-wind-back", False),
        ("eel-free", False),
        ("flyer-twist", False),
    ],
)
def test_creatures_that_walk_swim_or_fly_never_come_to_rest(name, rests):
    assert load_scene(name).can_settle == rests


def test_plans_phases_and_moving_targets_never_come_to_rest():
    scene = load_scene("block-effort-wind")
    (effort,) = scene.objectives
    phases = PhaseIntervalsTable(kind="intervals", intervals=((0.0, 1.0),))
    still, moving = (
        ObjectiveInputMotionTable(
            kind="input-motion", joint="hinge", times=(0.0, 1.0), values=values
        )
        for values in ((5.0, 5.0), (5.0, 9.0))
    )
    changes = {
        "knots": {"controller": ControllerTable(knots=3)},
        "phases": {"objectives": (effort.model_copy(update={"phases": phases}),)},
        "moving": {"objectives": (effort, moving)},
        "still": {"objectives": (effort, still)},
    }
    found = {key: scene.model_copy(update=change).can_settle for key, change in changes.items()}
    assert found == {"knots": False, "phases": False, "moving": False, "still": True}
