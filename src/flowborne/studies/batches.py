"""A folder of clips through one scene: two runs of each clip, and a page with their efforts.

<out>/index.html        the page, written anew after every clip
<out>/<clip>/           the run of the scene with the clip
<out>/captured/<clip>/  the run without a controller: all joints follow the clip
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from flowborne.base.arguments import COUNT, PATH, PROGRESS, TEXTS, or_none, takes
from flowborne.base.errors import SceneError, fault_of
from flowborne.base.extras import missing_to_draw
from flowborne.base.phrases import listed
from flowborne.base.progress import Progress, RunProgress, displayed
from flowborne.motion.human.body import ELBOWS
from flowborne.runs.history import history_columns, read_history
from flowborne.runs.run_folder import RunFolder, RunFolderError, make_folder
from flowborne.scenes.bodies import load_model
from flowborne.scenes.capture import capture_of, followers
from flowborne.scenes.control import ControllerTable
from flowborne.scenes.load import load_scene
from flowborne.scenes.save import scene_to_resume, with_frames
from flowborne.scenes.schema import Scene
from flowborne.sim.endings import COMPLETE
from flowborne.sim.running import run
from flowborne.studies.batch_page import PAGE, Batch, ClipRun, is_own_page, write_page

log = logging.getLogger("flowborne")

CAPTURED = "captured"
"""Folder of the runs without a controller."""

ENDING = ".bvh"


@takes(
    clips=PATH,
    out=or_none(PATH),
    overrides=or_none(TEXTS),
    workers=or_none(COUNT),
    progress=or_none(PROGRESS),
)
def run_clips(
    scene: str | Path,
    clips: str | Path,
    out: str | Path | None = None,
    *,
    overrides: Mapping[str, str] | None = None,
    workers: int | None = None,
    replace: bool = False,
    film: bool = True,
    progress: Progress | bool | None = None,
) -> Batch:
    """Run each BVH clip of a folder in a scene, and write a page with their efforts.

    A run ends with its clip, or after the frames of the scene. Complete runs in `out` are kept,
    others are continued. A clip that fails does not stop the others: see `ClipRun.failure`.

    scene      name of a built-in one, or path of a scene file, with [clip]
    clips      the folder of clips
    out        folder to write; runs/<name of the scene>-clips by default
    overrides  dotted key -> TOML text of its new value, as in `load_scene`
    workers, replace, film, progress  as in `run`
    raises     RunFolderError if a folder is wrong and SceneError if the scene is, before anything
               is written; KeyboardInterrupt after Ctrl-C: the same call continues
    """
    settings = dict(overrides or {})
    names, skipped = _clips_in(Path(clips))
    wanted = load_scene(scene, settings)
    if wanted.clip is None:
        raise SceneError(
            f"scene {wanted.name} has no [clip] that another could replace. Add one, or take a "
            "scene human-*."
        )
    folder = Path("runs") / f"{wanted.name}-clips" if out is None else Path(out)
    page = folder / PAGE
    if page.exists() and not is_own_page(page):
        raise RunFolderError(f"{page} was not made by flowborne; name another folder")
    make_folder(folder)
    batch = Batch(wanted.name, wanted.controlled_joints(), page, len(names), skipped)
    with displayed(progress) as show:
        job = _Batch(scene, settings, folder, {"workers": workers, "progress": show}, replace, film)
        for number, clip in enumerate(names, start=1):
            job.label = f"clip {number} of {len(names)}: {clip.name}"
            try:
                batch.clips.append(job.run(clip))
            except KeyboardInterrupt as stop:
                same = "the same command" + " without replace=True" * replace
                raise KeyboardInterrupt(f"stopped in {job.label}; {same} continues there") from stop
            write_page(batch)
    return batch


def _clips_in(folder: Path) -> tuple[list[Path], tuple[str, ...]]:
    """The clips of a folder and the names of all else in it. Raises RunFolderError without any."""
    if not folder.is_dir():
        what = f"{folder} is a file" if folder.exists() else f"there is no folder {folder}"
        raise RunFolderError(f"{what}; give a folder of BVH files")
    found = sorted(folder.iterdir())
    clips = [path for path in found if path.suffix.lower() == ENDING and path.is_file()]
    others = tuple(p.name + "/" * p.is_dir() for p in found if p not in clips)
    if not clips:
        has = f"only {listed(others)}" if others else "nothing"
        raise RunFolderError(f"{folder} has {has} and no BVH file; give a folder of clips")
    taken = {CAPTURED: "the clips as captured", PAGE: "the page"}
    for clip in clips:
        if (name := clip.stem.casefold()) in taken:
            raise RunFolderError(
                f"{clip} and {taken[name]} would both be written to {clip.stem}; rename the clip"
            )
        taken[name] = clip.name
    return clips, others


@dataclass
class _Batch:
    """What is the same for all clips; `label` says which one is run."""

    scene: str | Path
    settings: dict[str, str]
    out: Path
    options: dict[str, Any]
    replace: bool
    film: bool
    label: str = ""

    def run(self, clip: Path) -> ClipRun:
        """The runs of a clip, or why they failed."""
        done = ClipRun(clip, self.out / clip.stem)
        try:
            return self._run(done)
        except SceneError as error:
            failure = " ".join(error.problems)
        except RunFolderError as error:
            failure = str(error)
        except Exception as error:
            log.debug("the error", exc_info=error)
            failure = fault_of(error)
        return replace(done, failure=_named(failure, clip))

    def _run(self, done: ClipRun) -> ClipRun:
        clip = done.clip
        scene = load_scene(self.scene, self.settings | {"clip.file": str(clip.absolute())})
        scene, duration = _until_the_end(scene)
        joints, lacking = scene.controlled_joints(), _lacking(scene)
        notes: list[str] = []
        before, captured = None, None
        if lacking:
            notes.append(f"no effort as captured: {lacking}")
        else:
            captured = self.out / CAPTURED / clip.stem
            self._summary(_as_captured(scene), captured, ", as captured", film=False)
            before = _effort(captured, joints)
            notes += self._draw(RunFolder(captured))
        summary = self._summary(scene, done.folder, "", film=self.film)
        notes += summary["warnings"]
        notes += [note for note in summary["notes"] if note.startswith("[clip]")]
        return replace(
            done,
            captured=captured,
            doubts=tuple(summary["doubts"]),
            notes=tuple(_named(note, clip) for note in notes),
            frames=summary["frames"],
            time=summary["time_s"],
            duration=duration,
            before=before,
            after=_effort(done.folder, joints) if joints else None,
        )

    def _summary(self, scene: Scene, path: Path, which: str, *, film: bool) -> dict[str, Any]:
        """Summary of a complete run; it is begun or continued if it is not there.

        raises  RunFolderError with the message of a run that stopped
        """
        folder = RunFolder(path)
        begun = folder.is_run() and folder.scene.exists() and not self.replace
        drawn = not film or folder.film.exists() or missing_to_draw() is not None
        whole = begun and drawn and _is_whole(folder, scene)
        self._show(self.label + which + (": complete" if whole else ""), scene.time.frames)
        if whole:
            return folder.read_summary()
        result = run(
            scene,
            path,
            frames=scene.time.frames,
            resume=begun,
            replace=folder.is_run() and not begun,
            film=film,
            **self.options,
        )
        if result.outcome.name.lower() not in COMPLETE:
            raise RunFolderError(result.message)
        return result.summary

    def _draw(self, folder: RunFolder) -> list[str]:
        """Draw the picture of a run without a film; notes on why there is none."""
        if not self.film or missing_to_draw() is not None:
            return []
        drawn = folder.picture.exists() and folder.picture.stat().st_mtime
        if drawn >= folder.history.stat().st_mtime:
            return []
        from flowborne.view.film import make_picture

        try:
            make_picture(folder.path)
        except ValueError as error:
            return [f"no picture: {error}"]
        return []

    def _show(self, label: str, frames: int) -> None:
        if self.options["progress"] is not None:
            self.options["progress"](RunProgress("clip", 0, frames, 0.0, clip=label))


def _named(text: str, clip: Path) -> str:
    return text.replace(str(clip.absolute()), clip.name)


def _is_whole(folder: RunFolder, scene: Scene) -> bool:
    """Whether a run is complete. Raises RunFolderError if it is one of another scene."""
    summary = folder.read_summary()
    if summary["outcome"] not in COMPLETE or summary["frames"] != scene.time.frames:
        return False
    scene_to_resume(folder, scene)
    return True


def _until_the_end(scene: Scene) -> tuple[Scene, float]:
    """The scene with no more frames than its clip has, and the duration of the part used, s."""
    capture, table = capture_of(scene), scene.clip
    assert capture is not None
    assert table is not None
    end = capture.clip.duration if table.stop is None else min(capture.clip.duration, table.stop)
    whole = int((end - table.start) / scene.frame_time + 1e-6)
    frames = scene.time.frames if table.loop else min(scene.time.frames, max(whole, 1))
    return with_frames(scene, frames), capture.clip.duration


def _lacking(scene: Scene) -> str:
    """Why there is no run without a controller; "" if there is one."""
    capture = capture_of(scene)
    joints = [j for j in scene.controlled_joints() if capture and j not in capture.mapping]
    if joints:
        return f"the clip has no motion of {', '.join(joints)}"
    return "" if scene.control else "no joint is controlled"


def _as_captured(scene: Scene) -> Scene:
    """The scene without a controller: its joints follow the clip from its first pose."""
    capture, controlled = capture_of(scene), scene.controlled_joints()
    assert capture is not None
    assert scene.clip is not None
    joints = (*followers(scene, capture, load_model(scene)), *controlled)
    initial = {
        key: {j: value for j, value in getattr(scene.initial, key).items() if j not in controlled}
        for key in ("positions", "velocities")
    }
    changed: dict[str, Any] = {
        "clip": scene.clip.model_copy(update={"joints": joints}),
        "initial": scene.initial.model_copy(update=initial),
        "control": (),
        "objectives": (),
        "controller": ControllerTable(),
        "output": scene.output.model_copy(update={"joints": controlled, "exports": ()}),
    }
    if scene.human is not None and set(ELBOWS) & set(controlled):
        changed["human"] = scene.human.model_copy(update={"elbows": True})
    return scene.model_copy(update=changed).in_folder(scene.folder)


def _effort(folder: Path, joints: Sequence[str]) -> float:
    """Median over the frames of the norm of the drive torques (N m) and forces (N) of joints."""
    path = RunFolder(folder).history
    drives = {f"{kind}_{j}" for kind in ("torque", "force") for j in joints}
    drives |= {f"{drive}_{axis}" for drive in drives for axis in "xyz"}
    columns = [c for c in history_columns(path) if c.rpartition("_")[0] in drives]
    torques = np.array(list(read_history(path, columns).values()))
    return float(np.median(np.linalg.norm(torques, axis=0)))
