"""The camera of each who looks, as keys to copy into a scene or a command."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flowborne.view.browser.viewpoint import Viewpoint

if TYPE_CHECKING:
    from viser import ClientHandle, GuiMarkdownHandle

Array = NDArray[np.float64]


class CameraKeys:
    """The text in the panel of each who looks.

    folder  of the run, as a command would name it
    """

    def __init__(self, folder: str, slab: bool) -> None:
        self._folder, self._slab = folder, slab
        self._texts: dict[int, GuiMarkdownHandle] = {}

    def show(self, clients: dict[int, ClientHandle], along: Array) -> None:
        """Bring the texts up to date.

        along  (3,) m, by which the world has been moved back so that the view follows the bodies
        """
        self._texts = {key: text for key, text in self._texts.items() if key in clients}
        for key, client in clients.items():
            if not client.camera.update_timestamp:
                continue
            if key not in self._texts:
                with client.gui.add_folder("camera", expand_by_default=False, order=LAST):
                    self._texts[key] = client.gui.add_markdown("")
            camera = client.camera
            seen_from = Viewpoint(
                camera.position + along, camera.look_at + along, float(np.degrees(camera.fov))
            )
            text = camera_text(self._folder, seen_from, self._slab)
            if text != self._texts[key].content:
                self._texts[key].content = text


def camera_text(folder: str, seen_from: Viewpoint, slab: bool) -> str:
    """Markdown: the table of a scene, and the command, with which a film sees the same."""
    keys = seen_from.film_keys(slab)
    table = "\n".join(f"{key} = {value}" for key, value in keys.items())
    settings = " ".join(f'--set "camera.{key}={value}"' for key, value in keys.items())
    return f"```toml\n[film.camera]\n{table}\n```\n\n```sh\nflowborne film {folder} {settings}\n```"


LAST = 1e9
"""Order of what comes last in the panel: others count up from the clock."""
