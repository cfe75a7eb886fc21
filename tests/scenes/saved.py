"""A scene in a folder of its own."""

from pathlib import Path

from flowborne.scenes.save import SCENE_FILE, scene_files
from flowborne.scenes.schema import Scene


def save_scene(scene: Scene, folder: Path) -> Path:
    """Write `scene_files` into `folder`, which is made when it is missing.

    returns  the scene file; `load_scene` makes an identical scene of it
    """
    for name, content in scene_files(scene).items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return folder / SCENE_FILE
