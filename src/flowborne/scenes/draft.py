"""A scene that the schema accepts and whose tables are to be held against each other."""

from __future__ import annotations

from dataclasses import dataclass

from flowborne.scenes.schema import Scene
from flowborne.scenes.wording import Key, place


@dataclass(frozen=True)
class Draft:
    """A scene under inspection.

    scene    what could be understood of it
    file     name of its file
    broken   names of the top tables of which something was left out because it was wrong
    numbers  table -> number that each of its entries has in the file
    """

    scene: Scene
    file: str
    broken: frozenset[str]
    numbers: dict[str, list[int]]

    def at(self, *keys: Key) -> str:
        """Where something is, for a message."""
        return place(self.file, keys, self.numbers)

    def sound(self, *tables: str) -> bool:
        """Whether nothing was left out of these tables."""
        return not self.broken & set(tables)

    def gives(self, table: str) -> bool:
        """Whether the file says anything in this table, right or wrong."""
        default = Scene.model_fields[table].get_default(call_default_factory=True)
        return table in self.broken or getattr(self.scene, table) != default
