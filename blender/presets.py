# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones by what their names say they are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

PRESETS = {
    "HAIR": ("hair", "bang", "braid", "fringe", "pony", "ponytail", "pigtail", "plait", "strand"),
    "TAIL": ("tail",),
    "WING": ("wing", "feather", "pinion", "alula"),
    "ARMS": ("arm", "upperarm", "forearm", "lowerarm", "elbow", "hand", "wrist"),
    "SPINE": ("spine", "spinal", "torso", "chest", "abdomen", "waist", "vertebra"),
    "SOFT": ("belly", "bosom", "breast", "buttock", "cheek", "ear", "jiggle", "jowl", "udder"),
}
"""Preset -> words in the names of its bones."""

WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
"""A word of a name such as `hair_back.L`, `LeftForeArm` or `DEF-tail03`."""


def words_of(name: str) -> list[str]:
    """The words of a bone's name, in lower case."""
    return [word.lower() for word in WORD.findall(name)]


def preset(names: Iterable[str], which: str) -> list[str]:
    """The names of bones that belong to one of PRESETS."""
    wanted = {*PRESETS[which], *(f"{word}s" for word in PRESETS[which])}
    return [name for name in names if wanted & {*words_of(name)}]


def named_in(text: str, names: Iterable[str]) -> Iterator[str]:
    """Those names that a message mentions as whole words."""
    for name in names:
        if re.search(rf"(?<![\w.-]){re.escape(name)}(?![\w-]|\.\w)", text):
            yield name
