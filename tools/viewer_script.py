"""three.js for the recorded runs that turn on the front page, from trimesh, which has it within its
own viewer. A build of the documentation writes it beside them."""

from __future__ import annotations

import zipfile
from importlib.resources import files


def three() -> str:
    """The script: three.js with TrackballControls and GLTFLoader, their licence at its start."""
    packed = files("trimesh").joinpath("resources", "templates", "viewer.zip")
    with packed.open("rb") as stream, zipfile.ZipFile(stream) as archive:
        page = archive.read("viewer.html.template").decode()
    start = page.index("<script>") + len("<script>")
    return page[start : page.index("var camera,controls", start)]
