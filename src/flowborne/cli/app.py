"""The program `flowborne`: its groups of commands, what they have in common, and its errors."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from importlib.metadata import entry_points
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from flowborne.base.phrases import suggestion
from flowborne.base.version import __version__
from flowborne.runs.run_folder import RunFolder, cannot_write

log = logging.getLogger("flowborne")

FAILED, WRONG, WARNED, INTERRUPTED = 1, 2, 3, 130
"""Exit codes besides 0."""

MAKE, LOOK, TAKE_AWAY, TRUST, ADDED = GROUPS = (
    "Make",
    "Look",
    "Take away",
    "Trust",
    "From other packages",
)
"""Headings under which the help lists the commands."""

ENTRY_POINTS = "flowborne.commands"
"""Group of the entry points that add commands."""

OF_VALIDATION = ("validate", "bench", "figures")
INSTALL_VALIDATION = "install it from a copy of the repository with: pip install ./validation"

FILE_KEYS = ("clip.file", "earlier.run", "solids.model")
"""Keys of scenes that name files or folders: paths in a command start from the current folder."""

LONGEST_HELP = 1000
"""Letters of a command's first sentence, which the help prints whole."""

EXAMPLE = """\b
Example:
  flowborne scenes
  flowborne run ns-block-drag-max
  flowborne view runs/ns-block-drag-max
"""


class InputError(Exception):
    """The command line is wrong; the text says where and how to correct it."""


class StoppedError(Exception):
    """Ctrl-C, which typer would turn into an exit without a message; the text is the message."""


class _Commands(TyperGroup):
    """The commands, and those that other distributions add (see `_added`); an interruption of one
    is a StoppedError."""

    def list_commands(self, ctx: Any) -> list[str]:
        added = entry_points(group=ENTRY_POINTS)
        return [*super().list_commands(ctx), *(found.name for found in added)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        return super().get_command(ctx, cmd_name) or _added(cmd_name)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if self.get_command(ctx, args[0]) is None:
            end = suggestion(args[0], self.list_commands(ctx), "The commands are")
            raise InputError(f"there is no command '{args[0]}'{end}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        found = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        for group in GROUPS:
            here = [(name, one) for name, one in found if one.rich_help_panel == group]
            if here:
                with formatter.section(group):
                    rows = [(name, one.get_short_help_str(LONGEST_HELP)) for name, one in here]
                    formatter.write_dl(rows)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as stop:
            raise StoppedError(str(stop)) from stop


app = typer.Typer(
    name="flowborne",
    cls=_Commands,
    help="Creatures that react to the fluid around them.",
    epilog=EXAMPLE,
    add_completion=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def command(group: str, example: str, name: str | None = None) -> Callable[[Any], Any]:
    """Decorator that makes a function with typer's annotations a command.

    group    of GROUPS
    example  command line, at the end of its help
    name     that of the function by default
    """
    return app.command(name, rich_help_panel=group, epilog=f"\b\nExample:\n  {example}")


def _added(name: str) -> Any:
    """The command of another distribution, None if there is none: an entry point of the group
    ENTRY_POINTS, a function with typer's annotations that raises ValueError for wrong input and
    OSError for what cannot be written.

    raises  InputError for a command of flowborne-validation where that is not installed
    """
    found = entry_points(group=ENTRY_POINTS, name=name)
    if not found:
        if name in OF_VALIDATION:
            raise InputError(f"{name} is a command of flowborne-validation; {INSTALL_VALIDATION}")
        return None
    run = found[name].load()

    @wraps(run)
    def guarded(**given: Any) -> None:
        with writing(None, ValueError):
            run(**given)

    one = typer.Typer(add_completion=False, rich_markup_mode=None)
    one.command(name, rich_help_panel=TRUST if name in OF_VALIDATION else ADDED)(guarded)
    return typer.main.get_command(one)


def _ran(folder: Path) -> Path:
    """The folder as it is. Raises InputError for a scene, which has to run first."""
    from flowborne.scenes.load import BUILT_IN

    if not (folder.suffix == ".toml" and os.path.isfile(folder)) and (
        str(folder) not in BUILT_IN or folder.exists()
    ):
        return folder
    made = RunFolder(Path("runs") / folder.stem)
    remedy = f"give {made.path}" if made.is_run() else f"run it first: flowborne run {folder}"
    raise InputError(f"{folder} is a scene, not the folder of a run; {remedy}")


def set_option(help: str) -> Any:
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
SceneOption = Annotated[list[str] | None, set_option("Change a value of the scene.")]
FolderArgument = Annotated[
    Path,
    typer.Argument(
        metavar="DIR", help="Folder of a run, which may still be running.", callback=_ran
    ),
]


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


@contextmanager
def writing(path: Path | None, *refused: type[Exception]) -> Iterator[None]:
    """Context that writes to `path`, by default to what the error names: says so if that fails;
    `refused` errors are of the input."""
    try:
        yield
    except refused as error:
        raise InputError(str(error)) from error
    except OSError as error:
        raise cannot_write(path or Path(error.filename or "."), error) from error


@contextmanager
def compilation_shown() -> Iterator[None]:
    """Context that shows how many kernels have been compiled."""
    from flowborne.base.progress import ProgressDisplay, RunProgress

    began = perf_counter()
    with ProgressDisplay() as display:
        from flowborne.kernels.jit import compilation_watched

        def show(kernels: int) -> None:
            display(RunProgress("compiling", 0, 0, perf_counter() - began, kernels))

        with compilation_watched(show):
            yield


def overrides_of(settings: list[str] | None) -> dict[str, str]:
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
