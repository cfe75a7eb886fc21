"""history.csv: a row of numbers per frame, in the file and not in memory."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import IO

from flowborne.files.atomic import write_text
from flowborne.files.given import MOST_BYTES, check_file


class History:
    """The history of a run, open for appending.

    Numbers are written with as many digits as it takes to read the same number back. A row is
    there whole, or is dropped when the history is next opened.

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
        """New history with a header and no rows, in place of what was there."""
        write_text(path, _header(columns))
        return cls(path, columns, 0)

    @classmethod
    def reopen(cls, path: Path, columns: Sequence[str], rows: int) -> History:
        """History cut to its first `rows` rows.

        raises  ValueError when its columns are others, when it has fewer rows, or one that is no
                row of finite numbers (nan in a column of nan alone) or not that of its frame
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

        raises  KeyError when a column is missing; OSError when the row cannot be written (no row
                is then added)
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
        """Take back the last row; `length` is what `length` was before it was written."""
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

    raises  ValueError when there is no such column, or a number is missing or none
    """
    check_file(path, None)
    with open(path, encoding="utf-8", newline="") as file:
        lines = _lines(file)
        names = _names(lines)
        places = [names.index(column) for column in columns]
        for line in lines:
            if line.endswith("\n"):
                cells = line.rstrip("\n").split(",")
                if len(cells) != len(names):
                    raise ValueError(f"{path.name} has {len(cells)} numbers in a row")
                yield tuple(float(cells[place]) for place in places)


def _lines(file: IO[str]) -> Iterator[str]:
    """The lines of a file, none longer than what is read of a file."""
    return iter(lambda: file.readline(MOST_BYTES), "")


def _names(lines: Iterator[str]) -> tuple[str, ...]:
    """What the first row names; it may go over several lines."""
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
    """The first row: a name that holds a comma, a quote or a line break is quoted."""
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerow(columns)
    return text.getvalue()


def _text(value: float) -> str:
    """Shortest text that reads back as the same number."""
    return str(value) if isinstance(value, int) else repr(float(value))
