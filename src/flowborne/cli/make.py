"""Commands that make something: runs, studies, and scenes of characters from other programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from flowborne.base.extras import missing_to_draw
from flowborne.cli.app import (
    FAILED,
    MAKE,
    WARNED,
    InputError,
    SceneArgument,
    SceneOption,
    StoppedError,
    WorkersOption,
    command,
    overrides_of,
    writing,
)
from flowborne.cli.console import batch_lines, complain, run_lines


@command(MAKE, "flowborne scenes")
def scenes() -> None:
    """List the built-in scenes."""
    from flowborne.scenes.listing import scenes

    print(scenes())


@command(MAKE, "flowborne run eel --out runs/eel --set constants.amplitude=40")
def run(
    scene: SceneArgument,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to write.", show_default="runs/<scene name>, of clips <scene name>-clips"
        ),
    ] = None,
    frames: Annotated[
        int | None, typer.Option(help="Number of frames.", show_default="from the scene")
    ] = None,
    settings: SceneOption = None,
    workers: WorkersOption = None,
    resume: Annotated[
        bool, typer.Option(help="Continue from the checkpoint in the folder.")
    ] = False,
    replace: Annotated[bool, typer.Option(help="Replace an earlier run in the folder.")] = False,
    film: Annotated[bool, typer.Option(help="Draw preview.png and preview.mp4.")] = True,
    clips: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Run each BVH clip of this folder, and write a page with the effort of each. "
            "The same command continues after a stop.",
        ),
    ] = None,
) -> None:
    """Run a scene and write its numbers and a film to a folder."""
    overrides = overrides_of(settings)
    given: dict[str, Any] = {"workers": workers, "replace": replace, "film": film}
    if clips is None:
        _run_one(scene, overrides, out, given | {"frames": frames, "resume": resume})
        return
    if resume and replace:
        raise InputError("--resume and --replace exclude each other; give one of them")
    if frames is not None:
        overrides["time.frames"] = str(frames)
    _run_clips(scene, clips, overrides, out, given)


def _run_one(
    scene: str, overrides: dict[str, str], out: Path | None, given: dict[str, Any]
) -> None:
    from flowborne.base.progress import ProgressDisplay
    from flowborne.scenes.load import load_scene

    loaded = load_scene(scene, overrides)
    folder = Path("runs") / loaded.name if out is None else out
    _say_if_not_drawn(given["film"])
    with ProgressDisplay() as progress:
        from flowborne.sim.endings import RunOutcome
        from flowborne.sim.running import run as run_scene

        result = run_scene(loaded, folder, progress=progress, **given)
    if result.outcome is not RunOutcome.DONE:
        complain(result.message)
        raise typer.Exit(WARNED if result.outcome is RunOutcome.DOUBTFUL else FAILED)
    print(run_lines(result, film=given["film"]))


def _run_clips(
    scene: str, clips: Path, overrides: dict[str, str], out: Path | None, given: dict[str, Any]
) -> None:
    from flowborne.studies.batches import run_clips

    _say_if_not_drawn(given["film"])
    batch = run_clips(scene, clips, out, overrides=overrides, progress=True, **given)
    print("\n".join(batch_lines(batch)))
    failed = [done for done in batch.clips if done.failure]
    for done in failed:
        complain(f"{done.clip.name}: {done.failure}")
    if failed or any(done.doubts for done in batch.clips):
        raise typer.Exit(FAILED if failed else WARNED)


def _say_if_not_drawn(film: bool) -> None:
    missing = missing_to_draw() if film else None
    if missing is not None:
        print(f"no film will be drawn: {missing}", flush=True)


@command(MAKE, "flowborne study gait.toml --workers 4")
def study(
    file: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="File of the study.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder to write.", show_default="studies/<study name>")
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(help="Runs at once; changes no number.", show_default="one per core"),
    ] = None,
    dask: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Scheduler of a Dask cluster to run on.")
    ] = None,
    retry: Annotated[bool, typer.Option("--retry", help="Repeat runs that failed.")] = False,
    check: Annotated[
        bool, typer.Option("--check", help="Only check the study, and say how many runs it has.")
    ] = False,
    plot: Annotated[
        list[str] | None,
        typer.Option(metavar="X,Y", help="Plot column Y against X too; may be repeated."),
    ] = None,
) -> None:
    """Run a scene many times over its keys, or optimise them; the same command continues."""
    from flowborne.studies.running import Plan, study

    plan = Plan.of(file)
    print(plan, flush=True)
    if check:
        return
    try:
        result = study(plan, out, workers=workers, dask=dask, retry=retry, progress=True)
    except KeyboardInterrupt as stop:
        raise StoppedError("interrupted; the same command continues the study") from stop
    for pair in plot or ():
        x, _, y = (part.strip() for part in pair.partition(","))
        with writing(result.folder, ValueError):
            picture = result.folder / f"{y} over {x}.svg".replace("/", " per ")
            result.plot(x, y, picture)
        print(f"drawn: {picture}")
    print(f"written: {result.folder / 'result.parquet'}, {result.folder / 'index.html'}")
    for name, message in result.failed.items():
        complain(f"run {name} failed: {message}")
    if result.failed:
        complain(f"{len(result.failed)} of {len(result)} runs failed; --retry repeats them")
        raise typer.Exit(FAILED)


@command(MAKE, "flowborne import whale.glb --clip Swim --out whale", "import")
def import_(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Rigged character: .glb, .gltf, .fbx, .usd.")
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write.")],
    clip: Annotated[
        str | None, typer.Option(help="Name of the clip.", show_default="the only one")
    ] = None,
    animations: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="File with the clip.", show_default="file of the character"
        ),
    ] = None,
    density: Annotated[float, typer.Option(help="Of the body, kg/m^3.")] = 1000.0,
    scale: Annotated[
        float, typer.Option(help="Scale factor: 0.01 for a file in centimetres.")
    ] = 1.0,
    fill: Annotated[
        bool, typer.Option("--fill", help="Close holes of any size, not only small ones.")
    ] = False,
    flesh: Annotated[
        list[str] | None,
        typer.Option(metavar="JOINT", help="Joint whose body is flesh; may be repeated."),
    ] = None,
) -> None:
    """Make a scene of a rigged character and its clip."""
    if not density > 0.0:
        raise InputError(f"--density is {density:g}; give kg/m^3 above 0")
    from flowborne.characters.folder import import_character

    with writing(out):
        made = import_character(
            file,
            out,
            clip=clip,
            animations=animations,
            density=density,
            scale=scale,
            fill=fill,
            flesh=flesh or (),
        )
    print(f"written: {made.scene}")
    for note in made.notes:
        print(f"  {note}")


@command(MAKE, "flowborne chains rope.xml")
def chains(
    model: Annotated[
        Path, typer.Argument(metavar="MODEL.xml", help="Model or part with <composite> cables.")
    ],
) -> None:
    """Write the cables of a model of MuJoCo 3 as chains of capsules, in a copy beside it."""
    from xml.etree.ElementTree import ParseError

    from flowborne.solids.cables import write_chains

    with writing(model, ValueError, ParseError):
        made, notes = write_chains(model)
    print(f"written: {made}")
    for note in notes:
        print(f"  {note}")


@command(MAKE, "flowborne schema > scene.schema.json")
def schema() -> None:
    """Print the JSON schema of a scene, by which editors complete its keys."""
    from flowborne.scenes.json_schema import json_schema

    print(json.dumps(json_schema(), indent=2))
