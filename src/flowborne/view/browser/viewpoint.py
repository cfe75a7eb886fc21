"""The view at the start, and the keys of [film.camera] for the current view."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from shlex import quote
from typing import TYPE_CHECKING, Literal

import numpy as np

from flowborne.kernels.arrays import Array
from flowborne.view.framing import windows
from flowborne.view.run import Run
from flowborne.view.space.camera import camera_of

if TYPE_CHECKING:
    from viser import ClientHandle, GuiHtmlHandle

ASPECT, PHONE = 0.75, 1.9
"""Approximate height over width of the part of a browser's window that shows the run."""

PREFORMATTED = '<pre style="margin:0;padding:2px 12px 8px;white-space:pre-wrap">{}</pre>'

LAST = 1e9
"""Order of the last item in the panel; viser counts others up from the clock."""


@dataclass(frozen=True)
class Viewpoint:
    """Position, target and lens of a camera.

    position  (3,) m
    target    (3,) m
    lens      degrees between the lower and the upper edge
    """

    position: Array
    target: Array
    lens: float

    def film_keys(self, slab: bool) -> dict[str, list[float] | float]:
        """Keys of [film.camera] for the same view in a film, to a thousandth of the distance.

        A slab is filmed from straight above, at the same distance.
        """
        distance = float(np.linalg.norm(self.position - self.target))
        digits = 3 - int(np.floor(np.log10(distance)))
        target = [round(float(x), digits) + 0.0 for x in self.target]
        lens = round(self.lens, 2)
        if slab:
            return {"target": target, "distance": round(distance, digits), "lens": lens}
        position = [round(float(x), digits) + 0.0 for x in self.position]
        return {"position": position, "target": target, "lens": lens}


@dataclass(frozen=True, eq=False)
class FilmView:
    """The view of a run's film, with which the viewer starts.

    first   viewpoint of the first state
    path    (n, 3) m, displacement of the film's camera since then
    side    m, smaller side of the view
    up      axis that is up in the view, "+y" or "+z"
    aspect  height over width of the page for which it is made
    """

    first: Viewpoint
    path: Array
    side: float
    up: Literal["+y", "+z"]
    aspect: float

    @classmethod
    def of(cls, run: Run, aspect: float = ASPECT) -> FilmView:
        """raises  ValueError if its camera follows a body that does not exist"""
        lens = run.shot.camera.lens
        if run.is_slab:
            views = windows(run, run.shot, aspect)
            path = np.column_stack([views[:, :2].mean(axis=1), views[:, 2:].mean(axis=1)])
            path = np.pad(path, ((0, 0), (0, 1)))
            sides = views[0, [1, 3]] - views[0, [0, 2]]
            height = max(sides[1], aspect * sides[0])
            away = np.array([0.0, 0.0, 0.5 * height / np.tan(0.5 * np.radians(lens))])
            first = Viewpoint(path[0] + away, path[0], lens)
            return cls(first, path - path[0], sides.min(), "+y", aspect)
        camera = camera_of(run, run.shot, aspect)
        focus = camera.focus
        first = Viewpoint(focus[0] + camera.away[0], focus[0], lens)
        side = min(camera.width, camera.height)
        return cls(first, focus - focus[0], side, "+z", aspect)

    def show_to(self, client: ClientHandle) -> None:
        """Bring the camera of a page to the first viewpoint, farther away if it is narrower."""
        first, camera = self.first, client.camera
        narrow = max(1.0, camera.image_height / camera.image_width / self.aspect)
        with client.atomic():
            camera.up_direction = np.eye(3)["xyz".index(self.up[1])]
            camera.position = first.target + narrow * (first.position - first.target)
            camera.look_at = first.target
            camera.fov = float(np.radians(first.lens))


class CameraKeys:
    """The camera of each client as text in its panel, to copy into a scene or a command.

    folder  of the run, for the command
    """

    def __init__(self, folder: str, slab: bool) -> None:
        self._folder, self._slab = folder, slab
        self._texts: dict[int, GuiHtmlHandle] = {}

    def show(self, clients: dict[int, ClientHandle], along: Array) -> None:
        """Update the texts.

        along  (3,) m, by which the world is moved back so that the view follows the bodies
        """
        self._texts = {key: text for key, text in self._texts.items() if key in clients}
        for key, client in clients.items():
            if not client.camera.update_timestamp:
                continue
            if key not in self._texts:
                with client.gui.add_folder("camera", expand_by_default=False, order=LAST):
                    self._texts[key] = client.gui.add_html("")
            camera = client.camera
            seen_from = Viewpoint(
                camera.position + along, camera.look_at + along, float(np.degrees(camera.fov))
            )
            text = PREFORMATTED.format(escape(camera_text(self._folder, seen_from, self._slab)))
            if text != self._texts[key].content:
                self._texts[key].content = text


def camera_text(folder: str, seen_from: Viewpoint, slab: bool) -> str:
    """The table of a scene and the command for the same view in a film."""
    keys = seen_from.film_keys(slab)
    table = "\n".join(f"{key} = {value}" for key, value in keys.items())
    settings = " ".join(f'--set "camera.{key}={value}"' for key, value in keys.items())
    return f"[film.camera]\n{table}\n\nflowborne film {quote(folder)} {settings}"
