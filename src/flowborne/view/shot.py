"""What a film shows of a run: the table [film] of its scene, and what follows from it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.scenes.schema_film import FilmTable
from flowborne.view import style

MAX_FRAMES = 1_000_000
"""Maximum number of frames of a film."""


class Shot(FilmTable):
    """What a film shows."""

    @property
    def transparent(self) -> bool:
        """Whether the background is transparent."""
        return self.background == "transparent"

    @property
    def colour(self) -> str:
        """Colour of the background, "#rrggbb"; that of water if it is transparent or not given."""
        return style.WATER if self.background is None or self.transparent else self.background

    def frames(self, times: Array, run_rate: float) -> list[int]:
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
