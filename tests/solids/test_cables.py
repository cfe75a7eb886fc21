"""Cables of MuJoCo 3 as chains."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose

from flowborne.solids.cables import write_chains
from flowborne.solids.dynamics import kinematics
from flowborne.solids.mjcf import bones_of
from flowborne.solids.model import SolidModel

CABLE = """<mujoco>
  <!-- a mooring -->
  <extension><plugin plugin="mujoco.elasticity.cable"/></extension>
  <worldbody>
    <body name="buoy" pos="1 0 0"><freejoint/><geom size="0.1"/>
      <composite prefix="c_" type="cable" {shape} initial="{initial}">
        <plugin plugin="mujoco.elasticity.cable">
          <config key="twist" value="1e7"/><config key="bend" value="4e6"/>
        </plugin>
        <joint kind="main" damping="0.02"/>
        <geom {geom} density="900"/>
      </composite>
    </body>
  </worldbody>
  <sensor><framepos objtype="site" objname="c_S_last"/></sensor>
</mujoco>"""

BUOY = np.array([1.0, 0.0, 0.0])

LINE = 'curve="s" count="51" size="2"'
ROUND = 'type="capsule" size="0.01"'


def chain(
    folder: Path, shape: str = LINE, geom: str = ROUND, initial: str = "none"
) -> tuple[SolidModel, tuple[str, ...]]:
    path = folder / "mooring.xml"
    path.write_text(CABLE.format(shape=shape, geom=geom, initial=initial))
    made, notes = write_chains(path)
    assert made == folder / "mooring-chains.xml"
    assert "<!-- a mooring -->" in made.read_text()
    return SolidModel(bones_of(made, False, (0.0, 0.0, 0.0))[1], False), notes


@pytest.mark.parametrize(
    ("geom", "moment"),
    [(ROUND, 0.25 * np.pi * 0.01**4), ('type="box" size="1 0.01 0.01"', 0.02**4 / 12.0)],
)
def test_a_clamped_cable_bends_as_a_beam(tmp_path: Path, geom: str, moment: float) -> None:
    """Under a small force at its end by F L^3 / (3 E I), less (1 - 1/N)(1 - 1/(2 N)) of N edges."""
    model, notes = chain(tmp_path, geom=geom)
    arms = np.array([2.0 - 0.04 * n for n in range(1, 50)])
    stiffness = model.mj.jnt_stiffness[1:]
    found = float((arms**2 / stiffness).sum())
    beam = 2.0**3 / (3.0 * 4e6 * moment)
    assert found == pytest.approx(beam * (1.0 - 1.0 / 50.0) * (1.0 - 1.0 / 100.0), rel=1e-6)
    assert notes[0].startswith("cable 'c_': 50 bodies, bend = 4e+06 Pa; ")
    assert notes[1].endswith("so that twist = 1e+07 Pa is not used")


@pytest.mark.parametrize(
    ("shape", "points"),
    [
        (LINE, np.c_[np.linspace(0.0, 2.0, 51), np.zeros((51, 2))]),
        (
            'curve="cos(s) sin(s) s" count="21" size="0.5 0.2 4" offset="0 1 0"',
            np.array(
                [
                    [0.2 * np.cos(4 * np.pi * s), 1 + 0.2 * np.sin(4 * np.pi * s), 0.5 * s]
                    for s in np.linspace(0.0, 1.0, 21)
                ]
            ),
        ),
        (
            'vertex="0 0 0  0 1 0  0 1 1  1 1 1"',
            np.array([[0, 0, 0], [0, 1, 0], [0, 1, 1], [1, 1, 1]]),
        ),
    ],
)
@pytest.mark.parametrize("initial", ["none", "ball"])
def test_bodies_lie_along_the_curve(
    tmp_path: Path, shape: str, points: np.ndarray, initial: str
) -> None:
    model, _ = chain(tmp_path, shape, initial=initial)
    names = [name for name in model.body_names if name.startswith("c_B_")]
    assert (names[0], names[-1]) == ("c_B_first", "c_B_last")
    pose = kinematics(model, model.rest().q)
    found = pose.body_position[[model.body(name) for name in names]]
    assert_allclose(found, points[:-1] + BUOY, atol=1e-8)
    data = mujoco.MjData(model.mj)
    mujoco.mj_kinematics(model.mj, data)
    assert_allclose(data.site("c_S_last").xpos, points[-1] + BUOY, atol=1e-8)
    joints = [name for name in model.joint_names if name.startswith("c_J_")]
    assert len(joints) == len(names) - (initial == "none")
    assert_allclose(model.mj.dof_damping[6:], 0.02)


def test_what_is_no_cable_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.xml"
    for text, said in (
        ("<mujoco/>", "has no <composite>"),
        (
            '<mujoco><worldbody><composite type="grid" prefix="g"/></worldbody></mujoco>',
            "composite 'g': it is of type 'grid', and only cables are chains of bodies",
        ),
        (
            '<mujoco><worldbody><composite type="cable" curve="s" count="2" size="1"/></worldbody>'
            "</mujoco>",
            "it has 2 points",
        ),
    ):
        path.write_text(text)
        with pytest.raises(ValueError, match=said):
            write_chains(path)
    (tmp_path / "a-chains.xml").touch()
    with pytest.raises(ValueError, match=r"a-chains\.xml is there already\. Remove it first"):
        write_chains(path)
