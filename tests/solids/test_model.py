"""Model: displaced volumes, slab inertias, names, refusals."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flowborne.solids.mjcf import Given
from flowborne.solids.model import SolidModel


def one_body(geoms: str, slab: bool = False, joint: str = '<joint axis="0 0 1"/>') -> SolidModel:
    return SolidModel.from_string(
        f"<mujoco><worldbody><body name='b'>{joint}{geoms}</body></worldbody></mujoco>", slab=slab
    )


TETRAHEDRON = """<mujoco><asset><mesh name="m" vertex="0 0 0  2 0 0  0 2 0  0 0 2"/></asset>
<worldbody><body name="b"><freejoint/><geom type="mesh" mesh="m" density="500"/></body></worldbody>
</mujoco>"""


@pytest.mark.parametrize(
    ("geom", "volume"),
    [
        ('type="sphere" size=".3"', 4 / 3 * np.pi * 0.027),
        ('type="capsule" size=".2 .5"', np.pi * 0.04 * 1.0 + 4 / 3 * np.pi * 0.008),
        ('type="cylinder" size=".2 .5"', np.pi * 0.04),
        ('type="box" size=".1 .2 .3"', 0.048),
        ('type="ellipsoid" size=".1 .2 .3"', 4 / 3 * np.pi * 0.006),
    ],
)
def test_volume_is_closed_form(geom: str, volume: float) -> None:
    model = one_body(f'<geom {geom} pos=".4 .5 .6" euler="10 20 30"/>')
    assert model.volume[1] == pytest.approx(volume, rel=1e-13)
    np.testing.assert_allclose(model.centroid[1], [0.4, 0.5, 0.6], atol=1e-14)
    assert model.body_mass[1] == pytest.approx(1000 * volume, rel=1e-12)


def test_volume_of_mesh() -> None:
    model = SolidModel.from_string(TETRAHEDRON)
    assert model.volume[1] == pytest.approx(8 / 6, rel=1e-6)
    np.testing.assert_allclose(model.centroid[1], 0.5, atol=1e-6)
    assert model.body_mass[1] == pytest.approx(500 * 8 / 6, rel=1e-6)


def test_shared_volume_of_spheres_counts_once() -> None:
    model = one_body(
        '<geom type="sphere" size="1"/><geom type="sphere" size="1" pos="1 0 0"/>'
        '<geom type="box" size=".1 .1 .1" pos="5 0 0"/>'
    )
    lens = np.pi * (4 + 1) * (2 - 1) ** 2 / 12
    pair = 8 / 3 * np.pi - lens
    assert model.volume[1] == pytest.approx(pair + 0.008, rel=2e-4)
    np.testing.assert_allclose(
        model.centroid[1], [(0.5 * pair + 5 * 0.008) / (pair + 0.008), 0, 0], atol=2e-4
    )


@pytest.mark.parametrize("slab", [False, True])
@given(shift=st.floats(0.05, 1.9), turn=st.floats(0.0, 90.0))
@settings(max_examples=10, deadline=None)
def test_union_of_a_geom_with_a_part_of_it_is_the_geom(
    slab: bool, shift: float, turn: float
) -> None:
    """A small ball inside a bar adds nothing, wherever it is and however the body is turned."""
    bar = f'<geom type="box" size="1.2 .3 .4" euler="0 0 {turn}"/>'
    inside = np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))]) * (shift - 1.0)
    ball = f'<geom type="sphere" size=".2" pos="{inside[0]} {inside[1]} 0"/>'
    model = one_body(bar + ball, slab)
    assert model.volume[1] == pytest.approx(1.44 if slab else 1.152, rel=3e-4)
    np.testing.assert_allclose(model.centroid[1], 0.0, atol=3e-4)


def test_shared_mesh_counts_once() -> None:
    """A cube given as a mesh and the same cube as a box, shifted by half."""
    corners = " ".join(f"{x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    model = SolidModel.from_string(
        f"""<mujoco><asset><mesh name="m" vertex="{corners}"/></asset><worldbody><body name="b">
        <freejoint/><geom type="mesh" mesh="m"/>
        <geom type="box" size=".5 .5 .5" pos="1 .5 .5"/></body></worldbody></mujoco>"""
    )
    assert model.volume[1] == pytest.approx(1.5, rel=1e-6)
    np.testing.assert_allclose(model.centroid[1], [0.75, 0.5, 0.5], atol=1e-6)


@pytest.mark.parametrize(
    ("geom", "area", "polar"),
    [
        ('type="box" size=".5 .1 .3"', 0.2, 0.2 * 1.04 / 12),
        ('type="box" size=".3 .5 .1" euler="0 90 0"', 0.2, 0.2 * 1.04 / 12),
        ('type="sphere" size=".5" pos="0 0 .3"', np.pi * 0.16, np.pi * 0.4**4 / 2),
        ('type="cylinder" size=".4 2"', np.pi * 0.16, np.pi * 0.4**4 / 2),
        ('type="cylinder" size=".1 .5" euler="0 90 0"', 0.2, 0.2 * 1.04 / 12),
        ('type="ellipsoid" size=".4 .2 .7"', np.pi * 0.08, np.pi * 0.08 * (0.16 + 0.04) / 4),
    ],
)
def test_slab_inertia(geom: str, area: float, polar: float) -> None:
    model = one_body(f'<geom {geom} density="700"/>', slab=True)
    assert model.volume[1] == pytest.approx(area, rel=1e-9)
    assert model.body_mass[1] == pytest.approx(700 * area, rel=1e-9)
    np.testing.assert_allclose(model.mj.body_inertia[1], 700 * polar, rtol=1e-9)


def test_slab_stadium_matches_its_outline() -> None:
    """The closed forms of a lying capsule against the polygon of its outline."""
    model = one_body('<geom type="capsule" fromto="-.5 .2 0 .7 .2 0" size=".15"/>', slab=True)
    section = model.geom_shape[0].section(*model.rest_pose(0))
    points = section.outline(4000)[:, 0] @ section.axes.T
    x, y = points.T
    xn, yn = np.roll(points, -1, axis=0).T
    cross = x * yn - xn * y
    area = 0.5 * cross.sum()
    polar = (cross * (x * x + x * xn + xn * xn + y * y + y * yn + yn * yn)).sum() / 12
    assert section.area == pytest.approx(area, rel=1e-5)
    assert section.polar_moment == pytest.approx(polar, rel=1e-5)
    np.testing.assert_allclose(model.centroid[1], [0.1, 0.2, 0.0], atol=1e-14)


def test_slab_mesh_section() -> None:
    """The tetrahedron's section through z = 0 half way up is a right triangle of legs 1."""
    lowered = TETRAHEDRON.replace("0 0 0  2 0 0  0 2 0  0 0 2", "0 0 -1  2 0 -1  0 2 -1  0 0 1")
    model = SolidModel.from_string(lowered, slab=True)
    assert model.volume[1] == pytest.approx(0.5, rel=1e-6)
    np.testing.assert_allclose(model.centroid[1], [1 / 3, 1 / 3, 0.0], atol=1e-6)
    np.testing.assert_allclose(model.mj.body_inertia[1], 500 * 0.5 / 9, rtol=1e-5)


def test_slab_bodies_compose_about_their_common_centre() -> None:
    model = one_body(
        '<geom type="box" size=".5 .1 .3" pos=".5 0 0" density="10"/>'
        '<geom type="box" size=".1 .1 .3" pos="1.1 0 0" mass="1"/>',
        slab=True,
    )
    mass = 10 * 0.2 + 1
    centre = (2 * 0.5 + 1.1) / mass
    izz = 2 * (1.04 / 12 + (0.5 - centre) ** 2) + (0.08 / 12 + (1.1 - centre) ** 2)
    assert model.body_mass[1] == pytest.approx(mass, rel=1e-12)
    assert model.mj.body_ipos[1, 0] == pytest.approx(centre, rel=1e-12)
    assert model.mj.body_inertia[1, 2] == pytest.approx(izz, rel=1e-12)


def test_slab_locks_what_leaves_the_plane() -> None:
    model = SolidModel.from_string(
        """<mujoco><worldbody><body name="a" euler="90 0 0"><freejoint name="root"/>
        <geom type="box" size=".1 .1 .1"/>
        <body name="b"><joint name="h" axis="0 1 0"/><joint name="t" axis="1 0 0"/>
        <joint name="s" type="slide" axis="0 1 0"/><geom type="box" size=".1 .1 .1"/></body>
        </body></worldbody></mujoco>""",
        slab=True,
    )
    free = [n for n, locked in zip(model.dof_names, model.locked, strict=True) if not locked]
    assert free == ["root:x", "root:y", "root:ry", "h"]


@pytest.mark.parametrize(
    ("xml", "words"),
    [
        (
            "<body><geom size='1'/></body><body name='b' pos='0 0 .2'><geom size='1'/></body>",
            "'b' is at z = 0.2",
        ),
        (
            "<body><geom name='g' type='box' size='1 1 1' euler='30 0 0'/></body>",
            "'g' .box. has no local axis along z",
        ),
        (
            "<body><geom name='g' type='capsule' size='.1 1' euler='30 0 0'/></body>",
            "'g' .capsule. has no local axis along z",
        ),
        ("<body><geom name='g' size='.1' pos='0 0 1'/></body>", "misses the plane"),
    ],
)
def test_slab_refuses(xml: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        SolidModel.from_string(f"<mujoco><worldbody>{xml}</worldbody></mujoco>", slab=True)


def test_bad_text_and_unknown_names_are_refused() -> None:
    with pytest.raises(ValueError, match="model text cannot be read"):
        SolidModel.from_string("<mujoco><worldbody><boy/></worldbody></mujoco>")
    with pytest.raises(ValueError, match=r"nowhere\.xml cannot be read"):
        SolidModel.from_file("nowhere.xml")
    with pytest.raises(ValueError, match=r"the model has no joint 'wirst'"):
        one_body('<geom size="1"/>').dofs_of("wirst")


def test_contact_geoms_displace_nothing() -> None:
    model = one_body('<geom size=".6" group="3"/><geom size=".5"/>')
    assert model.ngeom == 1
    assert model.volume[1] == pytest.approx(np.pi / 6, rel=1e-12)


def test_names_ranges_and_dofs() -> None:
    model = SolidModel.from_string(
        """<mujoco><worldbody><body name="a"><freejoint name="root"/><geom size=".1"/>
        <body><joint name="b" type="ball"/><geom size=".1"/>
        <body><joint range="-30 40"/><geom size=".1"/></body></body></body></worldbody></mujoco>"""
    )
    assert model.body_names == ("world", "a", "body2", "body3")
    assert model.dof_names[5:] == ("root:rz", "b:rx", "b:ry", "b:rz", "joint2")
    np.testing.assert_array_equal(model.dofs_of("b"), [6, 7, 8])
    np.testing.assert_array_equal(model.positions_of("b"), [7, 8, 9, 10])
    np.testing.assert_allclose(model.dof_range[9], np.radians([-30, 40]))
    assert model.dof_position[9] == 11
    assert np.all(model.dof_position[:9] == -1)


def test_pickle_gives_the_same_model() -> None:
    model = pickle.loads(pickle.dumps(one_body('<geom type="box" size=".5 .1 .3"/>', slab=True)))
    assert model.volume[1] == pytest.approx(0.2)
    assert model.rest().v.shape == (1,)


@given(st.lists(st.floats(-20, 20), min_size=9, max_size=9), st.floats(1e-3, 0.2))
@settings(max_examples=30, deadline=None)
def test_integrate_keeps_unit_quaternions_and_goes_back(v: list[float], dt: float) -> None:
    model = SolidModel.from_string(
        """<mujoco><worldbody><body><freejoint/><geom size=".1"/><body><joint type="ball"/>
        <geom size=".1"/></body></body></worldbody></mujoco>"""
    )
    start = model.rest().q
    moved = model.integrate(start, np.array(v), dt)
    assert np.linalg.norm(moved[3:7]) == pytest.approx(1.0, abs=1e-12)
    assert np.linalg.norm(moved[7:]) == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(model.integrate(moved, -np.array(v), dt), start, atol=1e-12)
    np.testing.assert_array_equal(start, model.rest().q)


ROBOT = """
<robot name="fish"><link name="base"><inertial><mass value="2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link>
<link name="tail"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><box size="0.1 0.1 0.3"/></geometry></collision></link>
<joint name="bend" type="revolute"><parent link="base"/><child link="tail"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>
"""


def test_root_of_a_urdf_floats_when_it_is_told_to(tmp_path: Path) -> None:
    path = tmp_path / "fish.urdf"
    path.write_text(ROBOT)
    held = SolidModel.from_file(path)
    assert held.body_names == ("world", "tail"), "MuJoCo makes the root part of the world"
    free = SolidModel.from_file(path, given=Given(floating=("base",)))
    assert free.body_names == ("world", "base", "tail")
    assert free.joint_names == ("base", "bend")
    assert free.nv == 7
    assert free.body_mass.tolist() == [0.0, 2.0, 1.0]
    with pytest.raises(
        ValueError, match=r"no body 'tail' that hangs .* can be floating, are: base"
    ):
        SolidModel.from_file(path, given=Given(floating=("tail",)))


IMPOSSIBLE = {
    'damping="nan"': "joint 'j' has damping nan. Give a number of 0 or more.",
    'damping="-1"': "joint 'j' has damping -1. Give a number of 0 or more.",
    'armature="-1"': "joint 'j' has armature -1. Give a number of 0 or more.",
    'frictionloss="inf"': "joint 'j' has frictionloss inf. Give a number of 0 or more.",
    'stiffness="-5"': "joint 'j' has stiffness -5. Give a number of 0 or more.",
    'axis="nan 0 1"': "joint 'j' has axis nan. Give a finite number.",
    'pos="0 inf 0"': "joint 'j' has pos inf. Give a finite number.",
}


@pytest.mark.parametrize("given", IMPOSSIBLE)
@pytest.mark.filterwarnings("ignore:Inertia matrix")
def test_numbers_that_no_body_can_have_are_refused(given: str) -> None:
    box = '<geom type="box" size="0.1 0.2 0.1"/>'
    text = f'<mujoco><worldbody><body name="b"><joint name="j" {given}/>{box}</body></worldbody>'
    with pytest.raises(ValueError, match=re.escape(IMPOSSIBLE[given])):
        SolidModel.from_string(text + "</mujoco>")


def test_equalities_and_tendons_are_looked_at_too() -> None:
    bodies = """<body name="a"><joint name="i"/><geom type="box" size="0.1 0.2 0.1"/></body>
      <body name="b"><joint name="j"/><geom type="box" size="0.1 0.2 0.1"/></body>"""
    tied = '<equality><joint name="gear" joint1="i" joint2="j" polycoef="0 nan 0 0 0"/></equality>'
    cord = """<tendon><fixed name="cord" stiffness="-3"><joint joint="i" coef="1"/></fixed>
      </tendon>"""
    for more, said in ((tied, "equality 'gear' has data nan"), (cord, "tendon 'cord' has stiff")):
        with pytest.raises(ValueError, match=re.escape(said)):
            SolidModel.from_string(f"<mujoco><worldbody>{bodies}</worldbody>{more}</mujoco>")


def test_what_follows_the_end_of_a_model_is_refused() -> None:
    text = '<mujoco><worldbody><geom type="sphere" size="1"/></worldbody></mujoco>'
    with pytest.raises(ValueError, match="cannot be read: junk after document element: line 1"):
        SolidModel.from_string(text + text)


HUGE = {
    '<asset><hfield name="hill" nrow="100000" ncol="100000" size="1 1 1 1"/></asset>': (
        "<hfield> 'hill' asks for 74.5 GB, and 1 GB is the most. Make it smaller."
    ),
    '<size memory="2T"/>': "<size memory> asks for 2.05e+03 GB",
    '<size nuserdata="1000000000"/>': "<size nuserdata> asks for 7.45 GB",
    '<worldbody><replicate count="1000"><replicate count="1000"><body><joint/>'
    '<geom size="1"/></body></replicate></replicate></worldbody>': (
        "<replicate> makes 1e+06 copies, and 20000 are the most. Take fewer."
    ),
}


@pytest.mark.parametrize("asked", HUGE)
def test_models_that_ask_for_gigabytes_are_refused_before_they_are_made(asked: str) -> None:
    with pytest.raises(ValueError, match=re.escape(HUGE[asked])):
        SolidModel.from_string(f"<mujoco>{asked}</mujoco>")


@pytest.mark.parametrize(
    ("joint", "geom", "told"),
    [
        (
            'range="90 -90"',
            "",
            "joint 'j' has a range from 90 to -90. Put the smaller number first",
        ),
        ("", 'density="nan"', "geom 'g' has density nan. Give a number of 0 or more"),
        ("", 'density="-3"', "geom 'g' has density -3. Give a number of 0 or more"),
        ("", 'mass="-1"', "geom 'g' has mass -1. Give a number of 0 or more"),
    ],
)
def test_numbers_that_a_density_from_elsewhere_hides_are_refused(joint, geom, told):
    text = f"""<mujoco><worldbody><body name="b"><joint name="j" {joint}/>
    <geom name="g" size="0.1" {geom}/></body></worldbody></mujoco>"""
    with pytest.raises(ValueError, match=told):
        SolidModel.from_string(text, density=500.0)


def test_nothing_but_ours_is_said_of_a_mesh_without_volume(
    capfd: pytest.CaptureFixture[str],
) -> None:
    flat = np.random.RandomState(0).rand(12, 3) * [1.0, 1.0, 1e-14]
    vertices = " ".join(map(str, flat.ravel()))
    with pytest.raises(ValueError, match="qhull error"):
        SolidModel.from_string(TETRAHEDRON.replace("0 0 0  2 0 0  0 2 0  0 0 2", vertices))
    assert capfd.readouterr() == ("", "")
