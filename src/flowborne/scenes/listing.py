"""The built-in scenes in the groups of the gallery, with what each asks for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import prod

from flowborne.scenes.load import find, read_scene, scene_names
from flowborne.scenes.schema import Scene

MAX_GAS_DENSITY = 10.0
"""kg/m^3"""

FIRST = ("ns-block-drag-max", "human-wind-back", "eel")
"""Scenes to begin with: each takes a minute and a half at most on two cores, with its film."""


def has_inflow(scene: Scene) -> bool:
    """Whether a stream enters the domain."""
    return any(side.kind == "inflow" for _, side in scene.boundaries or ())


def has_gas(scene: Scene) -> bool:
    """Whether the fluid is a gas."""
    return scene.fluid is not None and scene.fluid.density <= MAX_GAS_DENSITY


def follows(scene: Scene) -> bool:
    """Whether the domain moves with bodies."""
    return scene.domain is not None and scene.domain.follows


OPEN, WALKERS = "Open water and open air", "Walkers"
IN_WIND, IN_STREAM = "Blocks in a prescribed wind", "Blocks in a stream"
FLYERS, FLESHY = "Flyers", "Swimmers of flesh and bone"
VEHICLES, ROBOTS = "Vehicles", "Swimming robots"

GROUPS: dict[str, Callable[[Scene], bool]] = {
    OPEN: follows,
    WALKERS: lambda scene: scene.human is not None,
    IN_WIND: lambda scene: scene.domain is None,
    IN_STREAM: has_inflow,
    FLYERS: has_gas,
    FLESHY: lambda scene: bool(scene.flesh),
    VEHICLES: lambda scene: bool(scene.thruster),
    ROBOTS: lambda scene: True,
}
"""Heading -> whether a scene is of this group, unless it is of an earlier one."""


def group_of(scene: Scene) -> str:
    """Heading of the first group that holds a scene."""
    return next(title for title, holds in GROUPS.items() if holds(scene))


@dataclass(frozen=True)
class ListedScene:
    """A built-in scene.

    name         for `run`, `check` and `play`
    group        heading in the gallery
    dimensions   2 or 3
    cells        of its grid; 0 without a fluid
    seconds      of simulated time
    figure       of the paper, or the case
    description  what its film shows
    """

    name: str
    group: str
    dimensions: int
    cells: int
    seconds: float
    figure: str
    description: str

    @classmethod
    def of(cls, scene: Scene) -> ListedScene:
        """The entry of a scene."""
        cells = prod(scene.domain.counts()) if scene.domain and scene.has_fluid else 0
        seconds = scene.time.frames * scene.frame_time
        told = scene.dimensions, cells, seconds, scene.figure, scene.description
        return cls(scene.name, group_of(scene), *told)


class SceneList(tuple[ListedScene, ...]):
    """The built-in scenes, which prints as their list."""

    def __str__(self) -> str:
        wide = max(len(one.name) for one in self)
        lines = [f"To begin with, a minute or two each: {', '.join(FIRST)}", ""]
        lines += [f"  {'':<{wide}}          cells  seconds"]
        for title in GROUPS:
            lines += [title]
            lines += [
                f"  {one.name:<{wide}}  {one.dimensions}D  {one.cells or 'none':>9}  "
                f"{one.seconds:>7.3g}  {one.description} ({one.figure})"
                for one in self
                if one.group == title
            ]
        return "\n".join(lines)

    __repr__ = __str__


def scenes() -> SceneList:
    """The built-in scenes, in the order of the paper's figures; printed in the gallery's groups."""
    return SceneList(ListedScene.of(read_scene(find(name))) for name in scene_names())
