"""The runs of a batch of clips, and the page that shows them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from urllib.parse import quote

from flowborne.base.atomic import write_text
from flowborne.base.one_line import one_line
from flowborne.runs.run_folder import RunFolder, cannot_write

PAGE = "index.html"

MARK = '<meta name="generator" content="flowborne">'
"""Of a page that may be written anew."""

HEAD = f"""<!doctype html>
<html lang="en">
<meta charset="utf-8">
{MARK}
<meta name="viewport" content="width=device-width">
<style>
body {{ font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 76em; padding: 0 1em; }}
article {{ display: grid; grid-template-columns: 14em 14em 1fr; gap: 1em; padding: 1em 0;
  border-top: 1px solid #8888; }}
figure {{ margin: 0; }}
img {{ width: 100%; }}
figcaption, li {{ font-size: 13px; }}
h2 {{ margin: 0; font-size: 1.2em; }}
p {{ margin: 0.4em 0; }}
ul {{ margin: 0.4em 0; padding-left: 1.2em; overflow-wrap: anywhere; }}
.failed {{ color: #c33; }}
@media (max-width: 50em) {{ article {{ grid-template-columns: 1fr 1fr; }}
  article > div {{ grid-column: 1 / 3; }} }}
</style>
"""


@dataclass(frozen=True)
class ClipRun:
    """The runs of a clip.

    clip      its file
    folder    of the run
    captured  folder of the run without a controller; None if there is none
    failure   why the runs are not complete; "" if they are
    doubts    why not to trust their numbers
    notes     warnings of `flowborne check`, and how the clip was read
    frames    of the run
    time      duration of the run, s;  duration of the clip, s
    before    effort as captured, N m: median over the frames of the norm of the torques (N m;
              forces in N of slides) of the drives of the controlled joints; None without one
    after     the same in the run, where the controller moves these joints
    """

    clip: Path
    folder: Path
    captured: Path | None = None
    failure: str = ""
    doubts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    frames: int = 0
    time: float = 0.0
    duration: float = 0.0
    before: float | None = None
    after: float | None = None

    @property
    def ratio(self) -> float | None:
        """`after` over `before`."""
        return self.after / self.before if self.before and self.after is not None else None


@dataclass(frozen=True)
class Batch:
    """The clips of a folder in one scene.

    scene    its name
    joints   the controlled joints
    page     the page
    of       number of clips in the folder
    skipped  names of what is in the folder and is no clip
    clips    those done, in the order of their names
    """

    __repr__ = one_line

    scene: str
    joints: tuple[str, ...]
    page: Path
    of: int
    skipped: tuple[str, ...]
    clips: list[ClipRun] = field(default_factory=list)


def is_own_page(path: Path) -> bool:
    """Whether `write_page` wrote this file."""
    return MARK in path.read_text(encoding="utf-8", errors="replace")[: len(HEAD)]


def write_page(batch: Batch) -> None:
    """Write the page of a batch, whose links are relative to its folder.

    raises  RunFolderError if it cannot be written
    """
    title = f"<title>{escape(batch.scene)}: clips</title>"
    try:
        write_text(batch.page, "\n".join([HEAD + title, *_body(batch), ""]))
    except OSError as error:
        raise cannot_write(batch.page, error) from error


def effort_text(done: ClipRun) -> str:
    """Both efforts and their ratio in words: "31.2 N m as captured, 8.41 N m in the run"."""
    if done.after is None:
        return "none: no joint is controlled"
    if done.ratio is None:
        return f"{done.after:.3g} N m in the run"
    both = f"{done.before:.3g} N m as captured, {done.after:.3g} N m in the run"
    return f"{both}, ratio {done.ratio:.2f}"


def _body(batch: Batch) -> Iterator[str]:
    failed = sum(bool(done.failure) for done in batch.clips)
    yield f"<h1>{escape(batch.scene)}: {len(batch.clips)} of {batch.of} clips</h1>"
    joints = ", ".join(batch.joints) or "none"
    yield (
        "<p>Effort is the norm of the torques of the drives of the controlled joints "
        f"({escape(joints)}), N m (of slides the forces, N): the median over the frames, of means "
        "over the steps of a frame. <em>As captured</em>, these joints follow the clip exactly; "
        "<em>in the run</em>, the controller moves them. Everything else is the same. A ratio "
        "below 1 means that the motion of the run takes less effort than that of the clip. The "
        "column <code>effort</code> of a history is this norm in the last step of a frame, times "
        "the duration of the step, N m s.</p>"
    )
    if failed:
        yield f'<p class="failed">Failed: {failed}.</p>'
    if batch.skipped:
        yield f"<p>Skipped, not BVH files: {escape(', '.join(batch.skipped))}.</p>"
    for done in batch.clips:
        yield from _article(done, batch.page.parent)


def _article(done: ClipRun, out: Path) -> Iterator[str]:
    yield "<article>"
    yield _figure(done.captured, out, "as captured")
    yield _figure(done.folder, out, "in the run")
    yield f"<div><h2>{escape(done.clip.name)}</h2>"
    if done.failure:
        yield f'<p class="failed">Failed: {escape(done.failure)}</p>'
    else:
        yield (
            f"<p>{done.frames} frames, {done.time:.2f} s of the clip's {done.duration:.2f} s</p>"
            f"<p>Effort: {effort_text(done)}</p>"
        )
    yield f"<p>{' · '.join(_links(done, out))}</p>"
    yield "<ul>"
    yield from (f'<li class="failed">{escape(doubt)}</li>' for doubt in done.doubts)
    yield from (f"<li>{escape(note)}</li>" for note in done.notes)
    yield "</ul></div></article>"


def _figure(folder: Path | None, out: Path, caption: str) -> str:
    """The last frame of a run, as large as its film shows it."""
    if folder is None or not RunFolder(folder).picture.exists():
        return f"<figure><figcaption>{caption}: no picture</figcaption></figure>"
    files = RunFolder(folder)
    target = _link(files.film if files.film.exists() else files.picture, out)
    return (
        f'<figure><a href="{target}"><img loading="lazy" src="{_link(files.picture, out)}" '
        f'alt="last frame, {caption}"></a><figcaption>{caption}</figcaption></figure>'
    )


def _links(done: ClipRun, out: Path) -> Iterator[str]:
    film = RunFolder(done.folder).film
    named = (("film", film), ("folder of the run", done.folder), ("as captured", done.captured))
    for name, path in named:
        if path is not None and path.exists():
            yield f'<a href="{_link(path, out)}">{name}</a>'


def _link(path: Path, out: Path) -> str:
    return quote(path.relative_to(out).as_posix() + "/" * path.is_dir())
