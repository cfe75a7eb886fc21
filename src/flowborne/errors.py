"""Errors that are written for the person who runs flowborne."""

from __future__ import annotations

from collections.abc import Sequence


class SceneError(Exception):
    """A scene, or what was asked of it, is wrong.

    problems  one entry per thing that is wrong: a sentence that says what, with its value and
              place, and a sentence that says what to do
    """

    def __init__(self, problems: str | Sequence[str]) -> None:
        self.problems: list[str] = [problems] if isinstance(problems, str) else list(problems)
        super().__init__("\n".join(self.problems))

    def __reduce__(self) -> tuple[type[SceneError], tuple[list[str]]]:
        return type(self), (self.problems,)
