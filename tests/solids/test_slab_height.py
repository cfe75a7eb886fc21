"""Models whose bodies all lie at one height above z = 0, as slabs."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.solids.model import SolidModel

MODEL = """<mujoco><worldbody><geom name="pole" type="cylinder" pos="2 0 {0}" size=".1 1"/>
<body name="trunk" pos="0 0 {0}"><joint type="slide" axis="1 0 0"/>
<geom type="box" size=".3 .1 .1"/>
<body name="tail" pos="-.5 0 {1}"><joint axis="0 0 1"/><geom type="box" size=".2 .1 .1"/></body>
</body></worldbody></mujoco>"""


def test_a_common_height_is_taken_off() -> None:
    low, high = (
        SolidModel.from_string(MODEL.format(z, 0.0), slab=True, density=3.0) for z in (0.0, 1.5)
    )
    np.testing.assert_allclose(high.mj.body_pos, low.mj.body_pos, atol=1e-15)
    np.testing.assert_allclose(high.mj.geom_pos, low.mj.geom_pos, atol=1e-15)
    np.testing.assert_allclose(high.body_mass, low.body_mass, rtol=1e-12)
    np.testing.assert_allclose(high.mj.body_inertia, low.mj.body_inertia, rtol=1e-12)


def test_bodies_at_different_heights_are_refused() -> None:
    with pytest.raises(ValueError, match=r"body 'trunk' is at z = 1\.5 m"):
        SolidModel.from_string(MODEL.format(1.5, 0.1), slab=True)
