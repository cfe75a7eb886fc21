"""Table of a scene that says what its film shows, and from where."""

from __future__ import annotations

import re
from math import prod
from typing import Annotated, Literal, Self

from pydantic import Field, Strict, model_validator

from flowborne.base.tables import Number, Positive, Table, Text, Vector

Pixels = Annotated[int, Strict(), Field(ge=64)]

MOST_PIXELS = 1 << 26
"""Pixels of a picture: 8192 x 8192."""

BYTES_PER_PIXEL = 4

BACKGROUND = "#[0-9A-Fa-f]{6}|transparent"
"""Pattern of a background."""

MOST_RATE = 1000.0
"""Pictures in a second of a film."""


class CameraTable(Table):
    """[film.camera]: the camera. It looks at a slab from above, whatever the angles.

    azimuth    degrees about z from x, from the target to the camera
    elevation  degrees above the horizon
    lens       degrees between the lower and the upper edge of the picture
    distance   m from the target; by default the creature just fits
    position   m; replaces azimuth, elevation and distance
    target     m; replaces the followed body
    follow     name of a body, "bodies" for all of them, or "nothing"
    orbit      degrees per second about z, counter-clockwise from above
    """

    azimuth: Number = -58.0
    elevation: Annotated[float, Strict(), Field(ge=-89, le=89)] = 13.0
    lens: Annotated[float, Strict(), Field(ge=1, le=120)] = 26.0
    distance: Positive | None = None
    position: Vector | None = None
    target: Vector | None = None
    follow: Text = "bodies"
    orbit: Number = 0.0

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.position is not None and self.position == self.target:
            raise ValueError("has its position where its target is. Move one of them")
        return self


class FilmTable(Table):
    """[film]: what picture and film of a run show.

    field              field of the fluid that is drawn
    bones              draw flesh transparent, with the bones in it
    plots              title, legend and curves around the map; without them it is the whole picture
    scale_bar          a bar of a round length, in the legend or, without it, on the picture itself;
                       never on a transparent one
    size               (width, height) in pixels, both even; what fits when absent
    frames_per_second  of the film, which keeps the run's time; the run's own when absent
    start, stop        s of the run; all of it when absent
    background         "#rrggbb", or "transparent" in image sequences and WebP; water when absent
    camera             where it is seen from
    """

    field: Literal["dye", "vorticity", "speed", "pressure", "none"] = "vorticity"
    bones: bool = False
    plots: bool = True
    scale_bar: bool = True
    size: tuple[Pixels, ...] | None = None
    frames_per_second: Annotated[Positive, Field(le=MOST_RATE)] | None = None
    start: Number | None = None
    stop: Number | None = None
    background: str | None = None
    camera: CameraTable = CameraTable()

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.size is not None and (len(self.size) != 2 or any(n % 2 for n in self.size)):
            raise ValueError(
                f"has the size {list(self.size)}. Give width and height, even numbers of pixels"
            )
        if self.size is not None and prod(self.size) > MOST_PIXELS:
            raise ValueError(
                f"has the size {list(self.size)}: a picture of "
                f"{prod(self.size) * BYTES_PER_PIXEL / 2**30:.3g} GB, and "
                f"{MOST_PIXELS * BYTES_PER_PIXEL / 2**30:g} GB is the most. Give fewer pixels"
            )
        if self.start is not None and self.stop is not None and self.start >= self.stop:
            raise ValueError(
                f"starts at {self.start:g} s and stops at {self.stop:g} s. Let it stop after it "
                "starts"
            )
        if self.background is not None and not re.fullmatch(BACKGROUND, self.background):
            raise ValueError(
                f'has the background \'{self.background}\'. Give "#rrggbb" or "transparent"'
            )
        return self
