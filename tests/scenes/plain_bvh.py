"""BVH in the plainest way: where a file's own numbers put its joints, in its own unit and axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from flowborne.kernels.arrays import Array


@dataclass
class Plain:
    """A file's motion.

    places     joint -> (frames, 3)
    rotations  joint -> (frames, 3, 3), of the joint in the file's axes
    """

    frame_time: float
    places: dict[str, Array]
    rotations: dict[str, Array]


def plain(text: str) -> Plain:
    """Forward kinematics of a BVH text, whose channels of position stand for OFFSET."""
    head, motion = text.split("MOTION")
    lines = motion.strip().splitlines()
    values = np.array([line.split() for line in lines[2:]], float)
    places: dict[str, Array] = {}
    rotations: dict[str, Array] = {}
    lineage: list[str] = []
    offset, name, column = np.zeros(3), "", 0
    for words in (line.split() for line in head.splitlines()):
        if words[:1] in (["ROOT"], ["JOINT"]):
            name = " ".join(words[1:])
        elif words[:1] == ["End"]:
            name = ""
        elif words[:1] == ["{"]:
            lineage.append(name)
        elif words[:1] == ["}"]:
            lineage.pop()
        elif words[:1] == ["OFFSET"]:
            offset = np.array(words[1:], float)
        elif words[:1] == ["CHANNELS"]:
            place = np.tile(offset, (len(values), 1))
            turn = Rotation.identity(len(values))
            for channel in words[2:]:
                axis, numbers = channel[0].lower(), values[:, column]
                column += 1
                if channel.endswith("position"):
                    place[:, "xyz".index(axis)] = numbers
                else:
                    turn = turn * Rotation.from_euler(axis, numbers[:, None], degrees=True)
            if len(lineage) > 1:
                above = lineage[-2]
                place = places[above] + np.einsum("fij,fj->fi", rotations[above], place)
                turn = Rotation.from_matrix(rotations[above]) * turn
            places[name], rotations[name] = place, turn.as_matrix()
    return Plain(float(lines[1].split()[-1]), places, rotations)
