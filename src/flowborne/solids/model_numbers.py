"""Numbers of a compiled model that no body can have: MuJoCo takes most of them, and simulates."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

OBJ = mujoco.mjtObj

FINITE = {
    OBJ.mjOBJ_BODY: ("pos", "quat", "ipos", "iquat"),
    OBJ.mjOBJ_GEOM: ("pos", "quat", "size", "margin", "gap"),
    OBJ.mjOBJ_JOINT: ("pos", "axis", "range"),
    OBJ.mjOBJ_TENDON: ("range", "lengthspring"),
    OBJ.mjOBJ_EQUALITY: ("data", "solref", "solimp"),
}
"""Kind of an element -> its attributes of any finite value."""

NOT_NEGATIVE = {
    OBJ.mjOBJ_BODY: ("mass", "inertia"),
    OBJ.mjOBJ_GEOM: ("friction",),
    OBJ.mjOBJ_JOINT: ("stiffness",),
    OBJ.mjOBJ_TENDON: ("stiffness", "damping", "frictionloss", "armature"),
}
"""Those that are not below zero either."""

OF_DOFS = ("damping", "armature", "frictionloss")
"""Attributes of joints that the model keeps by degree of freedom, not below zero."""

PREFIX = {
    OBJ.mjOBJ_BODY: ("body", "body"),
    OBJ.mjOBJ_GEOM: ("geom", "geom"),
    OBJ.mjOBJ_JOINT: ("jnt", "joint"),
    OBJ.mjOBJ_TENDON: ("tendon", "tendon"),
    OBJ.mjOBJ_EQUALITY: ("eq", "equality"),
}
"""Kind -> how the model's arrays and MJCF call it."""


def misgiven(spec: mujoco.MjSpec) -> Iterator[str]:
    """What is wrong with numbers that MuJoCo, or a density from elsewhere, would read over."""
    for geom in spec.geoms:
        for attribute in ("density", "mass"):
            value = getattr(geom, attribute)
            given = attribute == "density" or not np.isnan(value)
            if given and not _possible(np.array(value), 0.0):
                called = f"'{geom.name}'" if geom.name else f"of body '{geom.parent.name}'"
                yield f"geom {called} has {attribute} {value:g}. Give a number of 0 or more."
    for called, elements in (("joint", spec.joints), ("tendon", spec.tendons)):
        for element in elements:
            low, high = element.range
            if low > high:
                yield (
                    f"{called} '{element.name}' has a range from {low:g} to {high:g}. "
                    "Put the smaller number first."
                )


def impossible(mj: mujoco.MjModel) -> Iterator[str]:
    """What is wrong with the numbers of a model, element by element."""
    for table, least in ((FINITE, -np.inf), (NOT_NEGATIVE, 0.0)):
        for kind, attributes in table.items():
            array, called = PREFIX[kind]
            for attribute in attributes:
                values = getattr(mj, f"{array}_{attribute}")
                yield from _wrong(mj, kind, called, attribute, values, least)
    for attribute in OF_DOFS:
        values = getattr(mj, f"dof_{attribute}")
        for dof in np.flatnonzero(~_possible(values, 0.0)):
            yield _said(
                mj, OBJ.mjOBJ_JOINT, "joint", mj.dof_jntid[dof], attribute, values[dof], 0.0
            )


def _wrong(
    mj: mujoco.MjModel,
    kind: mujoco.mjtObj,
    called: str,
    attribute: str,
    values: np.ndarray,
    least: float,
) -> Iterator[str]:
    if values.size == 0:
        return
    rows = values.reshape(len(values), -1)
    for element in np.flatnonzero(~_possible(rows, least).all(axis=1)):
        bad = rows[element][~_possible(rows[element], least)][0]
        yield _said(mj, kind, called, int(element), attribute, bad, least)


def _possible(values: np.ndarray, least: float) -> np.ndarray:
    return np.isfinite(values) & (values >= least)


def _said(
    mj: mujoco.MjModel,
    kind: mujoco.mjtObj,
    called: str,
    element: int,
    attribute: str,
    value: float,
    least: float,
) -> str:
    name = mujoco.mj_id2name(mj, kind, element) or str(element)
    wanted = "a number of 0 or more" if least == 0.0 else "a finite number"
    return f"{called} '{name}' has {attribute} {value:g}. Give {wanted}."
