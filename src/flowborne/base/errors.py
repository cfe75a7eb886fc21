"""Errors that are written for the person who runs flowborne."""

from __future__ import annotations

import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path


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


class BreakdownError(ValueError):
    """A step cannot be taken from this state; the text says why, a sentence without a full stop."""


class WorkerError(ValueError):
    """Processes that work for this one died, and again after a new start."""


class PartError(ValueError):
    """A part of the user's own failed: an objective, a rule, a wind, an exporter.

    The text says which one, and what it did.
    """

    @classmethod
    @contextmanager
    def guarding(cls, part: str, *passing: type[Exception]) -> Iterator[None]:
        """Context in which all that the part raises is a PartError: SystemExit, too, with which it
        would end the run.

        passing  what is raised as it is, besides KeyboardInterrupt and another part's PartError
        """
        try:
            yield
        except (KeyboardInterrupt, PartError):
            raise
        except passing:
            raise
        except BaseException as error:
            raise cls.failed(part, error) from error

    @classmethod
    def failed(cls, part: str, error: BaseException) -> PartError:
        """The part raised `error`: says where, outside of flowborne's own files."""
        ours = str(Path(__file__).parents[1])
        calls = traceback.extract_tb(error.__traceback__)
        at = next((c for c in reversed(calls) if not c.filename.startswith(ours)), calls[-1])
        return cls(f"{part} failed in {_line(at)} ({said_by(error)}): mend it there")


def described(error: BaseException) -> str:
    """Type and text of an error, and the file and line in which it was raised."""
    return f"{said_by(error)}, in {_line(traceback.extract_tb(error.__traceback__)[-1])}"


def fault_of(error: Exception) -> str:
    """An error that nothing should end with, for a person."""
    return f"a fault of flowborne ({described(error)}); please report it with flowborne --debug"


def _line(call: traceback.FrameSummary) -> str:
    return f"{Path(call.filename).name}, line {call.lineno}"


def said_by(error: BaseException) -> str:
    """Type and text of an error of a part of the user's own, whose text may fail as well."""
    with suppress(Exception):
        return f"{type(error).__name__}: {error}"
    return type(error).__name__
