"""What a film shows of a run, and from which viewpoint: the table [film] of its scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from flowborne.view import style

Place = tuple[float, float, float]

MAX_FRAMES = 1_000_000
"""Maximum number of frames of a film."""


@dataclass(frozen=True)
class CameraShot:
    """The viewpoint; keys, units and defaults of [film.camera]."""

    azimuth: float = -58.0
    elevation: float = 13.0
    lens: float = 26.0
    distance: float | None = None
    position: Place | None = None
    target: Place | None = None
    follow: str = "bodies"
    orbit: float = 0.0


@dataclass(frozen=True)
class Shot:
    """What a film shows; keys, units and defaults of [film]."""

    field: Literal["dye", "vorticity", "speed", "pressure", "none"] = "vorticity"
    bones: bool = False
    plots: bool = True
    scale_bar: bool = True
    size: tuple[int, int] | None = None
    frames_per_second: float | None = None
    start: float | None = None
    stop: float | None = None
    background: str | None = None
    camera: CameraShot = CameraShot()

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> Shot:
        """The shot of a validated table; missing keys have their defaults."""

        def hashable(keys: Mapping[str, Any]) -> dict[str, Any]:
            return {key: tuple(v) if isinstance(v, list) else v for key, v in keys.items()}

        camera = CameraShot(**hashable(table.get("camera", {})))
        return cls(**hashable(table) | {"camera": camera})

    @property
    def transparent(self) -> bool:
        """Whether the background is transparent."""
        return self.background == "transparent"

    @property
    def colour(self) -> str:
        """Colour of the background, "#rrggbb"; that of water if it is transparent or not given."""
        return style.WATER if self.background is None or self.transparent else self.background

    def frames(self, times: NDArray[np.float64], run_rate: float) -> list[int]:
        """Numbers of the states that the frames of the film show, in order.

        A film with another rate than the run keeps its speed: each frame shows the nearest state.

        times     (n,) s, of the states
        run_rate  frames per second of the run
        raises    ValueError if no state is between start and stop, or more than MAX_FRAMES are
        """
        start = times[0] if self.start is None else self.start
        stop = times[-1] if self.stop is None else self.stop
        slack = 1e-6 / run_rate
        inside = np.flatnonzero((times >= start - slack) & (times <= stop + slack))
        if inside.size == 0:
            raise ValueError(
                f"no frame lies between {start:g} and {stop:g} s; the run goes from {times[0]:g} "
                f"to {times[-1]:g} s"
            )
        if self.frames_per_second is None:
            return [int(number) for number in inside]
        first, last = times[inside[0]], times[inside[-1]]
        count = int(np.floor((last - first + slack) * self.frames_per_second)) + 1
        if count > MAX_FRAMES:
            raise ValueError(
                f"the film has {count} frames at {self.frames_per_second:g} a second, and "
                f"{MAX_FRAMES} are the most; lower its frames_per_second, or give start and stop"
            )
        wanted = first + np.arange(count) / self.frames_per_second
        # the earlier one of two equally near
        nearest = np.abs(times[inside] - (wanted[:, None] - slack)).argmin(axis=1)
        return [int(number) for number in inside[nearest]]

    def followed(self, bodies: Sequence[str]) -> int | None:
        """Number of the body that the camera follows; None if it follows all, or nothing.

        raises  ValueError if there is no such body
        """
        name = self.camera.follow
        if name in ("bodies", "nothing"):
            return None
        if name not in bodies:
            raise ValueError(
                f"the camera cannot follow body '{name}'; the bodies are {', '.join(bodies)}"
            )
        return list(bodies).index(name)
