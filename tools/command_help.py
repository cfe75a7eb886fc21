"""What `flowborne --help` says of every command: the middle of docs/commands.md."""

from __future__ import annotations

from typing import Any

import typer

from flowborne.cli.main import app
from markdown_text import plain, table


def page() -> str:
    """A section for each command: what it does, its arguments and options."""
    group: Any = typer.main.get_command(app)
    text = []
    for name, command in group.commands.items():
        arguments = [one for one in command.params if one.param_type_name == "argument"]
        usage = " ".join(["flowborne", name, *(one.metavar or one.name for one in arguments)])
        rows = [
            [", ".join(f"`{o}`" for o in (*one.opts, *one.secondary_opts)), plain(one.help or "")]
            for one in command.params
            if one.param_type_name == "option"
        ]
        text += [f"## `{usage}`", plain(command.help or "")]
        text += [table(["option", "what it does"], rows)] if rows else []
    return "\n\n".join(text)
