"""What can be set in the panel, and the values of the scene's keys that follow from it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flowborne.base.phrases import and_more
from flowborne.play.groups import Group
from flowborne.scenes.schema import Scene
from flowborne.solids.model import SLIDE, SolidModel, joint_kind

Settings = Mapping[str, float | str]
"""Name of a control -> its value."""

Values = dict[str, Any]
"""Dotted key of the scene -> its value."""

EASE = 0.25
"""s in which a stream reaches a new velocity: one that jumps gives its bodies an impulse."""

FASTEST = 2.5
"""Largest speed of a wind or stream in the panel, in those of the scene."""

STRONGEST = 4.0
"""Largest strength in the panel, in those of the scene."""

HEAVIEST = 5.0
"""Largest factor of weights in the panel."""

AS_IN_SCENE = "as in the scene"
GOALS = {"least effort": "least", "least drag": "least", "most drag": "most"}
"""Name of an objective that can be chosen -> its goal."""


@dataclass(frozen=True)
class Slider:
    """A number that can be set.

    name    of the setting; what precedes its last ": " is the title of the control's folder
    low     smallest value
    high    largest value
    step    between values
    value   at the start
    """

    name: str
    low: float
    high: float
    step: float
    value: float


@dataclass(frozen=True)
class Picker:
    """A choice that can be set; `name` as that of a Slider.

    options  what can be chosen; the first one is chosen at the start
    """

    name: str
    options: tuple[str, ...]

    @property
    def value(self) -> str:
        return self.options[0]


Control = Slider | Picker


@dataclass(frozen=True)
class Flow:
    """A wind or a stream that can be set by its speed and direction.

    title   of its folder
    key     of its vector in the scene
    unit    of the vector, "m/s" or "N"
    vector  (3,) in the scene
    ease    s in which it reaches a new value without gusts
    slab    whether it stays in the plane
    """

    title: str
    key: str
    unit: str
    vector: tuple[float, float, float]
    ease: float
    slab: bool

    def controls(self) -> Iterator[Control]:
        speed, azimuth, elevation = _polar(self.vector)
        most = FASTEST * (speed or 1.0)
        step = float(10.0 ** np.floor(np.log10(most / 50.0)))
        yield Slider(f"{self.title}: speed ({self.unit})", 0.0, most, step, speed)
        yield Slider(f"{self.title}: direction (°)", -180.0, 180.0, 1.0, azimuth)
        if not self.slab:
            yield Slider(f"{self.title}: upward (°)", -90.0, 90.0, 1.0, elevation)
        yield Slider(f"{self.title}: gusts (%)", 0.0, 100.0, 5.0, 0.0)
        yield Slider(f"{self.title}: a gust every (s)", 0.5, 8.0, 0.5, 2.0)

    def mean(self, settings: Settings) -> list[float]:
        """(3,) without gusts; exactly that of the scene for the settings at the start."""
        sliders = [c for c in self.controls() if isinstance(c, Slider)][: 2 if self.slab else 3]
        given = [float(settings[slider.name]) for slider in sliders]
        if given == [slider.value for slider in sliders]:
            return list(self.vector)
        speed, azimuth, elevation = (*given, 0.0)[:3]
        a, e = np.radians(azimuth), np.radians(elevation)
        along = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        return [float(x) for x in np.round(speed * along, 9) + 0.0]

    def next(self, settings: Settings, time: float) -> tuple[list[float], float]:
        """Where it goes from `time` (s) on, and s until it is there.

        Gusts go up and down evenly: it goes to 1 + share times its mean in one half of their
        period, and to 1 - share in the other.
        """
        mean = self.mean(settings)
        share = 0.01 * float(settings[f"{self.title}: gusts (%)"])
        if share == 0.0:
            return mean, self.ease
        half = 0.5 * float(settings[f"{self.title}: a gust every (s)"])
        number = int(np.floor(time / half + 1e-6))
        factor = 1.0 + (share if number % 2 == 0 else -share)
        return [factor * x for x in mean], (number + 1) * half - time


def _polar(vector: Sequence[float]) -> tuple[float, float, float]:
    """Size of a vector (3,), and its azimuth and elevation, degrees, to nine digits."""
    x, y, z = vector
    size, flat = float(np.linalg.norm(vector)), float(np.hypot(x, y))
    azimuth, elevation = np.degrees([np.arctan2(y, x), np.arctan2(z, flat)]).round(9) + 0.0
    return size, float(azimuth), float(elevation)


class Controls:
    """The controls of a scene.

    groups  joints whose objectives can be chosen
    flows   winds and streams that can be set
    all     every control
    """

    def __init__(self, scene: Scene, groups: Sequence[Group], model: SolidModel) -> None:
        self._scene, self.groups = scene, tuple(groups)
        self.flows = tuple(_flows(scene))
        self._strengths = {
            f"strength: {and_more(table.joints)} ({_rate(model, table.joints[0])})": n
            for n, table in enumerate(scene.control)
        }
        self.all: tuple[Control, ...] = tuple(self._all())

    def settings(self) -> dict[str, float | str]:
        """Those at the start."""
        return {control.name: control.value for control in self.all}

    def values(self, settings: Settings) -> Values:
        """Values of all keys that the settings determine, except those of `flows`.

        A drag that was chosen is along the first wind or stream as it is set.
        """
        values: Values = {}
        for group in self.groups:
            values |= self._objectives(group, settings)
        for name, number in self._strengths.items():
            values[f"control.{number}.strength"] = float(settings[name])
        return values

    def _all(self) -> Iterator[Control]:
        for flow in self.flows:
            yield from flow.controls()
        for group in self.groups:
            title = _title(group)
            options = list(GOALS)[: 1 if group.drag is None else 3]
            yield Picker(f"{title}: objective", (AS_IN_SCENE, *options))
            yield Slider(f"{title}: weight", 0.0, HEAVIEST, 0.05, 1.0)
            if group.close:
                yield Slider(f"{title}: close to its motion", 0.0, HEAVIEST, 0.05, 1.0)
        for name, number in self._strengths.items():
            strength = self._scene.control[number].strength
            step = float(10.0 ** np.floor(np.log10(strength / 20.0)))
            yield Slider(name, step, STRONGEST * strength, step, strength)

    def _objectives(self, group: Group, settings: Settings) -> Values:
        """Weights, goals and directions of the objectives of a group."""
        title, tables = _title(group), self._scene.objectives
        chosen, weight = str(settings[f"{title}: objective"]), float(settings[f"{title}: weight"])
        kept = weight if chosen == AS_IN_SCENE else 0.0
        values: Values = {f"objectives.{n}.weight": kept * tables[n].weight for n in group.own}
        for n in group.close:
            factor = float(settings[f"{title}: close to its motion"])
            values[f"objectives.{n}.weight"] = factor * tables[n].weight
        is_effort = chosen == "least effort"
        values[f"objectives.{group.effort}.weight"] = weight if is_effort else 0.0
        if group.drag is None:
            return values
        key, is_drag = f"objectives.{group.drag}", chosen in GOALS and not is_effort
        values[f"{key}.weight"] = weight if is_drag else 0.0
        if is_drag:
            values[f"{key}.goal"] = GOALS[chosen]
        mean = self.flows[0].mean(settings) if self.flows and is_drag else []
        if any(mean):
            values[f"{key}.direction"] = mean
        return values


def _title(group: Group) -> str:
    return f"objective of {and_more(group.joints)}"


def _rate(model: SolidModel, joint: str) -> str:
    """Unit of the strength of a joint."""
    return "m/s" if joint_kind(model, joint) == SLIDE else "°/s"


def _flows(scene: Scene) -> Iterator[Flow]:
    """Winds that act as they are given, and inflow sides of a fluid that is simulated."""
    several = len(scene.wind) > 1
    for n, wind in enumerate(scene.wind):
        title = f"wind {n + 1}" if several else "wind"
        if wind.kind == "force":
            yield _flow(scene, title, f"wind.{n}.force", "N", wind.force)
        elif wind.kind == "faces" or (wind.kind == "stream" and not scene.has_fluid):
            yield _flow(scene, title, f"wind.{n}.velocity", "m/s", wind.velocity)
    if not scene.has_fluid or scene.boundaries is None:
        return
    for name, side in scene.boundaries:
        if side.kind == "inflow":
            yield _flow(
                scene, f"stream at {name}", f"boundaries.{name}.velocity", "m/s", side.velocity
            )


def _flow(scene: Scene, title: str, key: str, unit: str, vector: Sequence[float]) -> Flow:
    x, y, z = vector
    ease = EASE if key.startswith("boundaries") else 0.0
    return Flow(title, key, unit, (x, y, z), ease, scene.is_slab)
