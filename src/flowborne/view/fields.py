"""What is seen of the fluid of a slab, as an image of its cells."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flowborne.view import style
from flowborne.view.run import Run, State
from flowborne.view.shot import Shot
from flowborne.view.values import (
    filled,
    full_strength,
    in_fluid,
    levels,
    pressure,
    refined,
    robust,
    speed,
    turning,
    vorticity,
)

Array = NDArray[np.float64]
Pixels = NDArray[np.uint8]
Scale = tuple[Array, float, float, str]

SAMPLES = 24
"""Frames from which the scale of a film is taken."""

HIGHEST = 99.8
"""Percentile of speed and pressure at which their colours end: they are high in small places."""


class Field(Protocol):
    """What is shown of the fluid.

    legend  (name, colour) of each thing shown in a colour of its own
    scale   (colours from lowest to highest (k, 3), lowest, highest, name), or None
    """

    legend: Sequence[tuple[str, str]]
    scale: Scale | None

    def image(self, state: State) -> Pixels:
        """(k ny, k nx, 4) colours and opacities of the cells, or of k by k parts of each, lowest
        row first."""
        ...


def field_of(run: Run, shot: Shot) -> Field | None:
    """What `shot` shows of the fluid of `run`; None without fluid.

    raises  ValueError when it shows dye and there is none
    """
    if run.grid is None:
        return None
    dyes = dyes_of(run)
    shot.pictured(dyes)
    if shot.field == "dye":
        return FieldDye(run, dyes)
    if shot.field == "vorticity":
        return FieldVorticity(run, shot.colour)
    return FieldStill() if shot.field == "none" else FieldNumber(run, NUMBERS[shot.field])


def dyes_of(run: Run) -> list[str]:
    """Arrays of a state that hold dye."""
    return [name for name in run.state(0) if name.startswith("scalar_")]


def dye_colours(
    run: Run, dyes: Sequence[str], samples: int
) -> tuple[dict[str, tuple[float, str]], Sequence[tuple[str, str]]]:
    """Of each array that holds dye the value at which it has its full colour, and that colour; and
    the legend, (name, colour) of each.

    samples  frames that are looked at
    """
    sampled = run.sampled(samples)
    colours = [style.DYES[n % len(style.DYES)] for n in range(len(dyes))]
    full = [full_strength([state[dye] for state in sampled]) for dye in dyes]
    legend = [(d.removeprefix("scalar_"), c) for d, c in zip(dyes, colours, strict=True)]
    return dict(zip(dyes, zip(full, colours, strict=True), strict=True)), legend


class FieldStill:
    """Plain water."""

    def __init__(self) -> None:
        self.legend: Sequence[tuple[str, str]] = ()
        self.scale: Scale | None = None

    def image(self, state: State) -> Pixels:
        return np.zeros((1, 1, 4), np.uint8)


class FieldDye:
    """Carried dyes, each in a colour of its own, mixed where they meet."""

    def __init__(self, run: Run, dyes: Sequence[str]) -> None:
        self._dyes, self.legend = dye_colours(run, dyes, SAMPLES)
        self.scale: Scale | None = None

    def image(self, state: State) -> Pixels:
        known = in_fluid(state)[:, :, 0]
        strengths = [
            np.clip(filled(state[dye][:, :, 0] / full, known).T, 0.0, 1.0)[..., None]
            for dye, (full, _) in self._dyes.items()
        ]
        weight: Array = np.zeros_like(strengths[0])
        colour, clear = np.repeat(weight, 3, axis=-1), np.ones_like(weight)
        for strength, (_, name) in zip(strengths, self._dyes.values(), strict=True):
            light = 0.25 * strength**3
            colour += strength * (style.rgb(name) * (1.0 - light) + light)
            weight += strength
            clear *= 1.0 - strength
        mixed = colour / np.maximum(weight, 1e-12)
        return pixels(np.concatenate([mixed, 1.0 - clear], axis=-1))


class FieldVorticity:
    """Vorticity, warm where the fluid turns counter-clockwise, on one scale for all frames.

    limit  1/s, where the colours are strongest
    """

    def __init__(self, run: Run, background: str) -> None:
        """`background`: what is seen where nothing turns, "#rrggbb"."""
        if run.grid is None:
            raise ValueError("a run without fluid has no vorticity")
        self.grid = run.grid
        self.limit = turning([vorticity(state, run.grid) for state in run.sampled(SAMPLES)])
        self.table = _fading(1023)
        self.legend: Sequence[tuple[str, str]] = ()
        self.scale: Scale | None = (
            over(self.table, background) / 255.0,
            -self.limit,
            self.limit,
            "vorticity (1/s)",
        )

    def image(self, state: State) -> Pixels:
        share = refined(vorticity(state, self.grid).T / self.limit)
        return self.table[levels(share, len(self.table))]


class FieldNumber:
    """Speed or pressure, on one scale for all frames.

    limit  in the quantity's unit, where the colours end
    """

    def __init__(self, run: Run, shown: Shown) -> None:
        self._shown, self.values = shown, shown.values
        seen = [np.abs(shown.values(state))[in_fluid(state)] for state in run.sampled(SAMPLES)]
        self.limit = robust(seen, HIGHEST)
        self.table = shown.table(255)
        low = -self.limit if shown.signed else 0.0
        self.legend: Sequence[tuple[str, str]] = ()
        self.scale: Scale | None = (self.table / 255.0, low, self.limit, shown.name)

    def image(self, state: State) -> Pixels:
        values = filled(self.values(state)[:, :, 0], in_fluid(state)[:, :, 0])
        return opaque(self.colours(refined(values.T)))

    def colours(self, values: Array) -> Pixels:
        """(..., 3) colours of values in the quantity's unit."""
        share = values / self.limit
        return self.table[levels(share if self._shown.signed else 2.0 * share - 1.0, 255)]


@dataclass(frozen=True)
class Shown:
    """A number of each cell that can be shown.

    name    with its unit, for the scale
    values  state -> (nx, ny, nz)
    signed  whether it goes both ways about 0; else it is never less
    table   count -> (count, 3) colours from lowest to highest
    """

    name: str
    values: Callable[[State], Array]
    signed: bool
    table: Callable[[int], Pixels]


def opaque(colours: Pixels) -> Pixels:
    """(..., 4) colours (..., 3) that hide what is behind."""
    return np.concatenate([colours, np.full((*colours.shape[:-1], 1), 255, np.uint8)], axis=-1)


def over(image: Pixels, background: str) -> Pixels:
    """(..., 3) an image (..., 4) before a background, "#rrggbb"."""
    share = image[..., 3:] / 255.0
    return np.rint(image[..., :3] * share + 255.0 * style.rgb(background) * (1.0 - share)).astype(
        np.uint8
    )


def _fading(count: int) -> Pixels:
    """(count, 4) colours from strong clockwise through nothing to strong counter-clockwise."""
    (right, left), clear = (_knots(style.SPIN_RIGHT), _knots(style.SPIN_LEFT)), np.zeros(1)
    colours = np.stack([*right, right[-1], left[-1], *left[::-1]])
    places = [-1.0, -0.55, -0.2, -1e-9, 1e-9, 0.2, 0.55, 1.0]
    faint = np.concatenate([np.ones(3), clear, clear, np.ones(3)])
    return pixels(_ramp(places, np.column_stack([colours, faint]), count))


def _rising(count: int) -> Pixels:
    """(count, 3) colours from rest to the highest speed."""
    return pixels(_ramp(np.linspace(-1.0, 1.0, len(style.SPEED)), _knots(style.SPEED), count))


def _balanced(count: int) -> Pixels:
    """(count, 3) colours from the lowest pressure to the highest."""
    knots = _knots((*style.SUCTION, style.LEVEL, *style.PUSH[::-1]))
    return pixels(_ramp(np.linspace(-1.0, 1.0, len(knots)), knots, count))


def _knots(colours: Sequence[str]) -> Array:
    return np.stack([style.rgb(colour) for colour in colours])


def _ramp(places: Sequence[float] | Array, knots: Array, count: int) -> Array:
    """(count, k) `knots` (n, k) at places from -1 to 1, joined by straight lines."""
    share = np.linspace(-1.0, 1.0, count)
    return np.stack([np.interp(share, places, knot) for knot in knots.T], axis=1)


def pixels(colours: NDArray[np.floating]) -> Pixels:
    """Colours from 0 to 1 as bytes."""
    return np.rint(255.0 * colours).astype(np.uint8)


NUMBERS = {
    "speed": Shown("speed (m/s)", speed, False, _rising),
    "pressure": Shown("pressure about its mean (Pa)", pressure, True, _balanced),
}
"""Fields that are one number of each cell."""
