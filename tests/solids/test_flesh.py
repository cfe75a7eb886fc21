"""Flesh: the sparse identity with MuJoCo, prescribed dofs, vertices, inverted elements."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.linalg import eigh

from flowborne.kernels.arrays import Array
from flowborne.solids.constraints import ACTIVE, ONE_SIDED
from flowborne.solids.dynamics import assemble
from flowborne.solids.elements import surface_of
from flowborne.solids.flesh import Flesh, inversion
from flowborne.solids.flesh_dynamics import assemble_flesh, sparse_mass, static_forces
from flowborne.solids.flesh_solve import DAMPED_SHARE, DAMPING_ORDER, prescribe_flesh
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.scratch import scratch
from flowborne.solids.tissue.growth import Grown, Law, Tissue, add_flesh
from flowborne_validation.flag_in_channel import flag_of, flag_tissue
from flowborne_validation.flesh_bars import bar_mesh, flat_mesh

DT = 2e-3

ARM = """<mujoco><default><geom contype="0" conaffinity="0"/></default><worldbody>
<body name="upper" pos="0 0 .1" euler="0 20 0"><joint name="shoulder" axis="0 1 0" damping=".1"
stiffness="3"/><geom type="capsule" fromto="0 0 0 .2 0 0" size=".02"/>
<body name="lower" pos=".2 0 0"><joint name="elbow" axis="0 1 .3" armature=".01"/>
<geom type="capsule" fromto="0 0 0 .2 0 0" size=".02"/></body></body></worldbody>
<tendon><fixed><joint joint="elbow" coef="1"/></fixed>
<fixed stiffness="2" damping=".3" springlength=".01"><joint joint="shoulder" coef="1"/>
<joint joint="elbow" coef="-.5"/></fixed></tendon></mujoco>"""


def arm(law: Law = Law.SAINT_VENANT_KIRCHHOFF) -> SolidModel:
    """Two bones in one piece of flesh; each holds the points near its middle."""
    spec = mujoco.MjSpec.from_string(ARM)
    points, elements = bar_mesh((8, 2, 2), (0.4, 0.1, 0.1))
    near = [(abs(x - 0.1) < 0.03, abs(x - 0.3) < 0.03) for x in points[:, 0]]
    holders = ["upper" if first else "lower" if last else "" for first, last in near]
    tissue = Tissue(young=3e4, poisson=0.3, density=1000.0, damping=0.01, law=law)
    grown = add_flesh(spec, "arm", points, elements, tissue, holders)
    return SolidModel.with_flesh(spec, [grown], gravity=(0.0, 0.5, -2.0))


def moving(model: SolidModel, seed: int = 0) -> SolidState:
    """A bent and moving state, from some steps."""
    state, nothing = model.rest(), np.zeros(model.nv)
    for _ in range(30):
        state.q = model.integrate(state.q, state.v, DT)
        system = assemble_flesh(model, state, nothing, DT)
        state.v = prescribe_flesh(system, np.zeros(model.nv, bool), nothing).velocity
    kick = 0.05 * np.random.default_rng(seed).standard_normal(model.nv)
    return SolidState(state.q, state.v + kick)


def by_differences(model: SolidModel, state: SolidState) -> tuple[Array, Array]:
    """K and D (nv, nv) of springs, dampers and flesh, from the forces around a state.

    Those between the nodes are a function of their places alone.
    """
    s, nothing, eps = scratch(model), np.zeros(model.nv), 1e-6
    flesh = flesh_of_model(model)

    def passive(q: Array, v: Array) -> Array:
        s.smooth_forces(q, v, nothing)
        return np.array(s.data.qfrc_passive)

    def force(q: Array) -> Array:
        of_joints = passive(q, nothing)
        return of_joints + flesh.moving_nodes(s).T @ flesh.elasticity.forces(flesh.nodes(s)).ravel()

    K, D = np.empty((model.nv, model.nv)), np.empty((model.nv, model.nv))
    for n, one in enumerate(np.eye(model.nv)):
        ahead, back = (force(model.integrate(state.q, one, e)) for e in (eps, -eps))
        K[:, n] = (back - ahead) / (2.0 * eps)
        ahead, back = (passive(state.q, e * one) for e in (eps, -eps))
        D[:, n] = (back - ahead) / (2.0 * eps)
    elastic = static_forces(model, state.q, nothing)[0].toarray()
    bones = ~flesh.dofs
    joints = np.zeros_like(K)
    joints[np.ix_(bones, bones)] = SPRINGS
    return K, D + flesh.damping * (elastic - joints)


def flesh_of_model(model: SolidModel) -> Flesh:
    assert model.flesh is not None
    return model.flesh


SPRINGS = np.array([[3.0 + 2.0, -1.0], [-1.0, 0.5]])
"""K of the arm's joint and tendon."""


@pytest.mark.parametrize("law", list(Law))
def test_A_and_b_at_rest_are_those_of_average_acceleration(law: Law) -> None:
    model = arm(law)
    state = model.rest()
    state.v = np.random.default_rng(1).standard_normal(model.nv)
    K, D = by_differences(model, state)
    applied = np.random.default_rng(2).standard_normal(model.nv)
    system = assemble_flesh(model, state, applied, DT)
    s = scratch(model)
    s.smooth_forces(state.q, state.v, applied)
    M, smooth = s.mass_matrix(), s.smooth.copy()
    flesh = flesh_of_model(model)
    joints, bones = np.zeros_like(K), np.flatnonzero(~flesh.dofs)
    joints[np.ix_(bones, bones)] = SPRINGS
    expected = M + 0.5 * DT * D + DT**2 * (0.25 * joints + 0.5 * (K - joints))
    np.testing.assert_allclose(system.A.toarray(), expected, atol=1e-7 * np.abs(expected - M).max())
    damper = flesh.damping * (static_forces(model, state.q, applied)[0] @ state.v)
    bones = np.flatnonzero(~flesh.dofs)
    damper[bones] -= flesh.damping * SPRINGS @ state.v[bones]
    push = smooth - damper
    np.testing.assert_allclose(
        system.impulse, system.A @ state.v + DT * push, atol=1e-9 * np.abs(system.impulse).max()
    )


def test_A_is_symmetric_and_bones_meet_only_the_flesh_around_them() -> None:
    model = arm()
    A = assemble_flesh(model, moving(model), np.zeros(model.nv), DT).A
    assert abs(A - A.T).max() < 1e-12 * abs(A).max()
    assert np.linalg.eigvalsh(A.toarray())[0] > 0.0
    bones = np.flatnonzero(~flesh_of_model(model).dofs)
    assert bones.tolist() == [model.dofs_of("shoulder")[0], model.dofs_of("elbow")[0]]
    assert (A[bones].toarray() != 0.0).mean() < 0.9


def test_prescribed_bones_reach_their_velocity_and_the_drives_pay_for_it() -> None:
    model = arm()
    state, rng = moving(model), np.random.default_rng(2)
    system = assemble_flesh(model, state, np.zeros(model.nv), DT)
    prescribed, hold = ~flesh_of_model(model).dofs, rng.standard_normal(model.nv)
    driven = prescribe_flesh(system, prescribed, hold)
    push = 1e-3 * rng.standard_normal(model.nv)
    found = driven.after(push)
    np.testing.assert_array_equal(found[prescribed], hold[prescribed])
    drive = DT * driven.actuator(found, push)
    dense = np.linalg.solve(system.A.toarray(), driven.system.impulse + push + drive)
    np.testing.assert_allclose(found, dense, atol=1e-10 * np.abs(dense).max())
    several = driven.answer(np.stack([push, -2.0 * push], axis=1))
    np.testing.assert_allclose(several[:, 1], -2.0 * several[:, 0], rtol=1e-12)


def test_vertices_and_their_jacobian() -> None:
    model = arm()
    flesh, state = flesh_of_model(model), moving(model)
    at_rest = flesh.vertices(model.mj.qpos0)
    np.testing.assert_allclose(at_rest, flesh.rest, atol=1e-14)
    eps = 1e-6
    ahead, back = (
        flesh.vertices(model.integrate(state.q, state.v, sign * eps)) for sign in (1.0, -1.0)
    )
    velocity = (flesh.jacobian(state.q) @ state.v).reshape(-1, 3)
    np.testing.assert_allclose(velocity, (ahead - back) / (2.0 * eps), atol=1e-8)


def test_flesh_in_a_slab_is_a_prism_of_unit_depth() -> None:
    spec = mujoco.MjSpec()
    points, elements = flat_mesh((4, 2), (0.4, 0.1))
    held = ["world" if x == 0.0 else "" for x in points[:, 0]]
    grown = add_flesh(spec, "fin", points, elements, Tissue(3e4, 0.3, 1000.0), held)
    model = SolidModel.with_flesh(spec, [grown], slab=True)
    flesh = flesh_of_model(model)
    assert model.nv == 2 * grown.free.sum()
    corners = flesh.rest[flesh.surface]
    enclosed = np.linalg.det(corners).sum() / 6.0
    assert enclosed == pytest.approx(0.4 * 0.1)
    assert flesh.volumes.sum() == pytest.approx(0.4 * 0.1)
    assert flesh.thickness == pytest.approx((0.1,))
    velocity = np.random.default_rng(0).standard_normal(model.nv)
    moved = (flesh.jacobian(model.mj.qpos0) @ velocity).reshape(2, -1, 3)
    np.testing.assert_array_equal(moved[0], moved[1])
    assert not moved[..., 2].any()
    np.testing.assert_allclose(flesh.of_vertices(moved.reshape(-1, 3)), velocity, rtol=1e-12)
    with pytest.raises(ValueError, match="triangles at z = 0"):
        SolidModel.with_flesh(mujoco.MjSpec(), [arm_in_room()], slab=True)


def arm_in_room() -> Grown:
    points, elements = bar_mesh((1, 1, 1), (0.1, 0.1, 0.1))
    return add_flesh(mujoco.MjSpec(), "f", points, elements, Tissue(1e4, 0.3, 1e3), [""] * 8)


def test_mass_of_flesh_is_lumped_and_that_of_held_points_goes_to_the_bones() -> None:
    model = arm()
    bones = SolidModel.from_string(ARM)
    flesh = flesh_of_model(model)
    mass = 1000.0 * flesh.volumes.sum()
    assert mass == pytest.approx(1000.0 * 0.4 * 0.1 * 0.1)
    assert model.body_mass.sum() - bones.body_mass.sum() == pytest.approx(mass)
    centre = scratch(model)
    centre.place(model.mj.qpos0)
    moment = model.body_mass @ centre.data.xipos
    own = scratch(bones)
    own.place(bones.mj.qpos0)
    expected = bones.body_mass @ own.data.xipos + mass * np.array([0.2, 0.0, 0.0])
    np.testing.assert_allclose(moment, expected, atol=1e-12)


def test_total_force_of_flesh_and_stillness_at_rest() -> None:
    """Flesh at rest pushes nothing; bent flesh in free space keeps its momentum."""
    spec = mujoco.MjSpec()
    points, elements = bar_mesh((4, 2, 2), (0.4, 0.1, 0.1))
    tissue = Tissue(3e4, 0.3, 1000.0, 0.01)
    grown = add_flesh(spec, "free", points, elements, tissue, [""] * len(points))
    model = SolidModel.with_flesh(spec, [grown], gravity=(0.0, 0.0, 0.0))
    none, nothing = np.zeros(model.nv, bool), np.zeros(model.nv)
    still = prescribe_flesh(assemble_flesh(model, model.rest(), nothing, DT), none, nothing)
    assert np.abs(still.velocity).max() < 1e-12
    rng = np.random.default_rng(3)
    state = SolidState(0.005 * rng.standard_normal(model.nq), rng.standard_normal(model.nv))
    mass = np.repeat(model.body_mass[1:], 3)
    after = prescribe_flesh(assemble_flesh(model, state, nothing, DT), none, nothing).velocity
    change = (mass * (after - state.v)).reshape(-1, 3).sum(axis=0)
    assert np.abs(change).max() < 1e-10


def test_surface_is_closed_and_outward() -> None:
    points, elements = bar_mesh((3, 2, 2), (0.3, 0.1, 0.2))
    faces = surface_of(elements)
    assert len(faces) == 2 * 2 * (3 * 2 + 2 * 2 + 3 * 2)
    corners = points[faces]
    enclosed = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    assert enclosed == pytest.approx(0.3 * 0.1 * 0.2)


def crushed(flesh: Flesh) -> Array:
    """Positions with one free point pushed askew through the elements beside it."""
    q = np.array(flesh.model.mj.qpos0)
    loose = np.flatnonzero(flesh.dofs).reshape(-1, 3)
    q[loose[len(loose) // 2]] += (0.03, -0.2, 0.02)
    return q


def test_inverted_elements_are_found_and_named() -> None:
    model = arm()
    flesh = flesh_of_model(model)
    assert inversion(flesh, moving(model).q) is None
    q = crushed(flesh)
    found = inversion(flesh, q)
    assert found is not None
    ratios = flesh.volume_ratios(q)
    np.testing.assert_array_equal(found.elements, np.flatnonzero(ratios <= 0.0))
    assert len(found.elements) > 1
    assert found.ratio == ratios.min() < 0.0
    assert found.sentence().startswith(f"{len(found.elements)} of {len(ratios)} elements")
    assert "'arm' at (" in found.sentence()


@pytest.mark.parametrize("law", list(Law))
def test_only_neo_hookean_flesh_comes_back_from_a_crumpled_shape(law: Law) -> None:
    points, elements = bar_mesh((3, 2, 2), (0.3, 0.2, 0.2))
    holders = ["world" if x < 1e-9 else "" for x in points[:, 0]]
    spec = mujoco.MjSpec()
    grown = add_flesh(spec, "f", points, elements, Tissue(1e4, 0.3, 1000.0, 0.02, law), holders)
    model = SolidModel.with_flesh(spec, [grown], gravity=(0.0, 0.0, 0.0))
    flesh, none, nothing = flesh_of_model(model), np.zeros(model.nv, bool), np.zeros(model.nv)
    crumple = 0.03 * np.random.default_rng(0).standard_normal(model.nq)
    state = SolidState(model.mj.qpos0 + crumple, nothing)
    crumpled = inversion(flesh, state.q)
    assert crumpled is not None
    assert len(crumpled.elements) > 20
    for _ in range(300):
        q = model.integrate(state.q, state.v, 0.01)
        system = assemble_flesh(model, SolidState(q, state.v), nothing, 0.01)
        state = SolidState(q, prescribe_flesh(system, none, nothing).velocity)
    left = inversion(flesh, state.q)
    assert (left is None) == (law is Law.STABLE_NEO_HOOKEAN)
    if left is None:
        assert np.abs(state.q - model.mj.qpos0).max() < 0.01


def test_bad_flesh_is_refused_with_its_place() -> None:
    points, elements = bar_mesh((1, 1, 1), (0.1, 0.1, 0.1))
    tissue, spec = Tissue(1e4, 0.3, 1000.0), mujoco.MjSpec()
    flipped = elements[:, [0, 2, 1, 3]]
    with pytest.raises(ValueError, match=r"'f': element \d at \(.*\) m has the volume -0.000"):
        add_flesh(spec, "f", points, flipped, tissue, [""] * 8)
    with pytest.raises(ValueError, match="no body 'wirst'"):
        add_flesh(spec, "f", points, elements, tissue, ["wirst"] + [""] * 7)
    model = arm()
    with pytest.raises(ValueError, match="Use assemble_flesh"):
        assemble(model, model.rest(), np.zeros(model.nv), DT)


def test_a_flex_is_refused_with_the_reason_and_the_remedy() -> None:
    text = """<mujoco><worldbody><flexcomp name="f" type="grid" dim="3" count="3 3 3"
    spacing=".1 .1 .1" mass="1"><elasticity young="1e4"/></flexcomp></worldbody></mujoco>"""
    expected = r"flex 'f' is not simulated, as .* lock .* Remove it .* \[\[flesh\]\] table"
    with pytest.raises(ValueError, match=f"model text: {expected}"):
        SolidModel.from_string(text)
    with pytest.raises(ValueError, match=f"model with flesh: {expected}"):
        SolidModel.with_flesh(mujoco.MjSpec.from_string(text), [arm_in_room()])


def test_fleshes_of_different_damping_are_refused() -> None:
    spec = mujoco.MjSpec()
    points, elements = bar_mesh((1, 1, 1), (0.1, 0.1, 0.1))
    grown = [
        add_flesh(spec, name, points, elements, Tissue(1e4, 0.3, 1000.0, damping), [""] * 8)
        for name, damping in (("a", 0.0), ("b", 0.01))
    ]
    with pytest.raises(ValueError, match=r"\[0.0, 0.01\] s"):
        SolidModel.with_flesh(spec, grown)


LIMITED = ARM.replace('name="elbow"', 'name="elbow" range="5 9" frictionloss=".01"').replace(
    "<worldbody>",
    '<worldbody><geom type="plane" size="1 1 .1" pos="0 0 -.02" contype="1"/>'
    '<geom type="sphere" size=".03" pos=".38 0 .005" contype="1"/>',
)
LIMITED = LIMITED.replace('conaffinity="0"', 'conaffinity="1"')


def limited(slippery: bool = False) -> SolidModel:
    """The arm with a joint limit that is exceeded, dry friction, and contacts of its bones.

    slippery  contacts have no friction
    """
    spec = mujoco.MjSpec.from_string(LIMITED)
    points, elements = bar_mesh((8, 2, 2), (0.4, 0.1, 0.1))
    points[:, 2] += 0.025
    holders = ["lower" if 0.2 < x < 0.3 else "" for x in points[:, 0]]
    grown = add_flesh(spec, "arm", points, elements, Tissue(3e4, 0.3, 1000.0, 0.01), holders)
    if slippery:
        for touching in spec.geoms:
            touching.friction, touching.condim = np.zeros(3), 3
    return SolidModel.with_flesh(spec, [grown], gravity=(0.0, 0.5, -2.0))


@pytest.mark.parametrize("at_rest", [True, False])
def test_limits_friction_and_contacts_only_push(at_rest: bool) -> None:
    model = limited()
    state = model.rest() if at_rest else moving(model)
    none, nothing = np.zeros(model.nv, bool), np.zeros(model.nv)
    driven = prescribe_flesh(assemble_flesh(model, state, nothing, DT), none, nothing)
    for _ in range(30):
        changed = driven.updated(driven.velocity)
        if changed is None:
            break
        driven = changed
    rows, zones = driven.system.rows, driven.system.zones
    assert rows is not None
    assert (zones == ACTIVE).sum() > 1
    acceleration = (driven.velocity - state.v) / DT
    np.testing.assert_array_equal(rows.zones(acceleration, zones), zones)
    one_sided = (rows.kind == ONE_SIDED) & (zones == ACTIVE)
    assert one_sided.any()
    assert (rows.aref - rows.J @ acceleration)[one_sided].min() > 0.0


def test_rows_are_found_from_any_start_by_one_factor() -> None:
    model = limited()
    state, nothing = moving(model), np.zeros(model.nv)
    right = assemble_flesh(model, state, nothing, DT)
    bones = ~flesh_of_model(model).dofs
    for prescribed in (np.zeros(model.nv, bool), bones):
        driven = prescribe_flesh(
            replace(right, zones=np.zeros_like(right.zones)), prescribed, nothing
        )
        factor = driven.factor
        for _ in range(30):
            changed = driven.updated(driven.velocity)
            if changed is None:
                break
            driven = changed
        else:
            raise AssertionError("the rows do not settle")
        assert driven.factor is factor
        J, D, push = driven.system.acting()
        B = right.A.toarray() + J.T @ (D[:, None] * J)
        drive = DT * driven.actuator(driven.velocity, nothing)
        dense = np.linalg.solve(B, driven.system.impulse + push + drive)
        np.testing.assert_allclose(driven.velocity, dense, atol=1e-10 * np.abs(dense).max())
        assert (drive != 0.0).sum() == prescribed.sum()


def test_contacts_without_friction_settle_beside_flesh() -> None:
    """One row for each, found from no contact at all."""
    model = limited(slippery=True)
    state, nothing = moving(model), np.zeros(model.nv)
    right = assemble_flesh(model, state, nothing, DT)
    assert right.rows is not None
    touching = right.rows.contact[right.rows.contact >= 0]
    assert touching.size == np.unique(touching).size > 1
    driven = prescribe_flesh(
        replace(right, zones=np.zeros_like(right.zones)), np.zeros(model.nv, bool), nothing
    )
    for _ in range(8):
        changed = driven.updated(driven.velocity)
        if changed is None:
            return
        driven = changed
    raise AssertionError("the rows do not settle")


def clamped_bar(gravity: float) -> SolidModel:
    """A bar in the world's grasp, 0.4 m long and 0.1 m thick; gravity (m/s^2) along z."""
    spec = mujoco.MjSpec()
    points, elements = bar_mesh((6, 1, 1), (0.4, 0.1, 0.1))
    holders = ["world" if x < 1e-9 else "" for x in points[:, 0]]
    grown = add_flesh(spec, "bar", points, elements, Tissue(1e5, 0.3, 1000.0), holders)
    return SolidModel.with_flesh(spec, [grown], gravity=(0.0, 0.0, gravity))


def swung(model: SolidModel, v: Array, dt: float, steps: int) -> tuple[Array, Array]:
    """(steps, nq) positions and (steps,) energy from rest with velocity v (nv,), no drives."""
    none, nothing = np.zeros(model.nv, bool), np.zeros(model.nv)
    state, s, flesh = SolidState(model.rest().q, v), scratch(model), flesh_of_model(model)
    s.smooth_forces(state.q, state.v, nothing)
    M = sparse_mass(model, s)
    places, energy = [], []
    for _ in range(steps):
        q = model.integrate(state.q, state.v, dt)
        after = prescribe_flesh(
            assemble_flesh(model, SolidState(q, state.v), nothing, dt), none, nothing
        ).velocity
        s.place(q)
        places.append(q)
        energy.append(flesh.elasticity.energy(flesh.nodes(s)) + 0.5 * state.v @ (M @ after))
        state = SolidState(q, after)
    return np.array(places), np.array(energy)


@pytest.mark.parametrize("steps_a_period", [6, 8, 12, 40])
def test_only_vibrations_that_a_step_cannot_follow_fade(steps_a_period: int) -> None:
    """The damping ratio of a bar's slowest vibration is DAMPED_SHARE s^DAMPING_ORDER / (2 w dt)."""
    model = clamped_bar(0.0)
    nothing = np.zeros(model.nv)
    K = static_forces(model, model.rest().q, nothing)[0].toarray()
    s = scratch(model)
    s.smooth_forces(model.rest().q, nothing, nothing)
    M = sparse_mass(model, s).toarray()
    share, modes = eigh(K, M, subset_by_index=(0, 0))
    # w of the step itself, for which 2 sin(w dt / 2) is W / sqrt(1 + W^2 / 2), W the exact w dt
    reach = 2.0 * np.sin(np.pi / steps_a_period)
    stretched = reach / np.sqrt(1.0 - 0.5 * reach**2)
    dt, periods = float(stretched / np.sqrt(share[0])), 6
    v = 1e-6 * modes[:, 0]
    _, energy = swung(model, v, dt, periods * steps_a_period)
    kept = stretched**2 / (2.0 + stretched**2)
    lost = 1.0 - (1.0 - 0.5 * DAMPED_SHARE * kept**DAMPING_ORDER) ** (
        2 * (periods - 1) * steps_a_period
    )
    first, last = energy[:steps_a_period].mean(), energy[-steps_a_period:].mean()
    assert 1.0 - last / first == pytest.approx(lost, rel=0.15, abs=1e-6)
    if steps_a_period == 40:
        assert lost < 2e-4


@pytest.mark.parametrize("dt", [1.6e-3, 3.2e-3])
def test_a_flag_that_swings_wide_keeps_whole(dt: float) -> None:
    """FSI3's flag, thrown into its second vibration without a fluid, at that flow's steps.

    Before fast vibrations faded, its energy doubled in 0.3 s, and it turned inside out.
    """
    model = flag_of(flag_tissue(2.0e6, 1e3))
    flesh = flesh_of_model(model)
    along = np.clip((flesh.rest[:, 0] - 0.25) / 0.35, 0.0, 1.0)
    thrown = np.zeros_like(flesh.rest)
    thrown[:, 1] = 2.0 * along**2 * (5.0 * along - 3.6)
    q, energy = swung(model, flesh.of_vertices(thrown), dt, round(0.8 / dt))
    tip = flesh.rest[:, 0].argmax()
    places = np.array([flesh.vertices(row)[tip, 1] for row in q[:: max(1, round(0.01 / dt))]])
    assert np.ptp(places) > 0.12
    settled, last = energy[len(energy) // 4], energy[-1]
    assert 0.8 * settled < last < 1.01 * settled
    s = scratch(model)
    s.place(q[-1])
    assert flesh.elasticity.volume_ratios(flesh.nodes(s)).min() > 0.9


def test_order_in_time_of_a_swinging_bar() -> None:
    """Where a clamped bar is after a third of its swing, against a run of shorter steps."""
    model = clamped_bar(-9.81)
    none, nothing = np.zeros(model.nv, bool), np.zeros(model.nv)

    def end(steps: int) -> Array:
        dt = 0.1 / steps
        state = model.rest()
        state.v[2::3] = -0.5 * 9.81 * dt  # velocities belong to the middle of the coming step
        for _ in range(steps):
            q = model.integrate(state.q, state.v, dt)
            system = assemble_flesh(model, SolidState(q, state.v), nothing, dt)
            state = SolidState(q, prescribe_flesh(system, none, nothing).velocity)
        return state.q

    exact = end(800)
    errors = [float(np.linalg.norm(end(n) - exact)) for n in (25, 50, 100)]
    order = np.log2(errors[0] / errors[2]) / 2.0
    assert order == pytest.approx(2.0, abs=0.2), errors
