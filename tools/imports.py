"""Draws who imports whom: `make imports` writes docs/imports.md.

A room is a folder of src/flowborne, or a module that lies beside them. Imports for types alone and
those inside functions count as well.
"""

from __future__ import annotations

from graphlib import TopologicalSorter
from pathlib import Path

from grimp import build_graph

PACKAGE = "flowborne"
PAGE = Path(__file__).parents[1] / "docs" / "imports.md"

HEADING = """# Who imports whom

Rooms of `src/flowborne` (angular) and the modules beside them (round). Arrows lead from what
imports to what is imported; an arrow is left out where others lead there by way of a third, and
the table has them all. There is no circle. Made by `make imports`.
"""

Imports = dict[str, set[str]]
"""Name -> names that it imports."""


def of_modules() -> Imports:
    """Every module, ours by its full name, another package's by that of the package."""
    graph = build_graph(PACKAGE, include_external_packages=True, cache_dir=None)
    return {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}


def room_of(module: str) -> str | None:
    """Room of a module, the package's own name for its public face, None for others' modules."""
    package, _, inner = module.partition(".")
    return (inner.partition(".")[0] or package) if package == PACKAGE else None


def of_rooms(modules: Imports) -> Imports:
    """Every room, and the other rooms that any module of it imports."""
    rooms: Imports = {}
    for module, others in modules.items():
        if (room := room_of(module)) is not None:
            found = {inner for other in others if (inner := room_of(other)) is not None}
            rooms.setdefault(room, set()).update(found - {room})
    return rooms


def in_order(imports: Imports) -> list[str]:
    """All names, each after what it imports. Raises graphlib.CycleError, which tells the circle."""
    return list(TopologicalSorter(imports).static_order())


def without_shortcuts(imports: Imports) -> Imports:
    """What is left when everything that is imported by way of another, too, is left out."""
    reached: Imports = {}
    for name in in_order(imports):
        reached[name] = imports[name].union(*(reached[other] for other in imports[name]))
    return {
        name: others.difference(*(reached[other] for other in others))
        for name, others in imports.items()
    }


def page(modules: Imports) -> str:
    """docs/imports.md: the picture, and the list of all."""
    rooms = of_rooms(modules)
    folders = {room_of(name) for name in modules if name.count(".") > 1}
    boxes = [f'{room}["{room}/"]' if room in folders else f"{room}([{room}])" for room in rooms]
    drawn = without_shortcuts(rooms)
    arrows = [f"{room} --> {other}" for room, others in drawn.items() for other in others]
    rows = [f"| `{room}` | {', '.join(sorted(rooms[room]))} |" for room in sorted(rooms)]
    picture = ["```mermaid", "flowchart TD", *sorted(boxes), *sorted(arrows), "```"]
    return "\n".join([HEADING, *picture, "", "| | imports |", "|---|---|", *rows, ""])


if __name__ == "__main__":
    PAGE.write_text(page(of_modules()))
