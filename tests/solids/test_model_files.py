"""Files that a model names: what MuJoCo reads is gathered whole, and nothing else."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from flowborne.solids import mjcf
from flowborne.solids.model_files import ModelFiles, gathered

BALL = trimesh.creation.icosphere(0, 0.1)
STL = BALL.export(file_type="stl")
OTHER = trimesh.creation.box((0.1, 0.1, 0.1)).export(file_type="stl")


def written(folder: Path, files: Mapping[str, str | bytes]) -> Path:
    """Files in a folder; the path of the first one."""
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    return folder / next(iter(files))


def copied(files: ModelFiles, folder: Path) -> mujoco.MjModel:
    """What plain MuJoCo makes of the copy on disc, which is gathered the same again."""
    path = written(folder, {files.name: files.texts[files.name], **files.texts, **files.assets})
    again = gathered(path)
    assert (again.texts, again.assets) == (files.texts, files.assets)
    return mujoco.MjModel.from_xml_path(str(path))


def compiled(path: Path, packages: tuple[Path, ...] = ()) -> mujoco.MjModel:
    return mjcf.bones_of(path, False, (0.0, 0.0, 0.0), mjcf.Given(packages=packages))[1]


URDF = """<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <link name="a b">
    <inertial><mass value="1"/>
      <inertia ixx="{ixx}" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><mesh filename="package://arm_description/seen.dae"/></geometry></visual>
    <collision><geometry><mesh filename="{mesh}"/></geometry></collision>
  </link>
  <link name="tip">
    <inertial><mass value="{mass}"/>
      <inertia ixx="{mass}" iyy="{mass}" izz="{mass}" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><mesh filename="{mesh}"/></geometry></collision>
  </link>
  <joint name="elbow" type="revolute"><parent link="a b"/><child link="tip"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <gazebo><plugin name="control" filename="libgazebo_ros_control.so"/></gazebo>
</robot>"""


def test_of_a_urdf_the_meshes_that_collide_are_copied_and_no_visuals_or_plugins(
    tmp_path: Path,
) -> None:
    robot = URDF.format(mesh="package://arm_description/meshes/link.stl", ixx=1, mass=1)
    path = written(
        tmp_path / "ros" / "arm_description", {"urdf/arm.urdf": robot, "meshes/link.stl": STL}
    )
    files = gathered(path)
    assert files.texts.keys() == {"arm.urdf"}
    assert files.assets == {"assets/link.stl": STL}
    assert b'filename="package://arm_description/seen.dae"' in files.texts["arm.urdf"]
    assert copied(files, tmp_path / "run").nmesh == 1
    assert compiled(path).nmesh == 1


def test_height_fields_and_skins_are_looked_for_in_meshdir(tmp_path: Path) -> None:
    model = """<mujoco><compiler meshdir="shapes" texturedir="pictures"/>
      <asset><hfield name="hill" file="hill.bin" size="1 1 1 1"/><mesh file="ball.stl"/>
        <skin name="fur" file="fur.skn"/></asset>
      <worldbody><geom type="hfield" hfield="hill"/>
        <body name="b"><freejoint/><geom type="mesh" mesh="ball"/></body></worldbody></mujoco>"""
    field = b"".join(n.to_bytes(4, "little") for n in (2, 2, 0, 0, 0, 0))
    path = written(tmp_path, {
        "model.xml": model, "shapes/hill.bin": field, "shapes/ball.stl": STL,
        "shapes/fur.skn": fur(),
    })  # fmt: skip
    mj = copied(gathered(path), tmp_path / "run")
    assert (mj.nhfield, mj.nskin, mj.nmesh) == (1, 1, 1)
    assert compiled(path).nhfield == 1


def fur() -> bytes:
    """A skin of one triangle on the body b, as MuJoCo's .skn files are."""
    counts = np.array([3, 0, 1, 1], np.int32).tobytes()
    corners = np.array([0, 0, 0, 1, 0, 0, 0, 1, 0], np.float32).tobytes()
    face = np.array([0, 1, 2], np.int32).tobytes()
    name = b"b".ljust(40, b"\0")
    bind = np.array([0, 0, 0, 1, 0, 0, 0], np.float32).tobytes()
    held = np.array([3, 0, 1, 2], np.int32).tobytes() + np.ones(3, np.float32).tobytes()
    return counts + corners + face + name + bind + held


ATTACHED = {
    "main.xml": """<mujoco>
      <compiler meshdir="shapes"/>
      <asset><model name="leg" file="parts/leg.xml"/><mesh file="ball.stl"/></asset>
      <worldbody><body name="trunk"><freejoint/><geom type="mesh" mesh="ball"/>
        <frame pos="0.3 0 0"><attach model="leg" body="thigh" prefix="left_"/></frame>
      </body></worldbody></mujoco>""",
    "shapes/ball.stl": STL,
    "parts/leg.xml": """<mujoco><compiler meshdir="shapes"/>
      <asset><mesh file="ball.stl"/></asset><include file="leg_body.xml"/></mujoco>""",
    "parts/leg_body.xml": """<mujoco><worldbody><body name="thigh"><joint name="hip"/>
      <geom type="mesh" mesh="ball"/></body></worldbody></mujoco>""",
    "parts/shapes/ball.stl": OTHER,
}
"""Two models that name files in the same way, each from its own folder."""


def test_a_model_that_is_attached_brings_what_it_names(tmp_path: Path) -> None:
    files = gathered(written(tmp_path, ATTACHED))
    mj = copied(files, tmp_path / "run")
    assert sorted(mj.mesh_facenum) == [12, 20]
    assert files.sources["assets/leg.xml"] == tmp_path / "parts/leg.xml"


def test_nameless_meshes_keep_the_names_of_their_files(tmp_path: Path) -> None:
    model = """<mujoco>
      <asset><mesh file="one/ball.stl"/><mesh name="other" file="two/ball.stl"/></asset>
      <worldbody><geom type="mesh" mesh="ball"/><geom type="mesh" mesh="other"/></worldbody>
      </mujoco>"""
    path = written(tmp_path, {"m.xml": model, "one/ball.stl": STL, "two/ball.stl": OTHER})
    assert sorted(copied(gathered(path), tmp_path / "run").mesh_facenum) == [12, 20]


def test_what_is_wrong_in_a_model_with_files_is_named_by_its_line(tmp_path: Path) -> None:
    model = """<mujoco>
      <!-- a comment
           of two lines -->
      <compiler
         meshdir="shapes"/>
      <asset><mesh file='ball.stl'
                   scale="1 1 1"/></asset>
      <worldbody><geom kind="mesh"/></worldbody></mujoco>"""
    path = written(tmp_path, {"m.xml": model, "shapes/ball.stl": STL})
    with pytest.raises(ValueError, match=r"unrecognized attribute: 'kind'\s.*line 8"):
        compiled(path)


def test_packages_are_looked_for_where_the_scene_says(tmp_path: Path) -> None:
    robot = URDF.format(mesh="package://arm_description/link.stl", ixx=1, mass=1)
    path = written(tmp_path / "home", {"arm.urdf": robot})
    with pytest.raises(ValueError, match="'arm_description' by packages in"):
        compiled(path)
    written(tmp_path / "ros", {"arm_description/link.stl": STL})
    assert compiled(path, (tmp_path / "ros",)).nmesh == 1
    manifest = "<package><name>arm_description</name></package>"
    written(tmp_path / "clone-main", {"package.xml": manifest, "link.stl": STL})
    assert compiled(path, (tmp_path / "clone-main",)).nmesh == 1


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.sdf", "<sdf version='1.9'><model name='a'/></sdf>", "it is SDFormat of Gazebo"),
        ("a.urdf.xacro", "<robot name='a'><link name='b'/></robot>", "it is written in xacro"),
        (
            "a.urdf",
            "<robot name='a' xmlns:xacro='http://www.ros.org/wiki/xacro'>"
            "<xacro:macro name='leg'/></robot>",
            "it is written in xacro",
        ),
        ("a.xml", "<mujocoinclude/>", "it is a part for other models to include"),
        ("a.xml", "<package/>", "its root is <package>"),
        (
            "a.xml",
            "<mujoco><worldbody><body><composite type='cable'/></body></worldbody></mujoco>",
            "a.xml has a <composite>, which MuJoCo 4 does not have. Write its cables as chains",
        ),
        ("a.urdf", URDF.format(mesh="link.DAE", ixx=1, mass=1), "its mesh link.DAE is COLLADA"),
        ("a.xml", "<mujoco><include file='a.xml'/></mujoco>", "includes a.xml once more"),
    ],
)
def test_what_mujoco_does_not_read_is_said_in_a_sentence(
    tmp_path: Path, name: str, text: str, said: str
) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        compiled(written(tmp_path, {name: text}))


@pytest.mark.parametrize(
    ("ixx", "mass", "body", "remedy"),
    [
        (5, 1, "a b", '<compiler balanceinertia="true"/>'),
        (1, 0, "tip", '<compiler boundmass="1e-06" boundinertia="1e-06"/>'),
    ],
)
def test_an_inertia_that_mujoco_refuses_names_the_body_and_a_remedy_that_works(
    tmp_path: Path, ixx: float, mass: float, body: str, remedy: str
) -> None:
    robot = URDF.format(mesh="link.stl", ixx=ixx, mass=mass)
    if body == "a b":
        robot = robot.replace(
            "</robot>",
            "<link name='world'/><joint name='root' type='floating'><parent link='world'/>"
            "<child link='a b'/></joint></robot>",
        )
    path = written(tmp_path, {"arm.urdf": robot, "link.stl": STL})
    with pytest.raises(ValueError, match=f"inertia of body '{body}'") as raised:
        compiled(path)
    assert remedy in str(raised.value)
    path.write_text(robot.replace("</robot>", f"<mujoco>{remedy}</mujoco></robot>"))
    assert compiled(path).nbody > 1


@pytest.mark.parametrize("name", ["arm.URDF", "arm.Urdf", "arm.xml", "arm"])
@pytest.mark.parametrize("before", ["", "<!-- from a\nsketch -->\n", "\n  "])
def test_a_urdf_is_known_by_its_content_and_may_begin_with_a_comment(
    tmp_path: Path, name: str, before: str
) -> None:
    robot = URDF.format(mesh="link.STL", ixx=1, mass=1)
    declared = f"{before}<?xml version='1.0' encoding='utf-8'?>\n{robot}"
    path = written(tmp_path, {name: declared, "link.STL": STL})
    mj = compiled(path)
    assert (mj.nmesh, mj.njnt) == (1, 1)
    text = gathered(path).texts["arm.urdf"].decode()
    assert text.startswith("<?xml")
    assert text.count("\n") == declared.count("\n")
    copied(gathered(path), tmp_path / "copy")


@pytest.mark.parametrize("name", ["ball.MJCF", "ball.XML", "ball.mjcf"])
def test_mjcf_is_known_by_its_content(tmp_path: Path, name: str) -> None:
    """As the model of a scene, and as one that another attaches."""
    ball = "<mujoco><worldbody><body name='ball'><geom size='0.1'/></body></worldbody></mujoco>"
    whole = (
        f"<mujoco><asset><model name='ball' file='{name}'/></asset><worldbody>"
        "<attach model='ball' body='ball' prefix='a_'/></worldbody></mujoco>"
    )
    path = written(tmp_path, {"whole.xml": whole, name: ball})
    assert compiled(path).nbody == compiled(tmp_path / name).nbody == 2


MUSCLE = """<mujoco><worldbody><site name="hook" pos="0 0 1"/><body><joint name="elbow" {joint}/>
  <geom type="capsule" size="0.05" fromto="0 0 0 0.2 0 0"/><site name="hand" pos="0.2 0 0"/></body>
  </worldbody><tendon><spatial name="cord" {tendon}><site site="hook"/><site site="hand"/></spatial>
  </tendon><actuator><muscle name="biceps" joint="elbow" {muscle}/></actuator></mujoco>"""


def test_a_muscle_without_range_is_explained_with_remedies_that_work(tmp_path: Path) -> None:
    def given(**more: str) -> Path:
        text = MUSCLE.format(**{"joint": "", "tendon": "", "muscle": ""} | more)
        return written(tmp_path, {"arm.xml": text})

    said = (
        "'biceps' is a muscle, whose force goes by its length between the shortest and the "
        "longest. MuJoCo looks for these by pulling 'elbow' both ways until it stops"
    )
    with pytest.raises(ValueError, match=re.escape(said)):
        compiled(given())
    assert compiled(given(joint='range="-60 60"')).nu == 1
    assert compiled(given(muscle='lengthrange="-1 1"')).nu == 1


WRAPPED = """<mujoco><worldbody><site name="hook" pos="-.15 0 0"/><site name="side" pos="0 -.15 0"/>
  <body><joint name="shoulder" axis="0 0 1" range="0 120" damping="0.1"/>
    <geom type="capsule" size=".045" fromto="0 0 0 .5 0 0"/>
    <geom name="pulley" type="cylinder" size=".1 .05" mass="0"/>
    <site name="hand" pos="0.15 -0.06 0"/></body></worldbody>
  <tendon><spatial name="cord"><site site="hook"/><geom geom="pulley" sidesite="side"/>
  <site site="hand"/></spatial></tendon>
  <actuator><muscle name="extensor" tendon="cord" {more}/></actuator></mujoco>"""


def test_a_muscle_that_slips_off_its_pulley_is_explained(tmp_path: Path) -> None:
    """Its joint has a range, at the end of which the tendon jumps: a lengthrange alone mends it."""
    said = r"'extensor' is a muscle, .* it did not \(Lengthrange .*\).* where a tendon slips off"
    with pytest.raises(ValueError, match=said):
        compiled(written(tmp_path, {"arm.xml": WRAPPED.format(more="")}))
    more = 'lengthrange="0.34 0.54"'
    assert compiled(written(tmp_path, {"arm.xml": WRAPPED.format(more=more)})).nu == 1
