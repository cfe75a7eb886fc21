"""What the columns of a history are: quantity, unit, and whose they are."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

UNITS = {
    "s": "s",
    "m": "m",
    "rad": "rad",
    "m/s": "m/s",
    "rad/s": "rad/s",
    "1/s": "1/s",
    "N": "N",
    "Nm": "N m",
    "Ns": "N s",
    "J": "J",
    "W": "W",
    "m3": "m^3",
}
"""What may end the name of a column after its last underscore, and the unit that it stands for."""

OF_JOINTS = {
    "angle": "angle of a hinge",
    "position": "position of a slide",
    "target_rad": "angle where the drive of a hinge is going",
    "target_m": "position where the drive of a slide is going",
    "torque": "torque of a joint's drive, mean over the frame",
    "force": "force of a joint's drive, mean over the frame",
    "power": "power of a joint's drive, mean over the frame",
}
"""Quantity of a joint, with its unit where it has several -> what it is."""

TARGETS = {"target_rad": "target_angle", "target_m": "target_position"}

POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
"""Columns of a body's pose, which the states have as well."""


class HistoryArray(NamedTuple):
    """A quantity of the history, of all its owners.

    dimensions  of one frame: (), ("joint",), ("body", "axis"), ("joint", "axis") or ("axis",)
    values      (frames, ...), nan where an owner has no such column
    unit        "1" where it has none, "" where an objective decides
    meaning     in a few words, "" where the name says it
    """

    dimensions: tuple[str, ...]
    values: Array
    unit: str
    meaning: str


class _Column(NamedTuple):
    """Where a column belongs: name of the array, its owner and its axis (0, 1, 2), if any."""

    name: str
    joint: str | None = None
    body: str | None = None
    axis: int | None = None
    meaning: str = ""


def unit_of(column: str) -> str:
    """Unit of a column of the history; "1" where it has none, "" where an objective decides."""
    if column.startswith(("objective", "measured_")):
        return ""
    if column == "effort":
        return "N m s"
    if column.startswith("seconds_"):
        return "s"
    return UNITS.get(column.rpartition("_")[2], "1")


def history_arrays(
    history: Mapping[str, Array], bodies: tuple[str, ...], joints: tuple[str, ...]
) -> dict[str, HistoryArray]:
    """Name -> quantity of a history, without its frame, its time and the poses of bodies.

    Of joints they are called `torque`, `power` and so on; where a joint has three components, as
    `torque_xyz`. Of bodies as `body_force`, of the whole as their column without its unit.

    history  column -> (frames,) numbers
    bodies   names in the order of the dimension `body`
    joints   names in the order of the dimension `joint`
    """
    found: dict[str, HistoryArray] = {}
    lengths = {"body": len(bodies), "joint": len(joints), "axis": 3}
    for column, values in history.items():
        at = _place(column, bodies, joints)
        if at is None:
            continue
        given = {"joint": at.joint, "body": at.body, "axis": at.axis}
        dimensions = tuple(key for key, owner in given.items() if owner is not None)
        if at.name not in found:
            empty = np.full((len(values), *(lengths[key] for key in dimensions)), np.nan)
            found[at.name] = HistoryArray(dimensions, empty, unit_of(column), at.meaning)
        place = [] if at.joint is None else [joints.index(at.joint)]
        place += [] if at.body is None else [bodies.index(at.body)]
        place += [] if at.axis is None else [at.axis]
        np.moveaxis(found[at.name].values, 0, -1)[tuple(place)] = values
    return found


def _place(column: str, bodies: Collection[str], joints: Collection[str]) -> _Column | None:
    """Where a column belongs; None for those that are left out."""
    stem, _, unit = column.rpartition("_")
    stem = stem if unit in UNITS else column
    if column in ("frame", "time_s"):
        return None
    quantity, _, name = stem.partition("_")
    quantity = f"target_{unit}" if quantity == "target" else quantity
    whole, _, letter = stem.rpartition("_")
    axis = "xyz".index(letter) if letter in tuple("xyz") else None
    if quantity in OF_JOINTS:
        called, meaning = TARGETS.get(quantity, quantity), OF_JOINTS[quantity]
        if name in joints:
            return _Column(called, joint=name, meaning=meaning)
        name = name.rpartition("_")[0]
        if axis is not None and name in joints:
            return _Column(f"{called}_xyz", joint=name, axis=axis, meaning=meaning)
    owners = [body for body in bodies if stem.startswith(f"{body}_") and quantity != "momentum"]
    if owners:
        body = max(owners, key=len)
        rest = stem.removeprefix(f"{body}_")
        if rest in POSE:
            return None
        if axis is not None:
            of_body = rest.rpartition("_")[0]
            of_body = "angular_velocity" if of_body == "rotation" else of_body
            return _Column(f"body_{of_body}", body=body, axis=axis)
    if axis is not None:
        return _Column(whole, axis=axis)
    return _Column(stem)
