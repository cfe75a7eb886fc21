"""The public face, page after page, for autodoc: the middle of docs/api.md."""

from __future__ import annotations

from importlib import import_module

import flowborne

MODULES = (flowborne, *(import_module(f"flowborne.{name}") for name in flowborne.PAGES))

PAGE = """## `{name}`

```{{eval-rst}}
.. automodule:: {name}
   :members: {members}
   :imported-members:
```
"""

ALONE = {
    "scenes": ".. autofunction:: flowborne.scenes",
    "view": ".. autofunction:: flowborne.view",
    "OpenRun": ".. autoclass:: flowborne.OpenRun\n   :members:\n   :inherited-members: object",
}
"""Directives of what is documented by itself: packages that are called, and a class with members
of the one above it."""


def page() -> str:
    """A section for each public module; what several have is told in the first."""
    text: list[str] = []
    told: dict[int, str] = {}
    for module in MODULES:
        things = {name: getattr(module, name) for name in module.__all__}
        here = [n for n, one in things.items() if documented(one) and id(one) not in told]
        elsewhere = [(n, told[id(one)]) for n, one in things.items() if id(one) in told]
        told.update({id(things[name]): module.__name__ for name in here})
        members = ", ".join(name for name in here if name not in ALONE)
        text.append(PAGE.format(name=module.__name__, members=members))
        text += [f"```{{eval-rst}}\n{ALONE[name]}\n```\n" for name in here if name in ALONE]
        if elsewhere:
            said = ", ".join(f"`{name}` (see `{where}`)" for name, where in elsewhere)
            text.append(f"Also here: {said}.\n")
    return "\n".join(text)


def documented(thing: object) -> bool:
    """Whether it is a class or a function of flowborne's own."""
    return callable(thing) and getattr(thing, "__module__", "").startswith("flowborne")
