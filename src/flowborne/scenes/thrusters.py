"""The thrusters of a scene: their table, checks and builder."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from pydantic import Field, model_validator

from flowborne.base.phrases import suggestion
from flowborne.base.tables import Number, Places, Positive, Text, Vector, triple
from flowborne.control.surroundings import Surroundings
from flowborne.coupling.cut import discs_at, pose_and_cut, volumes_of
from flowborne.coupling.thrusters import Thruster
from flowborne.coupling.world import Setup, World
from flowborne.fluid.sides.far import Strength
from flowborne.motion.formula import Formula
from flowborne.motion.inflow import Factor, FactorFormula, FactorSteady
from flowborne.scenes.factors import FactorsTable
from flowborne.solids.force import immovable
from flowborne.solids.model import SolidModel, SolidState
from flowborne.solids.sites import Site, sites

OUT_OF_PLANE = 1e-6
"""Least component of a unit vector along z that a slab does not have."""


@dataclass(frozen=True)
class Scaled:
    """An amount, or a formula of it, times a factor."""

    amount: float | FactorFormula
    factor: Factor

    def at(self, time: float) -> float:
        """Its value at `time` (s)."""
        full = self.amount if isinstance(self.amount, float) else self.amount.at(time)
        return full * self.factor.at(time)


class ThrusterTable(FactorsTable):
    """[[thruster]]: an actuator disc on a body, which it pushes one way and the water the other.

    name         for columns and commands; that of the site, or "thruster_" and its number, unless
                 given
    site         of the model, whose origin is the middle of the disc
    body         instead of a site: the body
    point        middle of the disc in the frame of that body, m
    axis         along which it pushes its body, in the frame of the site or the body; any length
    radius       m; half the width of a strip in two dimensions
    thrust       N (N/m in two dimensions), a number or a formula of the time t in s
    coefficient  instead of the thrust: C of T = C rho n |n| D^4 with the diameter D (D^3 in two
                 dimensions)
    speed        n of that, revolutions per second, a number or a formula
    range        least and largest thrust, or speed; without end unless given
    times        s, keyframes between which `factors` of thrust or speed change smoothly
    factors      of it at these times
    """

    name: Text | None = None
    site: Text | None = None
    body: Text | None = None
    point: Vector | None = None
    axis: Vector = (1.0, 0.0, 0.0)
    radius: Positive
    thrust: Number | Text | None = None
    coefficient: Positive | None = None
    speed: Number | Text | None = None
    range: tuple[Number, ...] | None = Field(default=None, min_length=2, max_length=2)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not any(self.axis):
            raise ValueError("has an axis of length 0. Point it to where the body is pushed")
        if (self.site is None) == (self.body is None):
            both = "neither a site nor a body" if self.site is None else "a site and a body"
            raise ValueError(f"has {both}. Give one of the two")
        if self.site is not None and self.point is not None:
            raise ValueError("has a point beside its site. Give body and point, or the site alone")
        turned = self.coefficient is not None, self.speed is not None
        if self.thrust is None and not all(turned):
            raise ValueError("has no thrust. Give thrust, or coefficient and speed")
        if self.thrust is not None and any(turned):
            raise ValueError("has a thrust and a coefficient or speed. Keep one of them")
        if self.range is not None and self.range[0] >= self.range[1]:
            raise ValueError(f"has a range from {self.range[0]:g} to {self.range[1]:g}. Swap them")
        return self

    def named(self, number: int) -> str:
        """Its name; `number` from 1."""
        return self.name or self.site or f"thruster_{number}"

    @property
    def setting(self) -> tuple[str, float | str]:
        """Key of the amount that changes, and its value."""
        if self.thrust is not None:
            return "thrust", self.thrust
        assert self.speed is not None
        return "speed", self.speed

    def check(self, around: Surroundings) -> Iterator[str]:
        """Everything that does not fit the scene around it."""
        known = sites(around.model)
        if self.body is not None:
            yield from around.unknown_bodies([self.body])
            yield from immovable(around.model, self.body)
        elif self.site not in known:
            end = (
                suggestion(str(self.site), known, "Its sites are")
                if known
                else (". It has none: give body and point")
            )
            yield f"site '{self.site}' is not in {around.source}{end}"
            return
        else:
            yield from immovable(around.model, around.model.body_names[known[self.site].body])
        if around.is_slab and self.body in (None, *around.model.body_names):
            _, _, rotation = self._place(around.model)
            if abs((rotation @ np.array(self.axis))[2]) > OUT_OF_PLANE * math.hypot(*self.axis):
                yield "the axis leaves the plane of a scene of 2 dimensions. Turn it into it."

    def _place(self, model: SolidModel) -> Site:
        if self.site is not None:
            return sites(model)[self.site]
        point = np.zeros(3) if self.point is None else np.array(self.point)
        return Site(model.body(str(self.body)), point, np.eye(3))

    def build(self, model: SolidModel, number: int, constants: Mapping[str, float]) -> Thruster:
        """The thruster, `number` from 1; `constants` of its formula."""
        body, position, rotation = self._place(model)
        axis = rotation @ np.array(self.axis) / math.hypot(*self.axis)
        low, high = (-math.inf, math.inf) if self.range is None else self.range
        return Thruster(
            self.named(number),
            body,
            triple(tuple(position.tolist())),
            triple(tuple(axis.tolist())),
            self.radius,
            self._strength(constants),
            self.coefficient,
            (low, high),
        )

    def _strength(self, constants: Mapping[str, float]) -> Strength:
        _, value = self.setting
        amount = FactorFormula(Formula(value, constants)) if isinstance(value, str) else value
        return Scaled(amount, self.keyframes() or FactorSteady())


def thrusters_of(
    tables: Sequence[ThrusterTable], model: SolidModel, constants: Mapping[str, float]
) -> tuple[Thruster, ...]:
    """The thrusters, in the order of the file."""
    return tuple(t.build(model, number, constants) for number, t in enumerate(tables, start=1))


def check_thrusters(
    places: Places, tables: Sequence[ThrusterTable], coupling: str, around: Surroundings
) -> Iterator[str]:
    """Thrusters against the model and each other, and the fluid that they need."""
    used = dict.fromkeys(around.model.actuator_names, "an actuator of the model")
    for index, table in enumerate(tables):
        where, name = places.at("thruster", index), table.named(index + 1)
        yield from (f"{where}: {problem}" for problem in table.check(around))
        if name in used:
            yield f"{where}: '{name}' is {used[name]} as well. Give it another name."
        used[name] = f"thruster {index + 1}"
    if tables and coupling != "two-way" and places.sound("fluid", "domain"):
        yield (
            f"{places.at('thruster')}: there is no fluid that thrusters can push. Make "
            "fluid.coupling 'two-way', or take [[force]], which needs no water."
        )


def check_discs(
    places: Places, thrusters: Sequence[Thruster], setup: Setup, start: SolidState
) -> Iterator[str]:
    """Every thruster must have water at the start; for a scene with no other fault."""
    for index, part in enumerate(parts_of_water(thrusters, setup, start)):
        if isinstance(part, str):
            yield f"{places.at('thruster', index)}: {part}."


def parts_of_water(
    thrusters: Sequence[Thruster], setup: Setup, start: SolidState
) -> Iterator[float | str]:
    """Which part of the disc of each thruster is water at the start; a sentence where none is."""
    world = World.at_rest(setup)
    world.solid = start
    pose, cut = pose_and_cut(world)
    volumes = volumes_of(world, cut)
    for thruster in thrusters:
        world.setup = setup.but(thrusters=(thruster,))
        try:
            yield discs_at(world, pose, volumes, 0.0)[0].water
        except ValueError as error:
            yield str(error)
