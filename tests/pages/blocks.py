"""The fenced blocks of a page, and the commands in them."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

FENCE = re.compile(
    r"(?:^`(?P<file>[\w.-]+)`:\n\n)?^```(?P<language>[^\n]*)\n(?P<text>.*?)^```$", re.M | re.S
)
"""A block; a line above it may name the file that it is: `reed.toml`:"""

SHELL = ("bash", "console", "sh", "")


@dataclass(frozen=True)
class Block:
    """A fenced block.

    file      name of the file that it is, else ""
    language  as the fence has it
    """

    file: str
    language: str
    text: str

    def commands(self) -> list[list[str]]:
        """The words of every line of a shell's block."""
        if self.language not in SHELL:
            return []
        lines = self.text.replace("\\\n", " ").splitlines()
        found = [shlex.split(line, comments=True) for line in lines]
        return [words for words in found if words]


def blocks_of(page: Path) -> list[Block]:
    """All fenced blocks of a page, in order."""
    text = page.read_text(encoding="utf-8")
    return [
        Block(found["file"] or "", found["language"], found["text"])
        for found in FENCE.finditer(text)
    ]
