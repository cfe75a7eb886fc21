"""Table of a scene that says which run went before it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from flowborne.tables import FileName, Table, Text


class EarlierTable(Table):
    """[earlier]: the run of the pass before this one, whose joints do again what they did there.

    run     its folder, found from the folder of the scene file; in the folder of a run the file of
            what was taken from it
    joints  those that do; unless given all that were controlled there, or taken from a run before
            that, and that are neither controlled nor moved by a [[motion]] here
    """

    run: FileName
    joints: Annotated[tuple[Text, ...], Field(min_length=1)] | None = None
