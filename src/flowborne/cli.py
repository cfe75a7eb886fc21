"""The command `flowborne`.

Whatever is wrong with the input is one message on stderr and exit code 2; a run that blew up or
could not be written ends with 1, one that was interrupted with 130. A run that is complete but not
to be trusted, and `check --strict` where there are warnings, end with 3.
"""

from __future__ import annotations

import json
import logging
import os
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress
from difflib import get_close_matches
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from flowborne.console import (
    check_lines,
    complain,
    fault_of,
    result_printer,
    run_lines,
    sentence_of,
)
from flowborne.errors import PartError, SceneError
from flowborne.extras import check_drawing, missing_to_draw, optional
from flowborne.runs.run_folder import RunFolder, RunFolderError, cannot_write, make_folder
from flowborne.version import __version__

log = logging.getLogger("flowborne")

FAILED, WRONG, WARNED, INTERRUPTED = 1, 2, 3, 130
"""Exit codes besides 0."""

BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Our solves are small: more threads in BLAS are slower, and their sums differ."""

FILE_KEYS = ("clip.file", "earlier.run", "solids.model")
"""Keys of scenes that name files or folders: a path in a command starts from where one is."""


class StoppedError(Exception):
    """Ctrl-C, which typer would end without a message; the text says what is left."""


class _Commands(TyperGroup):
    """The commands; an interruption of one is a StoppedError."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as stop:
            raise StoppedError(str(stop) or "interrupted") from stop


app = typer.Typer(
    name="flowborne",
    cls=_Commands,
    help="Creatures that answer the fluid around them.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

UsageError: type[Exception] = typer.BadParameter.__mro__[1]
"""What typer raises when the command line itself is wrong."""


class InputError(Exception):
    """Something on the command line is wrong; the text says what and how to mend it."""


SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="Name of a built-in scene, or a scene file.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print a list of objects and no more.")]


def _version(wanted: bool) -> None:
    if wanted:
        print(__version__)
        raise typer.Exit


@app.callback()
def flowborne(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of an error as well.")
    ] = False,
) -> None:
    """Creatures that answer the fluid around them."""
    if debug:
        log.setLevel(logging.DEBUG)
        log.addHandler(logging.StreamHandler())


@app.command()
def scenes() -> None:
    """List the built-in scenes."""
    from flowborne.scenes.load import find, read_scene, scene_names

    listed = [read_scene(find(name)) for name in scene_names()]
    rows = [(scene.name, scene.figure, scene.description) for scene in listed]
    widths = [max((len(row[n]) for row in rows), default=0) for n in range(2)]
    for name, figure, description in rows:
        print(f"{name:<{widths[0]}}  {figure:<{widths[1]}}  {description}".rstrip())


@app.command()
def run(
    scene: SceneArgument,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write.", show_default="runs/<scene name>")
    ] = None,
    frames: Annotated[
        int | None, typer.Option(help="How many frames.", show_default="what the scene says")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change a value of the scene."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Trials of the controller at once; changes no number.")
    ] = None,
    resume: Annotated[bool, typer.Option(help="Go on from the checkpoint in the folder.")] = False,
    replace: Annotated[bool, typer.Option(help="Replace an earlier run in the folder.")] = False,
    film: Annotated[bool, typer.Option(help="Draw preview.png and preview.mp4.")] = True,
) -> None:
    """Run a scene and leave numbers and a film in a folder."""
    for name, count in (("--frames", frames), ("--workers", workers)):
        if count is not None and count < 1:
            raise InputError(f"{name} is {count}; give a whole number of 1 or more")
    from flowborne.progress import ProgressDisplay
    from flowborne.scenes.load import load_scene

    loaded = load_scene(scene, _overrides(settings or []))
    folder = Path("runs") / loaded.name if out is None else out
    missing = missing_to_draw() if film else None
    if missing is not None:
        print(f"no film will be drawn: {missing}", flush=True)
    with ProgressDisplay() as progress:
        from flowborne.running import RunInterrupted, RunOutcome
        from flowborne.running import run as run_scene

        try:
            result = run_scene(
                loaded,
                folder,
                frames=frames,
                workers=workers,
                resume=resume,
                replace=replace,
                film=film,
                progress=progress,
            )
        except RunInterrupted as stopped:
            progress.say(f"flowborne: {stopped}")
            raise typer.Exit(INTERRUPTED) from stopped
    if result.outcome is not RunOutcome.DONE:
        complain(result.message)
        raise typer.Exit(WARNED if result.outcome is RunOutcome.DOUBTFUL else FAILED)
    print(run_lines(result))


@app.command()
def check(
    scene: Annotated[str, typer.Argument(metavar="SCENE.toml", help="Scene file to look through.")],
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Change a value of the scene."),
    ] = None,
    trust: Annotated[
        bool, typer.Option("--trust", help="Import the Python that the scene names, as run does.")
    ] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="End with exit code 3 if there are warnings.")
    ] = False,
) -> None:
    """Say what the creature is to the fluid, everything that is wrong with a scene, what is
    implausible, and how the fluid meets its bodies.

    Bodies and fluid are set going, as in a run. A warning does not stop a run; it names a value
    that will do.
    """
    from flowborne.progress import ProgressDisplay, RunProgress
    from flowborne.scenes.load import load_scene
    from flowborne.scenes.warn import warnings_of

    loaded = load_scene(scene, _overrides(settings or []), trust=trust)
    began = perf_counter()
    with ProgressDisplay() as progress:
        from flowborne.kernels.compilation import compilation_watched
        from flowborne.simulation import Simulation

        def tell(kernels: int) -> None:
            progress(RunProgress("compiling", 0, 0, perf_counter() - began, kernels))

        with compilation_watched(tell), Simulation(loaded, workers=1) as simulation:
            setup = simulation.world.setup
    found = warnings_of(loaded, setup)
    print(check_lines(loaded, setup, found))
    if strict and found:
        raise typer.Exit(WARNED)


@app.command()
def film(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of an earlier run.")],
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="Change a value of [film]: camera.orbit=30"
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="film.mp4, film.webp, or frames.png for frames_0000.png and so on.",
            show_default="preview.png and preview.mp4 in DIR",
        ),
    ] = None,
) -> None:
    """Draw the picture and the film of a run again, as the table [film] of its scene says."""
    files = RunFolder.existing(folder)
    check_drawing()
    from flowborne.progress import ProgressDisplay, RunProgress
    from flowborne.scenes.scene_copy import film_settings
    from flowborne.view.film import make_preview, write_shot
    from flowborne.view.shot import Shot

    shot = Shot.of(film_settings(files, _overrides(settings or [])))
    drawn = f"{folder / 'preview.png'}, {folder / 'preview.mp4'}"
    began = perf_counter()
    try:
        with ProgressDisplay() as display:

            def tell(done: int, frames: int) -> None:
                display(RunProgress("film", done, frames, perf_counter() - began))

            if out is None:
                make_preview(files.path, tell, shot)
            else:
                drawn = write_shot(files.path, out, tell, shot)
    except ValueError as error:
        raise InputError(str(error)) from error
    except OSError as error:
        raise cannot_write(folder if out is None else out, error) from error
    print(f"drawn: {drawn}")


@app.command()
def view(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of a run, which may still go on.")
    ],
    port: Annotated[int, typer.Option(min=1, max=65535, help="Where the page is served.")] = 8080,
    host: Annotated[str, typer.Option(help="0.0.0.0 lets other machines look, too.")] = "127.0.0.1",
) -> None:
    """Look at a run in a browser; docs/viewer.md says what can be seen."""
    optional("pyvista", "PyVista", "view", "views in a browser")
    from flowborne.view.browser.viewer import open_viewer, serve

    try:
        viewer = open_viewer(folder, host, port)
    except ValueError as error:
        raise InputError(str(error)) from error
    print(f"viewing {folder} at http://{host}:{port}; Ctrl-C ends it", flush=True)
    with suppress(KeyboardInterrupt):
        serve(viewer)


@app.command()
def export(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of an earlier run.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="File to write; its ending says what.")],
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="A parameter of the exporter."),
    ] = None,
) -> None:
    """Write a run for another program; docs/exporters.md says what the endings stand for."""
    from flowborne.exporting import export as export_run
    from flowborne.scenes.load import value_of

    parameters = {key: value_of(text) for key, text in _overrides(settings or []).items()}
    try:
        written = export_run(folder, out, parameters)
    except PartError as error:
        raise InputError(str(error)) from error
    except OSError as error:
        raise cannot_write(out, error) from error
    first, last = written.files[0], written.files[-1]
    print(f"written: {first}" if first == last else f"written: {first} to {last}")
    if written.note:
        print(f"  {written.note}")


@app.command("import")
def import_(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Rigged character: .glb, .gltf, .usd.")
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder to write.")],
    clip: Annotated[
        str | None, typer.Option(help="Name of the clip.", show_default="the only one")
    ] = None,
    animations: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="File that has the clip.", show_default="that of the character"
        ),
    ] = None,
    density: Annotated[float, typer.Option(help="Of the body, kg/m^3.")] = 1000.0,
    scale: Annotated[
        float, typer.Option(help="Larger by: 0.01 where the file is in centimetres.")
    ] = 1.0,
    fill: Annotated[
        bool, typer.Option("--fill", help="Close holes of any size, and not only small ones.")
    ] = False,
) -> None:
    """Make a scene of a rigged character and its clip; docs/import.md says what becomes of it."""
    if not density > 0.0:
        raise InputError(f"--density is {density:g}; give kg/m^3 above 0")
    from flowborne.characters.folder import import_character

    try:
        made = import_character(
            file, out, clip=clip, animations=animations, density=density, scale=scale, fill=fill
        )
    except OSError as error:
        raise cannot_write(out, error) from error
    print(f"written: {made.scene}")
    for note in made.notes:
        print(f"  {note}")


@app.command()
def validate(
    case: Annotated[
        list[str] | None, typer.Option(metavar="ID", help="Only this case; may be repeated.")
    ] = None,
    tier: Annotated[
        str,
        typer.Option(metavar="TIER", help="minute, half-hour or all: how long it may take."),
    ] = "minute",
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Folder of a report that the cases are put into; what it has is not run again.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare with analytic and published cases."""
    from flowborne.validation import Tier, case_ids
    from flowborne.validation.running import run_cases

    ids = _known(case or [], case_ids(), "case", "--case")
    (wanted,) = _known([tier], tuple(Tier), "tier", "--tier")
    show = None if as_json else result_printer("id", "reference", "tolerance")
    if report is not None:
        make_folder(report)
    try:
        results = run_cases(ids or None, Tier(wanted), on_result=show, report=report)
    except ValueError as error:
        raise InputError(str(error)) from error
    except OSError as error:
        raise cannot_write(report or Path(), error) from error
    except KeyboardInterrupt as stopped:
        kept = "" if report is None else f"; {report} has what is done, the same command goes on"
        complain(f"interrupted{kept}")
        raise typer.Exit(INTERRUPTED) from stopped
    _report(results, as_json)


@app.command()
def bench(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Only these benches.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure how fast it is."""
    from flowborne.bench import bench_names, run_benches

    chosen = _known(names or [], bench_names(), "bench", "NAME")
    show = None if as_json else result_printer("name", "target")
    _report(run_benches(chosen or None, on_result=show), as_json)


@app.command()
def figures(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME]...", help="Which; all when none is named.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder to write.")] = Path("figures"),
) -> None:
    """Our numbers for Figures 2, 7, 9b, 10 and 11 of the paper, as tables and pictures."""
    from flowborne.extras import check_drawing
    from flowborne.simulation import BlowUpError

    check_drawing()
    from flowborne.validation.figures import figure_names, make_figures

    chosen = _known(names or [], figure_names(), "figure", "NAME")
    make_folder(out)
    try:
        make_figures(out, chosen or None)
    except (ArithmeticError, BlowUpError, OSError, ValueError) as error:
        complain(str(error))
        raise typer.Exit(FAILED) from error
    print(f"written: {', '.join(str(path) for path in sorted(out.glob('figure-*')))}")


@app.command()
def doctor() -> None:
    """Try what flowborne needs of this machine, and say how to mend what is missing."""
    from flowborne.doctor import findings

    missing = 0
    for finding in findings():
        print(finding.line(), flush=True)
        missing += finding.missing
    if missing:
        raise typer.Exit(FAILED)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line, then leave with its exit code."""
    for name in BLAS_THREADS:
        os.environ[name] = "1"
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # of libraries; what is wrong is said in one message
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = app(given or ["--help"], prog_name="flowborne", standalone_mode=False)
    except UsageError as error:
        complain(f"{sentence_of(error)}; see flowborne --help")
        code = WRONG
    except SceneError as error:
        for problem in error.problems:
            complain(problem)
        code = WRONG
    except (InputError, RunFolderError) as error:
        complain(str(error))
        code = WRONG
    except StoppedError as stop:
        complain(str(stop))
        code = INTERRUPTED
    except (KeyboardInterrupt, typer.Abort):
        complain("interrupted")
        code = INTERRUPTED
    except MemoryError as error:
        complain(
            f"the memory of this machine is full ({error}). Make the grid coarser by [domain] "
            "resolution or cells, or the files smaller"
        )
        code = WRONG
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = FAILED
    except Exception as error:
        log.debug("the error", exc_info=error)
        complain(fault_of(error))
        code = FAILED
    sys.exit(code if isinstance(code, int) else 0)


def _overrides(settings: list[str]) -> dict[str, str]:
    """What --set says; files are found from here first, then from the scene's folder.

    raises  InputError when one has no key or no '='
    """
    overrides = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals or not key.strip():
            raise InputError(f"--set {setting} has no KEY=VALUE; write for example fluid.density=1")
        key, value = key.strip(), value.strip()
        if key in FILE_KEYS and os.path.exists(value):  # False for what is no path, too
            value = str(Path(value).absolute())
        overrides[key] = value
    return overrides


def _known(asked: list[str], known: Sequence[str], kind: str, option: str) -> list[str]:
    """What was asked for. Raises InputError when one of them does not exist."""
    for name in asked:
        if name not in known:
            near = get_close_matches(name, known, n=1, cutoff=0.4)
            guess = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}"
            raise InputError(f"{option} {name}: there is no such {kind}; {guess}")
    return asked


def _report(results: Sequence[Any], as_json: bool) -> None:
    """Print all results as JSON when asked to; leave with 1 when one has failed."""
    if as_json:
        print(json.dumps([result.as_dict() for result in results], indent=2))
    if any(result.verdict == "fail" for result in results):
        raise typer.Exit(FAILED)
