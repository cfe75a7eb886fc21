"""What is wrong with a model although MuJoCo would accept it, or would refuse it with no remedy.

Models in other languages, sizes that exhaust the memory, numbers that no body can have, and options
that have no effect here or switch parts off.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import prod
from pathlib import Path
from xml.etree.ElementTree import Element

import mujoco
import numpy as np

from flowborne.base.phrases import listed

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

MOST_BYTES = 1 << 30
"""Most bytes that one element of a model may take."""

MOST_COPIES = 20_000
"""Most copies that a model may make of its parts."""

UNITS = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40, "P": 1 << 50, "E": 1 << 60}
"""MuJoCo's letters after a size of memory."""

NUMBER = 8
"""Bytes of a number."""

FINITE = (
    ("body", "body", ("pos", "quat", "ipos", "iquat")),
    ("geom", "geom", ("pos", "quat", "size", "margin", "gap")),
    ("joint", "jnt", ("pos", "axis", "range")),
    ("tendon", "tendon", ("range", "lengthspring")),
    ("equality", "eq", ("data", "solref", "solimp")),
)
"""Element in MJCF, its prefix in MuJoCo's model, and attributes that may have any finite value."""

NOT_NEGATIVE = (
    ("body", "body", ("mass", "inertia")),
    ("geom", "geom", ("friction",)),
    ("joint", "jnt", ("stiffness",)),
    ("tendon", "tendon", ("stiffness", "damping", "frictionloss", "armature")),
    ("joint", "dof", ("damping", "armature", "frictionloss")),
)
"""The same for attributes that must be 0 or more; MuJoCo has some of joints per dof."""


REPLACED = {"integrator": mujoco.mjtIntegrator, "solver": mujoco.mjtSolver, "cone": mujoco.mjtCone}
"""Options that the coupled solve has its own of, and MuJoCo's names for their values."""

MEDIUM = ("density", "viscosity", "wind")
"""Options of MuJoCo's own medium, which the fluid replaces."""

SWITCHES = ("constraint", "contact", "damper", "equality", "frictionloss", "limit", "spring")
"""MuJoCo's flags that switch parts of a model off, here as well."""

IGNORED = ("gravity", "actuation", "clampctrl", "sensor")
"""MuJoCo's flags that switch nothing off here: the scene has its gravity, an actuator acts where it
has a control within its range, and sensors are always read."""


def check_kind(root: Element, suffix: str) -> None:
    """Raise ValueError for a model in a language that MuJoCo does not read.

    suffix  of the file name
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


def check_composites(root: Element, path: Path) -> None:
    """Raise ValueError for a text of a model that has one of MuJoCo 3's composites."""
    if root.find(".//composite") is not None:
        raise ValueError(
            f"{path.name} has a <composite>, which MuJoCo 4 does not have. Write its cables as "
            f"chains of capsules by `flowborne chains {path}`, and give {path.stem}-chains.xml."
        )


def links_to_see(robot: Element) -> list[str]:
    """Links of a URDF that have visual shapes alone, which MuJoCo discards; none of MJCF."""
    if robot.tag != "robot":
        return []
    kept = [c.get("discardvisual") == "false" for c in robot.iterfind("mujoco/compiler")]
    return [
        link.get("name", "")
        for link in robot.iterfind("link")
        if not any(kept) and link.find("visual") is not None and link.find("collision") is None
    ]


def check_mesh(name: str) -> None:
    """Raise ValueError for a mesh file of a kind that MuJoCo does not read."""
    if name.lower().endswith(".dae"):
        raise ValueError(
            f"its mesh {name} is COLLADA, which MuJoCo does not read. Save it as .obj or .stl and "
            "name that."
        )


def too_large(model: Element) -> Iterator[str]:
    """Sentences about elements above MOST_BYTES, and about more copies than MOST_COPIES."""
    for field in model.iter("hfield"):
        size = NUMBER * _count(field, "nrow") * _count(field, "ncol")
        yield from _above_limit("hfield", field.get("name", ""), size)
    for flex in model.iter("flexcomp"):
        size = NUMBER * 3 * prod(_whole(n) for n in flex.get("count", "1").split())
        yield from _above_limit("flexcomp", flex.get("name", ""), size)
    for sizes in model.iter("size"):
        for key in sizes.attrib:
            if key == "memory":
                yield from _above_limit("size memory", "", _bytes(sizes.get(key, "")))
            elif key.startswith("nuser") or key in ("njmax", "nconmax", "nkey"):
                yield from _above_limit(f"size {key}", "", NUMBER * _count(sizes, key))
    copies = _copies(model)
    if copies > MOST_COPIES:
        yield f"<replicate> makes {copies:.2g} copies, and {MOST_COPIES} are the most. Take fewer."


def _above_limit(tag: str, name: str, size: int) -> Iterator[str]:
    if size > MOST_BYTES:
        called = f"<{tag}>" + (f" '{name}'" if name else "")
        yield (
            f"{called} asks for {size / 2**30:.3g} GB, and {MOST_BYTES / 2**30:g} GB is the most. "
            "Make it smaller."
        )


def _copies(element: Element) -> int:
    """Number of copies that <replicate> elements make; nested ones multiply."""
    inside = sum(map(_copies, element))
    return _count(element, "count") * max(inside, 1) if element.tag == "replicate" else inside


def _count(element: Element, key: str) -> int:
    return _whole(element.get(key, "0"))


def _whole(text: str) -> int:
    """A whole number; 0 for a text that MuJoCo refuses."""
    try:
        return max(int(float(text)), 0)
    except (ValueError, OverflowError):
        return 0


def _bytes(text: str) -> int:
    letter = text[-1:].upper()
    return _whole(text[:-1]) * UNITS[letter] if letter in UNITS else _whole(text)


def wrong_spec_values(spec: mujoco.MjSpec) -> Iterator[str]:
    """Sentences about wrong numbers that compiling, or a density from the scene, would hide."""
    for geom in spec.geoms:
        for attribute in ("density", "mass"):
            value = getattr(geom, attribute)
            given = attribute == "density" or not np.isnan(value)
            if given and not _possible(np.array(value), 0.0):
                called = f"'{geom.name}'" if geom.name else f"of body '{geom.parent.name}'"
                yield f"geom {called} has {attribute} {value:g}. Give a number of 0 or more."
    for called, attribute, elements in (
        ("joint", "range", spec.joints),
        ("joint", "actfrcrange", spec.joints),
        ("tendon", "range", spec.tendons),
        ("tendon", "actfrcrange", spec.tendons),
        ("actuator", "ctrlrange", spec.actuators),
        ("actuator", "forcerange", spec.actuators),
        ("actuator", "actrange", spec.actuators),
    ):
        for element in elements:
            low, high = getattr(element, attribute)
            if low > high or low == high != 0.0:
                key = attribute.replace("actfrc", "actuatorfrc")
                how = "Put the smaller number first" if low > high else "Give two numbers"
                yield f"{called} '{element.name}' has a {key} from {low:g} to {high:g}. {how}."


def wrong_model_values(mj: mujoco.MjModel) -> Iterator[str]:
    """Sentences about wrong numbers of a compiled model, element by element."""
    allowed = (FINITE, -np.inf, "a finite number"), (NOT_NEGATIVE, 0.0, "a number of 0 or more")
    for table, least, wanted in allowed:
        for kind, prefix, attribute in ((k, p, a) for k, p, some in table for a in some):
            values = getattr(mj, f"{prefix}_{attribute}")
            rows = values.reshape(len(values), -1 if values.size else 1)
            wrong = ~_possible(rows, least)
            for row in np.flatnonzero(wrong.any(axis=1)):
                element = int(mj.dof_jntid[row] if prefix == "dof" else row)
                name = mujoco.mj_id2name(mj, mujoco.mju_str2Type(kind), element) or str(element)
                value = rows[row, wrong[row]][0]
                yield f"{kind} '{name}' has {attribute} {value:g}. Give {wanted}."


def _possible(values: np.ndarray, least: float) -> np.ndarray:
    return np.isfinite(values) & (values >= least)


def replaced_options(
    spec: mujoco.MjSpec, gravity: tuple[float, ...], step: float, on_floors: bool
) -> Iterator[str]:
    """Options of a model file that differ from MuJoCo's defaults and have no effect.

    gravity    m/s^2 of the scene
    step       s, of the scene
    on_floors  whether the model has a floor, on which the default gravity counts as given
    """
    option, default = spec.option, mujoco.MjSpec().option
    given = not np.array_equal(option.gravity, default.gravity) or on_floors
    if given and not np.array_equal(option.gravity, gravity):
        x, y, z = option.gravity
        own = ", ".join(f"{g:g}" for g in gravity)
        yield f"its gravity of ({x:g}, {y:g}, {z:g}) m/s^2, where the scene has ({own})"
    if option.timestep != default.timestep:
        yield f"its timestep of {1e3 * option.timestep:g} ms, where a step is {1e3 * step:.3g} ms"
    changed = [
        f"{key} {kinds(getattr(option, key)).name.rpartition('_')[2].lower()}"
        for key, kinds in REPLACED.items()
        if getattr(option, key) != getattr(default, key)
    ]
    changed += [key for key in MEDIUM if np.any(getattr(option, key) != getattr(default, key))]
    if option.noslip_iterations:
        changed.append("noslip_iterations")
    if option.disableactuator:
        changed.append("actuatorgroupdisable")
    changed += [f"{flag} disabled" for flag in _disabled(option, IGNORED)]
    if changed:
        yield f"options {listed(changed)}"


def disabled_parts(spec: mujoco.MjSpec) -> list[str]:
    """Those of SWITCHES that a model file switches off."""
    return _disabled(spec.option, SWITCHES)


def _disabled(option: mujoco.MjOption, flags: tuple[str, ...]) -> list[str]:
    bits = mujoco.mjtDisableBit
    return [f for f in flags if option.disableflags & getattr(bits, f"mjDSBL_{f.upper()}")]


def bodies_with_own_inertia(spec: mujoco.MjSpec) -> list[str]:
    """Names of the bodies whose mass is that of their <inertial>, and not of their geoms."""
    if spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        return []
    return [body.name for body in spec.bodies if body.explicitinertial]
