"""MuJoCo's ellipsoid fluid model on bodies of any joints."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from flowborne.solids.dynamics import kinematics
from flowborne.solids.ellipsoids import EllipsoidModel
from flowborne.solids.model import SolidModel

DENSITY, VISCOSITY = 900.0, 0.7
BLUNT, SLENDER = 0.5, 0.25
"""MuJoCo's coefficients."""


def alone(geom: str) -> SolidModel:
    """A body that slides along x."""
    return SolidModel.from_string(
        f'<mujoco><worldbody><body><joint type="slide" axis="1 0 0"/>{geom}</body></worldbody>'
        "</mujoco>"
    )


@pytest.mark.parametrize(
    ("geom", "radii"),
    [
        ('<geom size=".2"/>', (0.2, 0.2, 0.2)),
        ('<geom type="ellipsoid" size=".4 .1 .2"/>', (0.4, 0.1, 0.2)),
        ('<geom type="box" size=".1 .3 .2"/>', (0.1, 0.3, 0.2)),
        ('<geom type="capsule" size=".1 .3"/>', (0.1, 0.1, 0.4)),
        ('<geom type="cylinder" size=".1 .3"/>', (0.1, 0.1, 0.3)),
    ],
)
def test_motion_along_an_axis_has_the_documented_drag(
    geom: str, radii: tuple[float, float, float]
) -> None:
    """f = -rho (C_blunt A + C_slender (A_max - A)) |v| v - 6 pi r_D beta v, with the projected area
    A = pi r_y r_z and the largest A_max = pi r_max r_mid: no lift and no added mass."""
    stream, slides = 0.5, -1.5
    model = alone(geom)
    flow = EllipsoidModel(model, DENSITY, VISCOSITY, (stream, 0.0, 0.0))
    v = slides - stream
    area, (_, middle, largest) = np.pi * radii[1] * radii[2], sorted(radii)
    widest = np.pi * largest * middle
    drag = -DENSITY * (BLUNT * area + SLENDER * (widest - area)) * abs(v) * v
    drag -= 6.0 * np.pi * np.mean(radii) * VISCOSITY * v
    force, power = flow.force_and_power(kinematics(model, np.zeros(1)), np.array([slides]))
    np.testing.assert_allclose(force, [drag, 0.0, 0.0], rtol=1e-12, atol=1e-9 * abs(drag))
    assert power == pytest.approx(-drag * slides, rel=1e-12)


ARM = """<mujoco><default><geom contype="0" conaffinity="0" {fluid}/></default><worldbody>
<body pos="0 0 .1" euler="10 20 30"><joint axis="0 1 0"/><joint type="slide" axis="1 0 0"/>
<geom type="capsule" fromto="0 0 0 .4 .1 0" size=".05"/>
<body pos=".4 .1 0"><joint type="ball"/><geom type="box" size=".2 .1 .03" pos=".2 0 0"/>
<geom type="cylinder" size=".1 .2" pos="0 .1 0" euler="0 40 0" {own}/>
<body pos=".4 0 0"><joint axis="0 0 1"/><geom type="sphere" size=".1"/></body></body></body>
</worldbody></mujoco>"""
OWN = 'fluidshape="ellipsoid" fluidcoef=".7 .1 2 .5 .3"'


def test_it_is_the_force_of_mujoco_itself() -> None:
    """With the same fluid MuJoCo's own generalised force on the joints does the same work, and the
    coefficients of a geom are those of the model."""
    model = SolidModel.from_string(ARM.format(fluid="", own=OWN))
    own = mujoco.MjModel.from_xml_string(ARM.format(fluid='fluidshape="ellipsoid"', own=OWN))
    own.opt.density, own.opt.viscosity, own.opt.wind[:] = DENSITY, VISCOSITY, (0.3, -0.2, 0.1)
    flow = EllipsoidModel(model, DENSITY, VISCOSITY, (0.3, -0.2, 0.1))
    random = np.random.default_rng(5)
    q, v = (
        model.integrate(model.rest().q, random.normal(size=model.nv), 0.3),
        random.normal(size=model.nv),
    )
    data = mujoco.MjData(own)
    data.qpos[:], data.qvel[:] = q, v
    mujoco.mj_forward(own, data)
    force, power = flow.force_and_power(kinematics(model, q), v)
    assert power == pytest.approx(-data.qfrc_fluid @ v, rel=1e-12)
    assert power != pytest.approx(0.0, abs=1.0)
    slide = data.qfrc_fluid[1]
    assert force @ data.xaxis[1] == pytest.approx(slide, rel=1e-12)
