"""Keyframes that a scene takes from a CSV file.

The first row names the columns; one is `time` (s), the others are joint positions in degrees or m,
or controls of actuators. A table takes the column with its joint's or actuator's name, or the one
that `column` names. A scene that is
written contains the numbers, and not the CSV file.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from contextlib import suppress
from io import StringIO
from pathlib import Path
from typing import Any

from flowborne.base.errors import SceneError
from flowborne.base.given import possible_name, read_file
from flowborne.base.phrases import suggestion
from flowborne.scenes.draft import place


def inline_keyframes(raw: dict[str, Any], folder: Path, file: str) -> list[str]:
    """Replace `file` and `column` of each [[motion]] and [[actuator]] of `raw` by times and values.

    A table with an unreadable file gets a valid table, so that the rest can be checked.
    returns  the problems
    """
    problems = []
    for key, index, motion in _keyframed(raw):
        where = place(file, (key, index))
        own = motion.get("joint" if key == "motion" else "name")
        path, column = motion.pop("file"), motion.pop("column", own)
        try:
            if {"times", "values"} & motion.keys():
                raise SceneError(f"{where} has both a file and a table. Keep one of them.")
            if not (isinstance(path, str) and isinstance(column, str)):
                raise SceneError(f"{where}: file and column are names. Put them in quotes.")
            try:
                possible_name(path)
            except ValueError as error:
                raise SceneError(f"{where}, file {error}.") from None
            motion["times"], motion["values"] = read_columns(folder / path, column, where)
        except SceneError as error:
            problems += error.problems
            motion["times"], motion["values"] = [0.0, 1.0], [0.0, 0.0]
    return problems


def _keyframed(raw: dict[str, Any]) -> Iterator[tuple[str, int, dict[str, Any]]]:
    """Tables with keyframes in a file: their key, number and content."""
    for key in ("motion", "actuator"):
        tables = raw.get(key)
        for index, table in enumerate(tables if isinstance(tables, list) else []):
            if not isinstance(table, dict) or "file" not in table:
                continue
            if key == "actuator" or table.get("kind") == "keyframes":
                yield key, index, table


def read_columns(path: Path, column: str, where: str) -> tuple[list[float], list[float]]:
    """Columns `time` and `column` of a CSV file. Raises SceneError with the file's line."""
    try:
        text = StringIO(read_file(path).decode("utf-8-sig"), newline="")
        rows = [[cell.strip() for cell in row] for row in csv.reader(text)]
    except FileNotFoundError:
        raise SceneError(f"{where}: there is no file {path}. Correct the name.") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise SceneError(f"{where}: {path} cannot be read ({error}). Give a CSV file.") from None
    header = rows[0] if rows else []
    places = []
    if "time" not in header:  # of a file that is something else nothing is repeated
        raise SceneError(f"{where}: {path.name} has no column 'time'. Name it in the first row.")
    for name in ("time", column):
        if name not in header:
            end = suggestion(name, [h for h in header if h != "time"], "Its first row has")
            raise SceneError(f"{where}: {path.name} has no column '{name}'{end}")
        places.append(header.index(name))
    times: list[float] = []
    values: list[float] = []
    for line, row in enumerate(rows[1:], start=2):
        if not any(row):
            continue
        for target, index in zip((times, values), places, strict=True):
            cell = row[index] if index < len(row) else ""
            with suppress(ValueError):
                target.append(float(cell))
                if math.isfinite(target[-1]):
                    continue
            raise SceneError(
                f"{where}: {path.name}, line {line}, column '{header[index]}': "
                f"'{cell}' is not a finite number. Give one."
            )
    return times, values
