"""Rigs of a walking person as tools write them: names, orders, axes, units and poses of zeros."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.kernels.arrays import Array
from flowborne.motion.human.gait import gait_clip
from flowborne.motion.human.skeleton import standard_skeleton

FRAMES = (0, 3, 6, 9)
"""Of the generated walk, 120 a second."""

UP = {"y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0), "-y": (0.0, -1.0, 0.0), "-z": (0.0, 0.0, -1.0)}


@dataclass(frozen=True)
class Way:
    """How a tool writes.

    up         axis of the file that points up
    unit       m per length
    turned     whether the zeros of the joints are anything but a person
    whole      whether every joint has channels of position, with its whole place in them
    reference  whether the hips move in a root of their own, on the floor
    seed       of what else there is to choose: orders of angles, where the person looks, and by how
               much joints turn that a human does not have
    """

    up: str
    unit: float
    turned: bool
    whole: bool
    reference: bool
    seed: int


def rig(trunk: str, neck: str, leg: str, arm: str, sides: Sequence[str], way: Way) -> str:
    """BVH text of a walk. Each chain hangs on the last of the trunk, legs on its first; "*" stands
    for the side, and a joint is where the human's of the same part is, or between two of them."""
    rng = np.random.default_rng(way.seed)
    skeleton, clip = standard_skeleton(), gait_clip(standard_skeleton())
    _, rotations = clip.poses(np.array(FRAMES))
    own = {
        joint: Rotation.from_quat(rotations[:, n], scalar_first=True)
        for n, joint in enumerate(clip.names)
    }
    names, parents, places, turns = [], [], [], []

    def add(chain: list[str], above: int, first: str, last: str, on: str) -> None:
        """A chain of joints, evenly from one of the human's to another."""
        for n, name in enumerate(chain):
            share = n / max(len(chain) - 1, 1)
            names.append(name)
            parents.append(above if n == 0 else len(names) - 2)
            places.append((1.0 - share) * skeleton[first] + share * skeleton[last])
            shaken = Rotation.from_rotvec(rng.normal(0.0, 0.08, (len(FRAMES), 3)))
            turns.append((own[on] if n else own[first]) * shaken)

    spine, throat = trunk.split(), neck.split()
    add(spine[:1], -1, "root", "root", "root")
    add(spine[1:], 0, "lower_back", "thorax" if len(spine) > 2 else "lower_back", "thorax")
    chest = len(names) - 1
    add(throat, chest, "lower_neck", "head", "head")
    for side, word in zip(("left", "right"), sides, strict=True):
        limb = leg.replace("*", word).split()
        _limb(limb, 0, side, ("hip", "knee", "ankle", "toes"), add)
        limb = arm.replace("*", word).split()
        _limb(limb, chest, side, ("clavicle", "shoulder", "elbow", "wrist"), add)
    return _text(names, parents, np.array(places), turns, clip.translation[list(FRAMES)], way, rng)


def _limb(chain: list[str], above: int, side: str, parts: tuple[str, ...], add) -> None:
    """Joints of a limb; "|" before a name is one between the human's own."""
    at = -1
    first = True
    for name in chain:
        between = name.startswith("|")
        at += not between
        part, after = (f"{side}_{parts[k]}" for k in (max(at, 0), min(at + 1, len(parts) - 1)))
        place = (part, after) if between else (part, part)
        add([name.lstrip("|")], above if first else -2, *place, part)
        first = False


def _text(
    names: list[str],
    parents: list[int],
    places: Array,
    turns: list[Rotation],
    root: Array,
    way: Way,
    rng: np.random.Generator,
) -> str:
    for n, parent in enumerate(parents):
        parents[n] = n - 1 if parent == -2 else parent
    axes = _axes(way.up, rng)
    zeros = [Rotation.random(rng=rng) if way.turned else Rotation.identity() for _ in names]
    world = [axes * turn * zero for turn, zero in zip(turns, zeros, strict=True)]
    offsets = [np.zeros(3)] + [
        zeros[parent].inv().apply(places[n] - places[parent]) / way.unit
        if way.turned
        else axes.apply(places[n] - places[parent]) / way.unit
        for n, parent in enumerate(parents)
        if parent >= 0
    ]
    if not way.turned:  # the file's own axes are those of its zeros
        world = [turn * axes.inv() for turn in world]
    start = axes.apply(root) / way.unit
    if way.reference:
        ground = Rotation.from_euler("z", np.linspace(0.0, 20.0, len(root))[:, None], degrees=True)
        ground = axes * ground * axes.inv()
        names, parents = ["Reference", *names], [-1, *(parent + 1 for parent in parents)]
        floor = start - axes.apply(np.array([0.0, 0.0, 1.0])) * (root[:, 2:] / way.unit)
        start = ground.inv().apply(start - floor)
        world, offsets = [ground, *world], [np.zeros(3), *offsets]
    orders = ["".join(rng.permutation(list("XYZ"))) for _ in names]
    moving = {0: floor, 1: start} if way.reference else {0: start}
    lines = ["HIERARCHY"]
    listed: list[int] = []
    _block(lines, listed, 0, names, parents, offsets, orders, None if way.whole else {*moving})
    columns = []
    for n in listed:
        parent = parents[n]
        local = world[n] if parent < 0 else world[parent].inv() * world[n]
        if n in moving or way.whole:
            columns.append(moving.get(n, np.tile(offsets[n], (len(root), 1))))
        columns.append(local.as_euler(orders[n], degrees=True))
    lines += ["MOTION", f"Frames: {len(root)}", "Frame Time: 0.025"]
    lines += [" ".join(f"{x:.6f}" for x in row) for row in np.concatenate(columns, axis=1)]
    return "\n".join(lines) + "\n"


def _block(lines, listed, joint, names, parents, offsets, orders, moving) -> None:
    """Add the lines of a joint and those below, and the joints as they are listed."""
    listed.append(joint)
    lines.append(("JOINT " if lines[1:] else "ROOT ") + names[joint])
    lines += ["{", "OFFSET " + " ".join(f"{x:.6f}" for x in offsets[joint])]
    turns = [f"{axis}rotation" for axis in orders[joint]]
    if moving is None or joint in moving:
        turns = ["Xposition", "Yposition", "Zposition", *turns]
    lines.append(f"CHANNELS {len(turns)} {' '.join(turns)}")
    below = [n for n, parent in enumerate(parents) if parent == joint]
    for n in below:
        _block(lines, listed, n, names, parents, offsets, orders, moving)
    if not below:
        lines += ["End Site", "{", "OFFSET 0 0 0", "}"]
    lines.append("}")


def _axes(up: str, rng: np.random.Generator) -> Rotation:
    """From the world's axes to the file's: z becomes `up`, and the person looks anywhere."""
    across = Rotation.align_vectors([UP[up]], [[0.0, 0.0, 1.0]])[0]
    return across * Rotation.from_euler("z", rng.uniform(0.0, 360.0), degrees=True)
