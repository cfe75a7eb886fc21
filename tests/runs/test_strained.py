"""A run whose joints pass their stops, or whose loops come open, does not end as done."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flowborne.runs.strained import strained
from flowborne.sim.endings import RunOutcome
from flowborne.solids.model import SolidModel
from flowborne.solids.passed import Equalities, passed_stops

from ..made_runs import run, summary_of

LIMBS = """<mujoco><worldbody>
<body><joint name="hinge" axis="0 0 1" range="-45 45" {stop}/><geom size=".1" mass="1"/></body>
<body pos="1 0 0"><joint name="slide" type="slide" axis="1 0 0" range="0 .5"/>
<geom size=".1" mass="1"/></body>
<body pos="2 0 0"><joint name="ball" type="ball" range="0 30"/><geom size=".1" mass="1"/></body>
</worldbody>
<tendon><fixed name="cord" range="-{cord} {cord}"><joint joint="hinge" coef="1"/>
<joint joint="slide" coef="4"/></fixed></tendon></mujoco>"""

WELDED = """<mujoco><worldbody>
<body name="a"><joint name="a" axis="0 0 1"/><geom size=".1" pos=".5 0 0" mass="1"/></body>
<body name="b"><joint name="b" axis="0 0 1"/><geom size=".1" pos=".5 0 0" mass="1"/></body>
</worldbody><equality><{equality}/></equality></mujoco>"""

LINKAGE = """<mujoco>
<default><geom contype="0" conaffinity="0" density="1000"/></default><worldbody>
<body name="crank"><joint name="crank" axis="0 0 1"/>
<geom type="capsule" fromto="0 0 0 0 0.1 0" size="0.02"/>
<body name="coupler" pos="0 0.1 0"><joint name="coupler" axis="0 0 1"/>
<geom type="capsule" fromto="0 0 0 0.3 0.1 0" size="0.02"/></body></body>
<body name="rocker" pos="0.3 0 0"><joint name="rocker" axis="0 0 1"/>
<geom type="capsule" fromto="0 0 0 0 0.2 0" size="0.02"/></body></worldbody>
<equality><connect name="pin" body1="coupler" body2="rocker" anchor="0.3 0.1 0"/></equality>
</mujoco>"""

DRIVEN = """
dimensions = 2
[time]
frames_per_second = 60.0
frames = 16
[domain]
lower = [-0.4, -0.4]
upper = [0.8, 0.6]
resolution = 24
[fluid]
density = 1000.0
[solids]
model = "model.xml"
[[motion]]
kind = "formula"
joint = "crank"
position = "40 * ramp(t, 0.2) * sin(2*pi*1*t)"
"""

STOPPED = """
dimensions = 2
[time]
frames_per_second = 60.0
frames = 8
[domain]
lower = [-0.5, -0.5]
upper = [0.5, 0.5]
resolution = 24
[fluid]
density = 1.0
[solids]
model = "model.xml"
{moved}
"""

FIN = """<mujoco><worldbody><body name="fin">
<joint name="fin" axis="0 0 1" range="-20 20" {stop}/>
<geom type="box" size="0.2 0.05 0.5" pos="0.2 0 0" density="1000"/></body></worldbody></mujoco>"""


def model_of(text: str) -> SolidModel:
    return SolidModel.from_string(text, gravity=(0.0, 0.0, 0.0))


def states(folder: Path, *places: list[float]) -> list[Path]:
    """Files of states at positions, at rest."""
    paths = []
    for frame, place in enumerate(places):
        paths.append(folder / f"{frame:06}.npz")
        np.savez(paths[-1], q=np.array(place), v=np.zeros(5))
    return paths


def doubts(paths: list[Path], model: SolidModel, driven: bool = False) -> list[str]:
    return list(strained(paths, model, np.full(model.nv, driven), 0.01))


def test_every_kind_of_stop_is_measured() -> None:
    model = model_of(LIMBS.format(stop="", cord=1))
    half = np.radians(20.0)
    q = np.array([np.radians(-47.0), 0.53, np.cos(half), np.sin(half), 0.0, 0.0])
    found = {passed.name: passed for passed in passed_stops(model, q)}
    assert found["joint 'hinge'"].amount == pytest.approx(np.radians(2.0))
    assert found["joint 'slide'"].amount == pytest.approx(0.03)
    assert found["joint 'ball'"].amount == pytest.approx(np.radians(10.0))
    length = np.radians(-47.0) + 4.0 * 0.53
    assert found["tendon 'cord'"].amount == pytest.approx(length - 1.0)
    assert found["joint 'slide'"].allowed == pytest.approx(0.005)
    assert found["joint 'hinge'"].allowed == pytest.approx(np.radians(1.0))
    assert found["tendon 'cord'"].allowed == pytest.approx(0.02 + np.radians(1.0))
    assert not list(passed_stops(model, model.rest().q))


@pytest.mark.parametrize(
    ("equality", "off", "turns"),
    [
        ('connect body1="a" body2="b" anchor=".5 0 0"', 2.0 * 0.5 * np.sin(0.1), False),
        ('weld body1="a" body2="b" torquescale="3"', 2.0 * np.sin(0.1), True),
        ('joint joint1="a" joint2="b"', 0.2, True),
    ],
)
def test_every_kind_of_equality_is_measured(equality: str, off: float, turns: bool) -> None:
    model = model_of(WELDED.format(equality=equality))
    found = list(Equalities(model, 1e-3).at(np.array([0.1, -0.1]), np.zeros(2)))
    worst = max(found, key=lambda passed: passed.amount)
    assert worst.turns is turns
    assert worst.amount == pytest.approx(off, rel=1e-6)
    assert worst.amount > worst.allowed
    assert all(p.amount <= p.allowed for p in Equalities(model, 1e-3).at(np.zeros(2), np.zeros(2)))


def test_softness_explains_what_speed_and_time_constant_make() -> None:
    """(1 - 0.9) V T of a time constant T of 50 ms at a speed V of 2 rad/s, and 0.01 rad."""
    equality = 'joint joint1="a" joint2="b" solref="0.05 1"'
    model = model_of(WELDED.format(equality=equality))
    (found,) = Equalities(model, 1e-3).at(np.zeros(2), np.array([1.0, -1.0]))
    assert found.allowed == pytest.approx(0.1 * 2.0 * 0.05 + 0.01)


def test_the_worst_joint_is_named_with_its_angle_and_frame(tmp_path: Path) -> None:
    model = model_of(LIMBS.format(stop="", cord=9))
    rest = model.rest().q.tolist()
    near, far = [np.radians(45.9), *rest[1:]], [np.radians(60.0), *rest[1:]]
    assert not doubts(states(tmp_path, rest, near), model)
    far[1] = 0.51
    (said,) = doubts(states(tmp_path, rest, near, far, near), model)
    assert said.startswith(
        "joint 'hinge' was at 60 degrees in frame 2, 15 degrees beyond its range (1 more too); "
    )
    assert said.endswith("; take more steps per frame")
    (said,) = doubts(states(tmp_path, far), model, driven=True)
    assert said.endswith("; let what drives it stay in the range, or widen the range in the model")
    soft = model_of(LIMBS.format(stop='solreflimit=".1 1"', cord=9))
    (said,) = doubts(states(tmp_path, far), soft)
    assert "solreflimit" in said


def test_a_damaged_state_is_passed_over(tmp_path: Path) -> None:
    model = model_of(LIMBS.format(stop="", cord=9))
    paths = states(tmp_path, model.rest().q.tolist(), [1.2, *model.rest().q[1:]])
    paths[0].write_bytes(b"")
    assert len(doubts(paths, model)) == 1


def test_a_loop_that_drives_pull_open_is_doubtful(tmp_path: Path) -> None:
    """The linkage that is driven at its crank alone is done, and closed to a millimetre."""
    (tmp_path / "model.xml").write_text(LINKAGE)
    scene = tmp_path / "linkage.toml"
    scene.write_text(DRIVEN)
    assert run(scene, tmp_path / "right").outcome is RunOutcome.DONE
    scene.write_text(DRIVEN + '[[motion]]\nkind = "constant"\njoint = "coupler"\nposition = 0.0\n')
    result = run(scene, tmp_path / "wrong")
    assert result.outcome is RunOutcome.DOUBTFUL
    assert "equality 'pin' was open by 0.199 m in frame 15" in result.message
    assert len(summary_of(tmp_path / "wrong")["doubts"]) == 1


@pytest.mark.parametrize(
    ("stop", "motion", "said"),
    [
        ("", "", None),
        ('solreflimit=".1 1"', "", "beyond its range; a shorter time constant of solreflimit"),
        (
            "",
            '[[motion]]\nkind = "formula"\njoint = "fin"\nposition = "40 * sin(12 * t)"\n',
            "; let what drives it stay in the range",
        ),
    ],
)
def test_a_joint_beyond_its_stop_is_doubtful(
    tmp_path: Path, stop: str, motion: str, said: str | None
) -> None:
    (tmp_path / "model.xml").write_text(FIN.format(stop=stop))
    scene = tmp_path / "fin.toml"
    scene.write_text(STOPPED.format(moved=motion or "[initial.velocities]\nfin = 600.0\n"))
    result = run(scene, tmp_path / "run")
    assert result.outcome is (RunOutcome.DOUBTFUL if said else RunOutcome.DONE), result.message
    assert (said or "") in result.message
