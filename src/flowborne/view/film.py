"""Picture, film and image sequence of a run folder."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import closing, contextmanager
from itertools import chain
from pathlib import Path

import imageio.v3 as imageio
import imageio_ffmpeg  # type: ignore[import-untyped]

from flowborne.base.atomic import partial_name, write_atomically
from flowborne.runs.run_folder import RunFolder
from flowborne.view.drawing import drawn_frames
from flowborne.view.pictures import Picture
from flowborne.view.run import Run
from flowborne.view.shot import Shot
from flowborne.view.style import Pixels

Progress = Callable[[int, int], None]

PICTURE_SCALE = 1.5
"""Size of preview.png relative to the film."""

CODING = {
    ".mp4": (
        "libx264",
        "yuv420p",
        ("-preset", "veryfast", "-crf", "19", "-movflags", "+faststart", "-f", "mp4"),
    ),
    ".webp": ("libwebp_anim", "yuva420p", ("-loop", "0", "-quality", "75", "-f", "webp")),
}
"""Ending -> codec, pixel format and options: small, sharp, and playable while it loads. Web pages
show WebP as an image in a loop."""

ENDINGS = (*CODING, ".png")


def make_preview(folder: Path, progress: Progress | None = None, shot: Shot | None = None) -> None:
    """Draw preview.png (the last frame) and preview.mp4 (all frames) of a run.

    folder    of the run; nothing else is read
    progress  called with (frames drawn, total frames)
    shot      what they show; None is the shot of the run's scene
    raises    RunFolderError as `Run`; ValueError if there is only one frame (then only the picture
              is drawn), if the shot does not fit the run, or if the run has three dimensions and
              this machine cannot draw them; OSError if a file cannot be written
    """
    run = Run(folder)
    shot = run.shot if shot is None else shot
    numbers = shot.frames(run.times, run.frames_per_second)
    _draw_picture(run, numbers[-1], shot)
    if len(numbers) < 2:
        raise ValueError(
            f"{folder} has one frame, which makes a picture and no film; "
            "continue the run with resume=True"
        )
    write_film(run, RunFolder(folder).film, progress, shot)


def make_picture(folder: Path) -> None:
    """Draw preview.png alone. Raises as `make_preview`, but draws a run of one frame."""
    run = Run(folder)
    _draw_picture(run, run.shot.frames(run.times, run.frames_per_second)[-1], run.shot)


def _draw_picture(run: Run, number: int, shot: Shot) -> None:
    # a picture of a given size has that size
    with closing(Picture(run, PICTURE_SCALE if shot.size is None else 1.0, shot)) as picture:
        _write_image(RunFolder(run.folder).picture, picture.draw(number), shot)


def write_shot(
    folder: Path, path: Path, progress: Progress | None = None, shot: Shot | None = None
) -> str:
    """Draw a run into a file chosen by the user; returns a text that names the written files.

    path    film.mp4, film.webp (an animated image), or frames.png for an image sequence
            frames_0000.png, frames_0001.png, ...; its folder is created if missing
    raises  as `make_preview`; also ValueError for another ending
    """
    if path.suffix.lower() not in ENDINGS:
        raise ValueError(
            f"{path} is neither a film nor an image sequence; end it with one of "
            f"{', '.join(ENDINGS)}"
        )
    run = Run(folder)
    shot = run.shot if shot is None else shot
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix.lower() in CODING:
        write_film(run, path, progress, shot)
        return str(path)
    count = 0
    with closing(_frames(run, shot, progress)) as frames:
        for count, frame in enumerate(frames, start=1):
            _write_image(path.with_name(f"{path.stem}_{count - 1:04d}{path.suffix}"), frame, shot)
    first, last = (path.with_name(f"{path.stem}_{n:04d}{path.suffix}") for n in (0, count - 1))
    return str(first) if count == 1 else f"{first} to {last.name}"


def write_film(
    run: Run, path: Path, progress: Progress | None = None, shot: Shot | None = None
) -> None:
    """Draw frames of `run` into an MP4 file (H.264, plays everywhere) or an animated WebP.

    shot    what they show; None is the shot of the run's scene
    raises  ValueError if the shot does not fit the run, or is transparent in MP4; OSError if the
            file cannot be written; an earlier file is then kept
    """
    shot = run.shot if shot is None else shot
    if shot.transparent and path.suffix.lower() == ".mp4":
        raise ValueError(
            "a film in MP4 cannot be transparent; write an image sequence (frames.png) "
            "or an image that moves (film.webp), or name a colour of the background"
        )
    rate = shot.frames_per_second or run.frames_per_second
    with closing(_frames(run, shot, progress)) as frames:
        first = next(frames)
        with film_file(path, (first.shape[1], first.shape[0]), rate) as send:
            for frame in chain([first], frames):
                send(frame)


def _frames(run: Run, shot: Shot, progress: Progress | None) -> Generator[Pixels, None, None]:
    """The frames of a film, each valid until the next; `progress` is called after each one."""
    numbers = shot.frames(run.times, run.frames_per_second)
    with closing(drawn_frames(run, shot, numbers)) as frames:
        for done, frame in enumerate(frames, start=1):
            yield frame
            if progress is not None:
                progress(done, len(numbers))


def _write_image(path: Path, frame: Pixels, shot: Shot) -> None:
    kept = frame if shot.transparent else frame[:, :, :3]
    write_atomically(path, lambda file: imageio.imwrite(file, kept, extension=".png"))


@contextmanager
def film_file(
    path: Path, size: tuple[int, int], rate: float
) -> Iterator[Callable[[Pixels], object]]:
    """Context with a function that writes the next frame; `path` is replaced at the end.

    size  width and height of the frames
    rate  frames per second
    """
    partial = path.with_name(partial_name(path.name))
    partial.unlink(missing_ok=True)
    codec, pixels, options = CODING[path.suffix.lower()]
    writer = imageio_ffmpeg.write_frames(
        str(partial),
        size,
        pix_fmt_in="rgba",
        fps=rate,
        codec=codec,
        pix_fmt_out=pixels,
        macro_block_size=2,
        quality=None,
        output_params=list(options),
    )
    try:
        writer.send(None)
        yield writer.send
        writer.close()
        partial.replace(path)
    finally:
        writer.close()
        partial.unlink(missing_ok=True)
