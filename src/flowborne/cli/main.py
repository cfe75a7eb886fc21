"""The command `flowborne`.

Exit codes: 1 if a run blew up or could not be written, 2 for wrong input, 3 for a complete run
with doubtful results and for `check --strict` with warnings, 130 after an interruption. Each error
is one message on stderr.
"""

from __future__ import annotations

import json
import logging
import os
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from functools import wraps
from importlib.metadata import entry_points
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from flowborne.base.errors import PartError, SceneError, fault_of
from flowborne.base.extras import check_drawing, missing_to_draw, optional
from flowborne.base.version import __version__
from flowborne.cli.console import (
    batch_lines,
    check_lines,
    complain,
    is_started,
    run_lines,
    sentence_of,
)
from flowborne.runs.run_folder import RunFolder, RunFolderError, cannot_write

log = logging.getLogger("flowborne")

FAILED, WRONG, WARNED, INTERRUPTED = 1, 2, 3, 130
"""Exit codes besides 0."""

BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Our solves are small: more threads in BLAS are slower, and their sums differ."""

ADDED = "flowborne.commands"
"""Group of the entry points that add commands."""

OF_VALIDATION = ("validate", "bench", "figures")
INSTALL_VALIDATION = "install it from a copy of the repository with: pip install ./validation"

FILE_KEYS = ("clip.file", "earlier.run", "solids.model")
"""Keys of scenes that name files or folders: paths in a command start from the current folder."""


class InputError(Exception):
    """The command line is wrong; the text says where and how to correct it."""


class StoppedError(Exception):
    """Ctrl-C, which typer would turn into an exit without a message; the text is the message."""


class _Commands(TyperGroup):
    """The commands, and those that other distributions add (see `_added`); an interruption of one
    is a StoppedError."""

    def list_commands(self, ctx: Any) -> list[str]:
        return [*super().list_commands(ctx), *(found.name for found in entry_points(group=ADDED))]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        return super().get_command(ctx, cmd_name) or _added(cmd_name)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as stop:
            raise StoppedError(str(stop)) from stop


app = typer.Typer(
    name="flowborne",
    cls=_Commands,
    help="Creatures that react to the fluid around them.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _added(name: str) -> Any:
    """The command of another distribution, None if there is none: an entry point of the group
    ADDED, a function with typer's annotations that raises ValueError for wrong input and OSError
    for what cannot be written.

    raises  InputError for a command of flowborne-validation where that is not installed
    """
    found = entry_points(group=ADDED, name=name)
    if not found:
        if name in OF_VALIDATION:
            raise InputError(f"{name} is a command of flowborne-validation; {INSTALL_VALIDATION}")
        return None
    run = found[name].load()

    @wraps(run)
    def command(**given: Any) -> None:
        try:
            run(**given)
        except ValueError as error:
            raise InputError(str(error)) from error
        except OSError as error:
            raise cannot_write(Path(error.filename or "."), error) from error

    one = typer.Typer(add_completion=False, rich_markup_mode=None)
    one.command(name)(command)
    return typer.main.get_command(one)


UsageError: type[Exception] = typer.BadParameter.__mro__[1]
"""What typer raises when the command line itself is wrong."""


def _set(help: str) -> Any:
    """An option --set, which may be repeated."""
    return typer.Option("--set", metavar="KEY=VALUE", help=help)


SceneArgument = Annotated[
    str, typer.Argument(metavar="SCENE", help="Name of a built-in scene, or a scene file.")
]
WorkersOption = Annotated[
    int | None, typer.Option(help="Trials of the controller at once; changes no number.")
]
PortOption = Annotated[int, typer.Option(min=1, max=65535, help="Port of the page.")]
HostOption = Annotated[str, typer.Option(help="0.0.0.0 lets other machines connect.")]
SceneOption = Annotated[list[str] | None, _set("Change a value of the scene.")]
FolderArgument = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of an earlier run.")]


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
    """Creatures that react to the fluid around them."""
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
    overrides = _overrides(settings)
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
        from flowborne.sim.running import RunOutcome
        from flowborne.sim.running import run as run_scene

        result = run_scene(loaded, folder, progress=progress, **given)
    if result.outcome is not RunOutcome.DONE:
        complain(result.message)
        raise typer.Exit(WARNED if result.outcome is RunOutcome.DOUBTFUL else FAILED)
    print(run_lines(result))


def _run_clips(
    scene: str, clips: Path, overrides: dict[str, str], out: Path | None, given: dict[str, Any]
) -> None:
    from flowborne.base.progress import ProgressDisplay
    from flowborne.studies.batches import run_clips

    _say_if_not_drawn(given["film"])
    with ProgressDisplay() as progress:
        batch = run_clips(scene, clips, out, overrides=overrides, progress=progress, **given)
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


@app.command()
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
    """Run a scene many times over its keys, or optimise them; the same command continues.

    See docs/studies.md.
    """
    from flowborne.base.progress import ProgressDisplay
    from flowborne.studies.running import Plan, study

    plan = Plan.of(file)
    print(plan, flush=True)
    if check:
        return
    with ProgressDisplay() as progress:
        try:
            result = study(plan, out, workers=workers, dask=dask, retry=retry, progress=progress)
        except KeyboardInterrupt as stop:
            raise StoppedError("interrupted; the same command continues the study") from stop
    for pair in plot or ():
        x, _, y = (part.strip() for part in pair.partition(","))
        with _writing(result.folder, ValueError):
            picture = result.folder / f"{y} over {x}.svg".replace("/", " per ")
            result.plot(x, y, picture)
        print(f"drawn: {picture}")
    print(f"written: {result.folder / 'result.parquet'}, {result.folder / 'index.html'}")
    for name, message in result.failed.items():
        complain(f"run {name} failed: {message}")
    if result.failed:
        complain(f"{len(result.failed)} of {len(result)} runs failed; --retry repeats them")
        raise typer.Exit(FAILED)


@app.command()
def check(
    scene: Annotated[str, typer.Argument(metavar="SCENE.toml", help="Scene file to check.")],
    settings: SceneOption = None,
    trust: Annotated[
        bool,
        typer.Option("--trust", help="Import the Python code that the scene names, as run does."),
    ] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="End with exit code 3 if there are warnings.")
    ] = False,
) -> None:
    """Describe the creature, list everything that is wrong or implausible in a scene, and say how
    the grid resolves its bodies.

    Bodies and fluid are started as in a run, on grids of up to 4 million cells. A warning does not
    stop a run; it names a suitable value.
    """
    from flowborne.scenes.load import load_scene
    from flowborne.scenes.warn import warnings_of

    loaded = load_scene(scene, _overrides(settings), trust=trust)
    with _compilation_shown():
        from flowborne.sim.simulation import Simulation

        with Simulation(loaded, workers=1) as simulation:
            setup = simulation.setup
            if is_started(setup):
                simulation.snapshot()
    found = warnings_of(loaded, setup)
    print(check_lines(loaded, setup, found))
    if strict and found:
        raise typer.Exit(WARNED)


@app.command()
def film(
    folder: FolderArgument,
    settings: Annotated[list[str] | None, _set("Change a value of [film]: camera.orbit=30")] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="film.mp4, film.webp, or frames.png for frames_0000.png and so on.",
            show_default="preview.png and preview.mp4 in DIR",
        ),
    ] = None,
) -> None:
    """Redraw the picture and the film of a run, as set in [film] of its scene."""
    files = RunFolder.existing(folder)
    check_drawing()
    from flowborne.base.progress import ProgressDisplay, RunProgress
    from flowborne.scenes.save import film_settings
    from flowborne.view.film import make_preview, write_shot
    from flowborne.view.shot import Shot

    shot = Shot.model_validate(film_settings(files, _overrides(settings)))
    drawn = f"{files.picture}, {files.film}"
    began = perf_counter()
    with _writing(folder if out is None else out, ValueError), ProgressDisplay() as display:

        def show(done: int, frames: int) -> None:
            display(RunProgress("film", done, frames, perf_counter() - began))

        if out is None:
            make_preview(files.path, show, shot)
        else:
            drawn = write_shot(files.path, out, show, shot)
    print(f"drawn: {drawn}")


@app.command()
def view(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of a run, which may still be running.")
    ],
    port: PortOption = 8080,
    host: HostOption = "127.0.0.1",
) -> None:
    """View a run in a browser; see docs/viewer.md."""
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
def play(
    scene: SceneArgument,
    settings: SceneOption = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder to record to.", show_default="runs/<scene name>-played"),
    ] = None,
    workers: WorkersOption = None,
    port: PortOption = 8080,
    host: HostOption = "127.0.0.1",
) -> None:
    """Run a scene live in a browser, and change winds, streams and objectives meanwhile; see
    docs/play.md.
    """
    optional("pyvista", "PyVista", "view", "views in a browser")
    from flowborne.play.viewer import open_play
    from flowborne.scenes.load import load_scene
    from flowborne.view.browser.viewer import serve

    loaded = load_scene(scene, _overrides(settings))
    folder = Path("runs") / f"{loaded.name}-played" if out is None else out
    with _compilation_shown():
        viewer = open_play(loaded, folder, host=host, port=port, workers=workers)
    print(f"playing {loaded.name} at http://{host}:{port}; Ctrl-C ends it", flush=True)
    with closing(viewer), suppress(KeyboardInterrupt):
        serve(viewer)


@app.command()
def export(
    folder: FolderArgument,
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="File to write; its ending selects the format.")
    ],
    settings: Annotated[list[str] | None, _set("A parameter of the exporter.")] = None,
) -> None:
    """Export a run for another program; docs/exporters.md lists the formats."""
    from flowborne.formats.exporting import export as export_run
    from flowborne.scenes.load import value_of

    parameters = {key: value_of(text) for key, text in _overrides(settings).items()}
    with _writing(out, PartError):
        written = export_run(folder, out, parameters)
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
) -> None:
    """Make a scene of a rigged character and its clip; see docs/import.md."""
    if not density > 0.0:
        raise InputError(f"--density is {density:g}; give kg/m^3 above 0")
    from flowborne.characters.folder import import_character

    with _writing(out):
        made = import_character(
            file, out, clip=clip, animations=animations, density=density, scale=scale, fill=fill
        )
    print(f"written: {made.scene}")
    for note in made.notes:
        print(f"  {note}")


@app.command()
def chains(
    model: Annotated[
        Path, typer.Argument(metavar="MODEL.xml", help="Model or part with <composite> cables.")
    ],
) -> None:
    """Write the cables of a model of MuJoCo 3 as chains of capsules, in a copy beside it."""
    from xml.etree.ElementTree import ParseError

    from flowborne.solids.cables import write_chains

    with _writing(model, ValueError, ParseError):
        made, notes = write_chains(model)
    print(f"written: {made}")
    for note in notes:
        print(f"  {note}")


@app.command()
def schema() -> None:
    """Print the JSON schema of a scene, by which editors complete its keys."""
    from flowborne.scenes.json_schema import json_schema

    print(json.dumps(json_schema(), indent=2))


@app.command()
def doctor() -> None:
    """Check that this machine has what flowborne needs, and say how to install what is missing."""
    from flowborne.sim.doctor import findings

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
        warnings.simplefilter("ignore")  # of libraries; errors have their own messages
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = app(given or ["--help"], prog_name="flowborne", standalone_mode=False)
    except UsageError as error:
        complain(f"{sentence_of(error)}; see flowborne --help")
        code = WRONG
    except (InputError, RunFolderError, SceneError) as error:
        for problem in getattr(error, "problems", [str(error)]):
            complain(problem)
        code = WRONG
    except (StoppedError, KeyboardInterrupt, typer.Abort) as stop:
        complain(str(stop) or "interrupted")
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


@contextmanager
def _writing(path: Path, *refused: type[Exception]) -> Iterator[None]:
    """Context that writes to `path`: names it if that fails; `refused` errors are of the input."""
    try:
        yield
    except refused as error:
        raise InputError(str(error)) from error
    except OSError as error:
        raise cannot_write(path, error) from error


@contextmanager
def _compilation_shown() -> Iterator[None]:
    """Context that shows how many kernels have been compiled."""
    from flowborne.base.progress import ProgressDisplay, RunProgress

    began = perf_counter()
    with ProgressDisplay() as display:
        from flowborne.kernels.jit import compilation_watched

        def show(kernels: int) -> None:
            display(RunProgress("compiling", 0, 0, perf_counter() - began, kernels))

        with compilation_watched(show):
            yield


def _overrides(settings: list[str] | None) -> dict[str, str]:
    """Values of --set by key. Files are found from the current folder, then the scene's folder.

    raises  InputError when one has no key or no '='
    """
    overrides = {}
    for setting in settings or ():
        key, equals, value = setting.partition("=")
        if not equals or not key.strip():
            raise InputError(f"--set {setting} has no KEY=VALUE; write for example fluid.density=1")
        key, value = key.strip(), value.strip()
        if key in FILE_KEYS and os.path.exists(value):  # also False for text that is no path
            value = str(Path(value).absolute())
        overrides[key] = value
    return overrides
