"""The public face for autodoc: the parts of docs/api.md and of the pages in docs/api."""

from __future__ import annotations

import inspect
from importlib import import_module

import flowborne
from markdown_text import table

FIRST = "Simulation"
"""What stands before everything else."""

DIRECTIVE = """```{{eval-rst}}
.. auto{kind}:: {module}.{name}
{members}```
"""


def modules() -> str:
    """The public modules, each with what its docstring says first."""
    rows = []
    for name in ("flowborne", *(f"flowborne.{name}" for name in flowborne.PAGES)):
        said = (import_module(name).__doc__ or "").splitlines()[0]
        rows.append([f"[`{name}`](api/{name}.md)", said])
    return table(("module", "what it has"), rows)


def page(name: str) -> str:
    """What a public module has: Simulation first, then functions, then classes."""
    module = import_module(name)
    things = {key: getattr(module, key) for key in module.__all__}
    mine = {key: thing for key, thing in things.items() if documented(thing)}
    here = {key: thing for key, thing in mine.items() if home(thing) == name}
    order = sorted(here, key=lambda key: (key != FIRST, inspect.isclass(here[key])))
    text = [inspect.cleandoc(module.__doc__ or "").splitlines()[0] + "\n"]
    text += [directive(name, key, here[key]) for key in order]
    elsewhere = [f"[`{key}`](#{home(mine[key])}.{key})" for key in mine if key not in here]
    if elsewhere:
        text.append(f"Also here: {', '.join(elsewhere)}.\n")
    return "\n".join(text)


def directive(module: str, name: str, thing: object) -> str:
    """The directive that documents a thing."""
    if not inspect.isclass(thing):
        return DIRECTIVE.format(kind="function", module=module, name=name, members="")
    members = "   :members:\n"
    if name == "OpenRun":  # what it has comes from a class that is not public
        members += "   :inherited-members: object\n"
    return DIRECTIVE.format(kind="class", module=module, name=name, members=members)


def home(thing: object) -> str:
    """The first public module that has a thing."""
    names = ("flowborne", *(f"flowborne.{name}" for name in flowborne.PAGES))
    return next(
        name
        for name in names
        if any(getattr(import_module(name), key) is thing for key in import_module(name).__all__)
    )


def documented(thing: object) -> bool:
    """Whether it is a class or a function of flowborne's own."""
    return callable(thing) and getattr(thing, "__module__", "").startswith("flowborne")
