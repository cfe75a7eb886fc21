"""Commands that say what to trust: a scene before it runs, and this machine."""

from __future__ import annotations

from typing import Annotated

import typer

from flowborne.cli.app import (
    FAILED,
    TRUST,
    WARNED,
    SceneArgument,
    SceneOption,
    command,
    compilation_shown,
    overrides_of,
)


@command(TRUST, "flowborne check fish.toml --set domain.resolution=64")
def check(
    scene: SceneArgument,
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

    loaded = load_scene(scene, overrides_of(settings), trust=trust)
    with compilation_shown():
        from flowborne.sim.checked import check as checked

        found = checked(loaded)
    print(found)
    if strict and found.warnings:
        raise typer.Exit(WARNED)


@command(TRUST, "flowborne doctor")
def doctor() -> None:
    """Check that this machine has what flowborne needs, and say how to install what is missing."""
    from flowborne.sim.doctor import findings

    missing = 0
    for finding in findings():
        print(finding.line(), flush=True)
        missing += finding.missing
    if missing:
        raise typer.Exit(FAILED)
