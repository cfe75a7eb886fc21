"""preview.png and preview.mp4 of a run folder."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import imageio.v3 as imageio
import imageio_ffmpeg  # type: ignore[import-untyped]

from flowborne.io.atomic import partial_name, write_atomically
from flowborne.io.run_folder import RunFolder
from flowborne.view.pictures import Picture
from flowborne.view.run import Run

PICTURE_SCALE = 1.5
"""Size of preview.png relative to that of the film."""

CODING = ("-preset", "veryfast", "-crf", "19", "-movflags", "+faststart", "-f", "mp4")
"""How the film is coded: small, sharp, and playing before it is loaded whole."""


def make_preview(
    folder: Path, progress: Callable[[int, int], None] | None = None, *, bones: bool = False
) -> None:
    """Draw preview.png (the last frame) and preview.mp4 (all frames) of a run.

    folder    of the run; nothing else is read
    progress  called with (frames drawn, frames in all)
    bones     see through flesh, to the bones in it
    raises    ValueError when there is no frame, when there is only one (the picture is then drawn
              and the film is not), or when it has three dimensions and nothing can draw them here;
              OSError when the disc refuses
    """
    files = RunFolder(folder)
    run = Run.read(folder)
    with closing(Picture(run, PICTURE_SCALE, bones=bones)) as picture:
        last = picture.draw(len(run) - 1)[:, :, :3]
    write_atomically(files.picture, lambda file: imageio.imwrite(file, last, extension=".png"))
    if len(run) < 2:
        raise ValueError(
            f"{folder} has one frame, which makes a picture and no film; "
            "let the run go on with --resume"
        )
    write_film(run, files.film, progress, bones=bones)


def write_film(
    run: Run,
    path: Path,
    progress: Callable[[int, int], None] | None = None,
    *,
    bones: bool = False,
) -> None:
    """Draw all frames of `run` into an MP4 file (H.264, plays everywhere).

    bones   see through flesh, to the bones in it
    raises  OSError when the file cannot be written; what was there is then still there
    """
    with closing(Picture(run, bones=bones)) as picture:
        _write(picture, path, progress)


def _write(picture: Picture, path: Path, progress: Callable[[int, int], None] | None) -> None:
    """Code one picture after the other into a file beside `path`, which then takes its place."""
    run = picture.run
    partial = path.with_name(partial_name(path.name))
    writer = imageio_ffmpeg.write_frames(
        str(partial),
        (picture.layout.width, picture.layout.height),
        pix_fmt_in="rgba",
        fps=run.frames_per_second,
        codec="libx264",
        pix_fmt_out="yuv420p",
        macro_block_size=2,
        quality=None,
        output_params=list(CODING),
    )
    try:
        writer.send(None)
        for number in range(len(run)):
            writer.send(picture.draw(number))
            if progress is not None:
                progress(number + 1, len(run))
        writer.close()
        partial.replace(path)
    finally:
        writer.close()
        partial.unlink(missing_ok=True)
