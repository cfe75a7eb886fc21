"""A scene that the schema accepts and whose tables are to be held against each other."""

from __future__ import annotations

from dataclasses import dataclass

from flowborne.control.surroundings import unknown_bodies, unknown_joints
from flowborne.scenes.schema import Scene
from flowborne.scenes.wording import Key, place
from flowborne.solids.model import SolidModel


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

    @property
    def source(self) -> str:
        """Where the model is from, for messages."""
        path = self.scene.model_path
        return "the human" if path is None else f"model {path.name}"

    def unknown_joint(self, model: SolidModel, joint: str, *keys: Key) -> list[str]:
        """The problem when `joint` is not in the model."""
        return [f"{self.at(*keys)}: {said}" for said in unknown_joints(model, self.source, [joint])]

    def unknown_body(self, model: SolidModel, body: str, *keys: Key) -> list[str]:
        """The problem when `body` is not in the model."""
        return [f"{self.at(*keys)}: {said}" for said in unknown_bodies(model, self.source, [body])]
