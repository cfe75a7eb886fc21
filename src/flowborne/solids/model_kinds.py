"""Files that describe creatures and that MuJoCo does not read, each with what to do about it."""

from __future__ import annotations

from xml.etree.ElementTree import Element

ROOTS = {
    "sdf": (
        "it is SDFormat of Gazebo, and MJCF and URDF are read. Convert it to MJCF by `sdf2mjcf` of "
        "the package sdformat-mjcf."
    ),
    "mujocoinclude": ("it is a part for other models to include. Give the model that includes it."),
    "COLLADA": "it is a COLLADA scene, and MJCF and URDF are read. Give the model that names it.",
}
"""Root of another kind of file -> what is wrong, and what to do."""

XACRO = "/xacro}"
"""End of the namespace of macros, before a tag."""


def check_kind(root: Element, suffix: str) -> None:
    """Raise ValueError for a model in a language that MuJoCo does not read.

    suffix  of its file's name
    """
    if root.tag in ROOTS:
        raise ValueError(ROOTS[root.tag])
    if suffix == ".xacro" or any(XACRO in e.tag for e in root.iter()):
        raise ValueError(
            "it is written in xacro, the macros of ROS. Expand it by "
            "`xacro robot.urdf.xacro > robot.urdf`, and give that."
        )
    if root.tag not in ("mujoco", "robot"):
        raise ValueError(
            f"its root is <{root.tag}>, and that of MJCF is <mujoco>, that of URDF <robot>. "
            "Give a model."
        )
    if root.find(".//composite") is not None:
        raise ValueError(
            "it has a <composite>, which MuJoCo 4 does not have. Load it in MuJoCo 3, save it by "
            "`mujoco.mj_saveLastXML`, which writes the bodies themselves, and give that."
        )


def check_mesh(name: str) -> None:
    """Raise ValueError for a mesh file of a kind that MuJoCo does not read."""
    if name.lower().endswith(".dae"):
        raise ValueError(
            f"its mesh {name} is COLLADA, which MuJoCo does not read. Save it as .obj or .stl and "
            "name that."
        )
