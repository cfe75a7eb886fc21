"""Changes at random: values of nested tables, words and bytes of files, numbers of every size."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from typing import Any

SECRET = b"xyzzy-plugh-2718"
"""Stands in files that are not what they should be; no message may repeat it."""

OUTSIDE = "@outside@"
"""Stands for a folder beside that of the input, in which nothing may change."""

LONG = "a" * 300

NASTY: tuple[Any, ...] = (
    *(0, 1, -1, 2, 3, 7, 1e-300, 1e300, -1e300, 0.5, -0.5, 100.0, 10**6, -(10**9), 10**18),
    *(float("nan"), float("inf"), float("-inf"), True, False, "", "x", "hinge", "nan"),
    *("summary.json", "history.csv", "../../../etc/passwd", LONG, "é\u202e", "a,b", "a\nb"),
    *("\x7f", "none", [], [0.0], [1.0, 2.0], [1.0, 2.0, 3.0], [[1.0]], ["x"], {}, {"x": 1}),
    *({"kind": "x"}, [{}]),
)
"""Values in place of others."""

TEXTS = (
    *("nan", "inf", "-1", "0", "1e300", "", "x", "1 2", "1 2 3", "1 2 3 4", "nan nan nan"),
    *("true", "-1 -1 -1", "1e-300", "999999999", "a,b", "../../../etc/passwd", "0 0 0", "\u202e"),
)
"""Texts of attributes in place of others."""

WORDS = (*TEXTS, "-5", "3.7", "1e9", "}", "{", "Xrotation", "\0", LONG)


def places(raw: Any) -> Iterator[tuple[Any, Any]]:
    """Every place in nested tables and lists: what holds it, and its key."""
    for key in list(raw) if isinstance(raw, dict) else range(len(raw)):
        yield raw, key
        if isinstance(raw[key], dict | list):
            yield from places(raw[key])


def is_number(value: object) -> bool:
    """Whether a value is a number; true and false are none."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def change(rng: random.Random, raw: Any) -> None:
    """Change one place in nested tables."""
    table, key = rng.choice(list(places(raw)) or [({0: 0}, 0)])
    kind = rng.randrange(6)
    if kind == 0:
        del table[key]
    elif kind == 1 and isinstance(table, dict):
        table[rng.choice(("x", "kind", "file", "joint", "parameters"))] = rng.choice(NASTY)
    elif kind == 1:
        table.append(table[key])
    elif kind == 2 and is_number(table[key]):
        table[key] *= rng.choice((-1, 0, 1e3, 1e-3, 1e9, 1e-9))
    else:
        table[key] = rng.choice(NASTY)


def resized(rng: random.Random, value: float = 1.0) -> float:
    """A number of another size; one that is whole stays whole."""
    if isinstance(value, int):
        return rng.choice((1, 1, -1)) * int(10.0 ** rng.uniform(0.0, rng.choice((4.0, 25.0))))
    if rng.random() < 0.6:
        return value * 10.0 ** rng.uniform(-15.0, 15.0)
    return rng.choice((1.0, 1.0, -1.0)) * 10.0 ** rng.uniform(-323.0, 308.0)


def resize(rng: random.Random, raw: Any) -> None:
    """Let one number in nested tables be of another size."""
    found = [(table, key) for table, key in places(raw) if is_number(table[key])]
    if found:
        table, key = rng.choice(found)
        table[key] = resized(rng, table[key])


def words(rng: random.Random, text: bytes) -> bytes:
    """Some words or numbers of a text are others."""
    found = re.split(rb"(\s+|[,<>()\[\]\"=])", text)
    for _ in range(rng.choice((1, 1, 2, 5))):
        place = rng.randrange(len(found))
        found[place] = rng.choice((*WORDS, f"{resized(rng):g}")).encode()
    return b"".join(found)


def numbers(rng: random.Random, text: bytes) -> bytes:
    """A number in a text is of another size."""
    found = list(re.finditer(rb"-?\d+(\.\d*)?(e-?\d+)?", text))
    if not found:
        return text
    one = rng.choice(found)
    new = resized(rng, float(one[0]) if b"." in one[0] else int(float(one[0])))
    return text[: one.start()] + str(new).encode() + text[one.end() :]


def torn(rng: random.Random, content: bytes) -> bytes:
    """The content with bytes lost, changed, doubled or zeroed."""
    if not content:
        return content
    start = rng.randrange(len(content))
    stop = min(len(content), start + rng.choice((1, 2, 8, 64, 10**9)))
    kind = rng.randrange(6)
    if kind == 0:
        return content[:start]
    if kind == 1:
        return content[:start] + content[stop:]
    if kind == 2:
        return content[:stop] + content[start:]
    if kind == 3:
        return content[:start] + b"\0" * (stop - start) + content[stop:]
    if kind == 4:
        return content[:start] + rng.randbytes(min(stop - start, 64)) + content[stop:]
    lines = content.splitlines(keepends=True)
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[one], lines[other] = lines[other], lines[one]
    return b"".join(lines)
