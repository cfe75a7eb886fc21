"""Rigid clusters keep momentum; naive zeroing does not."""

from __future__ import annotations

import numpy as np

from flowborne.solids.dynamics import kinematics
from flowborne.solids.following import outboard_dofs, rigidify
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.momentum import kinetic_energy, momentum

TREE = SolidModel.from_string("""<mujoco><worldbody><body><freejoint/><geom size=".2"/>
<body pos=".3 0 0"><joint name="a" axis="0 1 0"/><geom type="box" size=".3 .1 .1" pos=".3 0 0"/>
<body pos=".6 0 0"><joint name="a2" type="ball"/><geom type="box" size=".3 .1 .1" pos=".3 0 0"/>
<body pos=".6 0 0"><joint name="a3" axis="0 0 1"/><geom type="box" size=".3 .1 .1" pos=".3 0 0"/>
</body></body></body>
<body pos="-.3 0 0"><joint name="b" axis="0 1 0"/><geom type="box" size=".3 .1 .1" pos="-.3 0 0"/>
</body></body></worldbody></mujoco>""")


def tumbling(seed: int) -> SolidState:
    rng = np.random.default_rng(seed)
    q = TREE.integrate(TREE.rest().q, rng.normal(size=TREE.nv), 0.5)
    return SolidState(q, rng.normal(size=TREE.nv))


def test_rigidify_keeps_linear_and_angular_momentum() -> None:
    for seed in range(5):
        state = tumbling(seed)
        dofs = np.concatenate([TREE.dofs_of("a2"), TREE.dofs_of("a3")])
        before = momentum(TREE, state)
        rigid = rigidify(TREE, state, dofs)
        scale = np.abs(before).max()
        assert np.all(rigid.v[dofs] == 0.0)
        np.testing.assert_allclose(momentum(TREE, rigid), before, atol=1e-12 * scale)
        assert kinetic_energy(TREE, rigid) < kinetic_energy(TREE, state)
        naive = state.copy()
        naive.v[dofs] = 0.0
        assert np.abs(momentum(TREE, naive) - before).max() > 1e-3 * scale


def test_rigid_bodies_share_a_twist() -> None:
    state = tumbling(1)
    rigid = rigidify(TREE, state, outboard_dofs(TREE, int(TREE.dofs_of("a")[0])))
    twist = kinematics(TREE, rigid.q).twist_jacobian @ rigid.v
    np.testing.assert_allclose(twist[3], twist[2], atol=1e-12)
    np.testing.assert_allclose(twist[4], twist[2], atol=1e-12)
    assert np.abs(twist[5] - twist[2]).max() > 0.01
    np.testing.assert_array_equal(rigid.q, state.q)


def test_fixed_dofs_keep_their_velocity() -> None:
    state = tumbling(2)
    fixed = np.zeros(TREE.nv, bool)
    fixed[TREE.dofs_of("b")] = True
    rigid = rigidify(TREE, state, TREE.dofs_of("a2"), fixed)
    assert rigid.v[TREE.dofs_of("b")] == state.v[TREE.dofs_of("b")]
    assert np.abs(rigid.v[:6] - state.v[:6]).max() > 1e-3


def test_outboard_dofs() -> None:
    names = np.array(TREE.dof_names)
    below = names[outboard_dofs(TREE, int(TREE.dofs_of("a")[0]))]
    assert list(below) == ["a2:rx", "a2:ry", "a2:rz", "a3"]
    assert outboard_dofs(TREE, int(TREE.dofs_of("a3")[0])).size == 0
    assert outboard_dofs(TREE, int(TREE.dofs_of("a2")[1])).tolist() == [10]
    assert outboard_dofs(TREE, 0).size == TREE.nv - 6
