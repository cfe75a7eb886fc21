"""history.csv: a row of numbers per frame, kept in the file, and the meaning of its columns."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np

from flowborne.base.atomic import write_text
from flowborne.base.given import MOST_BYTES, check_file
from flowborne.base.phrases import suggestion
from flowborne.kernels.arrays import Array
from flowborne.runs.states import Quantity

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
    "m/s2": "m/s^2",
    "rad/s2": "rad/s^2",
}
"""Suffix of a column name after its last underscore -> unit."""


class Measured(NamedTuple):
    """A quantity of bodies or joints in the history.

    word     in the names of its columns
    unit     suffix of these names
    meaning  in a few words, "" when the name says it
    """

    word: str
    unit: str
    meaning: str = ""


OF_JOINTS = {
    "angle": Measured("angle", "rad", "angle of a hinge"),
    "position": Measured("position", "m", "position of a slide"),
    "target_angle": Measured("target", "rad", "angle where the drive of a hinge is going"),
    "target_position": Measured("target", "m", "position where the drive of a slide is going"),
    "torque": Measured("torque", "Nm", "torque of a joint's drive, mean over the frame"),
    "force": Measured("force", "N", "force of a joint's drive, mean over the frame"),
    "power": Measured("power", "W", "power of a joint's drive, mean over the frame"),
}
"""Quantities of a joint."""

OF_BODIES = {
    "centre": Measured("centre", "m"),
    "velocity": Measured("velocity", "m/s"),
    "angular_velocity": Measured("rotation", "rad/s"),
    "force": Measured("force", "N"),
    "torque": Measured("torque", "Nm"),
    "added_mass_force": Measured("added_mass_force", "N"),
    "added_mass_torque": Measured("added_mass_torque", "Nm"),
}
"""Quantities (3,) of a body by their names in `BodyState`."""

POSE = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
"""Columns of the pose of a body, which is also in the states, after its name."""


def joint_column(quantity: str, joint: str, axis: str = "") -> str:
    """Name of the column of one of OF_JOINTS, with an axis where a joint has several."""
    word, unit, _ = OF_JOINTS[quantity]
    return "_".join([word, joint, *axis, unit])


def body_columns(body: str) -> list[str]:
    """Names of the columns of all of OF_BODIES."""
    return [f"{body}_{word}_{a}_{unit}" for word, unit, _ in OF_BODIES.values() for a in "xyz"]


class History:
    """The history of a run, open for appending.

    Numbers are written with enough digits to read the same number back. An incomplete row is
    dropped when the history is opened again.

    columns  names, in the order of the file
    rows     number of rows written
    """

    def __init__(self, path: Path, columns: Sequence[str], rows: int) -> None:
        self.path = path
        self.columns = tuple(columns)
        self.rows = rows
        self._file = open(path, "ab", buffering=0)  # noqa: SIM115 (open as long as the run)
        self._length = os.fstat(self._file.fileno()).st_size

    @classmethod
    def create(cls, path: Path, columns: Sequence[str]) -> History:
        """New history with a header and no rows; it replaces an existing file."""
        write_text(path, _header(columns))
        return cls(path, columns, 0)

    @classmethod
    def reopen(cls, path: Path, columns: Sequence[str], rows: int) -> History:
        """History cut to its first `rows` rows.

        raises  ValueError when its columns differ, when it has fewer rows, or when a row has a
                number that is not finite (nan is allowed in columns of nan) or a wrong frame
        """
        check_file(path, None)
        with open(path, "r+b") as file:
            header = _header(columns).encode()
            if file.read(len(header)) != header:
                raise ValueError(f"{path} has other columns than this version writes")
            absent: set[str] = set()
            for row in range(rows):
                line = file.readline(MOST_BYTES)
                if not line.endswith(b"\n"):
                    raise ValueError(f"{path} has {row} rows where the checkpoint has {rows}")
                values = _row(line, columns, row + 1, path)
                now = {name for name, value in values.items() if math.isnan(value)}
                if math.inf in map(abs, values.values()) or (row and now != absent):
                    raise ValueError(f"{path}, row {row + 1}: a number is not finite")
                absent = now
            file.truncate(file.tell())
        return cls(path, columns, rows)

    def append(self, values: Mapping[str, float]) -> None:
        """Write a row; `values` has a number for every column.

        raises  KeyError when a column is missing; OSError when the row cannot be written (then no
                row is added)
        """
        line = memoryview((",".join(_text(values[name]) for name in self.columns) + "\n").encode())
        written = 0
        try:
            while written < len(line):
                written += self._file.write(line[written:]) or 0
        except OSError:
            self._file.truncate(self._length)
            raise
        self._length += written
        self.rows += 1

    def drop_last(self, length: int) -> None:
        """Remove the last row; `length` is the value of `length` before it was written."""
        self._file.truncate(length)
        self._length = length
        self.rows -= 1

    @property
    def length(self) -> int:
        """Bytes of the file up to the end of its last row."""
        return self._length

    def sync(self) -> None:
        """Wait until every row is on the disc."""
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()


def history_columns(path: Path) -> tuple[str, ...]:
    """Names of the columns of a history. Raises ValueError when it has no header."""
    check_file(path, None)
    with open(path, encoding="utf-8", newline="") as file:
        columns = _names(_lines(file))
    if not columns:
        raise ValueError(f"{path.name} is empty")
    return columns


def history_rows(path: Path, columns: Sequence[str]) -> Iterator[tuple[float, ...]]:
    """The numbers of the named columns, row after row, without holding the whole file.

    raises  ValueError for a missing column, or a missing or bad number
    """
    check_file(path, None)
    with open(path, encoding="utf-8", newline="") as file:
        lines = _lines(file)
        names = _names(lines)
        indices = [names.index(column) for column in columns]
        for line in lines:
            if line.endswith("\n"):
                cells = line.rstrip("\n").split(",")
                if len(cells) != len(names):
                    raise ValueError(f"{path.name} has {len(cells)} numbers in a row")
                yield tuple(float(cells[index]) for index in indices)


class UnknownColumnError(KeyError):
    """There is no such column; the text says which was probably meant."""

    __str__ = Exception.__str__


class HistoryColumns(dict[str, Array]):
    """Column -> (frames,) numbers. An unknown column raises UnknownColumnError."""

    def __missing__(self, name: str) -> Array:
        raise UnknownColumnError(
            f"no column '{name}' in the history{suggestion(name, self, 'It has')}"
        )


def read_history(path: Path, columns: Sequence[str]) -> HistoryColumns:
    """Column -> (frames,) numbers of the named columns. Raises ValueError as `history_rows`."""
    rows = np.array(list(history_rows(path, columns)), float).reshape(-1, len(columns))
    return HistoryColumns(zip(columns, rows.T, strict=True))


def _lines(file: IO[str]) -> Iterator[str]:
    """The lines of a file, cut at the most bytes that are read of a file."""
    return iter(lambda: file.readline(MOST_BYTES), "")


def _names(lines: Iterator[str]) -> tuple[str, ...]:
    """The names in the first row, which may span several lines."""
    try:
        return tuple(next(csv.reader(lines), ()))
    except csv.Error as error:
        raise ValueError(f"its first row is none ({error})") from error


def _row(line: bytes, columns: Sequence[str], row: int, path: Path) -> dict[str, float]:
    """The numbers of a line by column. Raises ValueError unless it is row number `row`, from 1."""
    try:
        values = dict(zip(columns, map(float, line.split(b",")), strict=True))
    except ValueError:
        raise ValueError(f"{path}, row {row}: not a number for each column") from None
    if values.get("frame", row) != row:
        raise ValueError(f"{path}, row {row} is of frame {values['frame']:g}")
    return values


def _header(columns: Sequence[str]) -> str:
    """The first row; names with a comma, a quote or a line break are quoted."""
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerow(columns)
    return text.getvalue()


def _text(value: float) -> str:
    """Shortest text that reads back as the same number."""
    return str(value) if isinstance(value, int) else repr(float(value))


def unit_of(column: str) -> str:
    """Unit of a column of the history; "1" without one, "" when it depends on an objective."""
    if column.startswith(("objective", "measured_")):
        return ""
    if column == "effort":
        return "N m s"
    if column.startswith("seconds_"):
        return "s"
    return UNITS.get(column.rpartition("_")[2], "1")


def history_arrays(
    history: Mapping[str, Array], bodies: tuple[str, ...], joints: tuple[str, ...]
) -> dict[str, tuple[Quantity, Array]]:
    """Name -> quantity of a history and its values (frames, ...), nan for a body or joint without
    such a column; without the frame, the time and the poses of bodies.

    Quantities of joints are called `torque`, `power` and so on, or `torque_xyz` with three
    components; those of bodies `body_force` and so on. Others keep their column name without the
    unit.

    history  column -> (frames,) numbers
    bodies   names in the order of the dimension `body`
    joints   names in the order of the dimension `joint`
    """
    found: dict[str, tuple[Quantity, Array]] = {}
    entries = {"joint": joints, "body": bodies, "axis": tuple("xyz")}
    for column, values in history.items():
        place = _place(column, bodies, joints)
        if place is None:
            continue
        name, meaning, at = place
        if name not in found:
            empty = np.full((len(values), *(len(entries[key]) for key in at)), np.nan)
            found[name] = Quantity(tuple(at), unit_of(column), meaning), empty
        index = tuple(entries[key].index(entry) for key, entry in at.items())
        np.moveaxis(found[name][1], 0, -1)[index] = values
    return found


def _place(
    column: str, bodies: Collection[str], joints: Collection[str]
) -> tuple[str, str, dict[str, str]] | None:
    """Name and meaning of the array of a column, and its joint, body and axis, if any; None for
    columns that are skipped."""
    if column in ("frame", "time_s"):
        return None
    stem, _, unit = column.rpartition("_")
    stem = stem if unit in UNITS else column
    whole, _, axis = stem.rpartition("_")
    of_axis = {"axis": axis} if axis in tuple("xyz") else {}
    for quantity, measured in OF_JOINTS.items():
        if unit == measured.unit and stem.startswith(f"{measured.word}_"):
            name = stem.removeprefix(f"{measured.word}_")
            if name in joints:
                return quantity, measured.meaning, {"joint": name}
            name = name.rpartition("_")[0]
            if of_axis and name in joints:
                return f"{quantity}_xyz", measured.meaning, {"joint": name, **of_axis}
    owners = [body for body in bodies if stem.startswith(f"{body}_")]
    if owners and not column.startswith("momentum_"):
        body = max(owners, key=len)
        if column.removeprefix(f"{body}_") in POSE:
            return None
        if of_axis:
            word = whole.removeprefix(f"{body}_")
            known = {measured.word: quantity for quantity, measured in OF_BODIES.items()}
            return f"body_{known.get(word, word)}", "", {"body": body, **of_axis}
    return (whole if of_axis else stem), "", of_axis
