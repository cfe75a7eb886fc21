"""The text of a model with other attributes; all else, line numbers too, stays as it is."""

from __future__ import annotations

import re
from collections.abc import Mapping
from xml.parsers import expat
from xml.sax.saxutils import escape

ATTRIBUTE = re.compile(rb"\s+([^\s=/>]+)\s*=\s*(\"[^\"]*\"|'[^']*')")

Changes = Mapping[int, Mapping[str, str | None]]
"""Number of an element in the order of the text -> attribute -> new value, None to drop it."""


def with_attributes(text: bytes, changes: Changes) -> bytes:
    """XML with other values of attributes that it has."""
    starts: list[int] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda *_: starts.append(parser.CurrentByteIndex)
    parser.Parse(text, True)
    pieces, done = [], 0
    for number in sorted(changes):
        name = re.compile(rb"<[^\s/>]+").match(text, starts[number])
        place = name.end() if name else len(text)
        while found := ATTRIBUTE.match(text, place):
            place = found.end()
            key = found[1].decode("utf-8", "replace")
            if key in changes[number]:
                value = changes[number][key]
                pieces += [text[done : found.start(1 if value is None else 2)], _quoted(value)]
                done = place
    return b"".join([*pieces, text[done:]])


def _quoted(value: str | None) -> bytes:
    """A value as it stands behind an equals sign; nothing for None."""
    if value is None:
        return b""
    return b'"%s"' % escape(value, {'"': "&quot;"}).encode("ascii", "xmlcharrefreplace")
