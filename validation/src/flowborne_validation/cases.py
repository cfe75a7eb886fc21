"""The table of cases, in the order of the reference list."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from importlib import import_module
from importlib.resources import files
from typing import Any

from flowborne_validation.case import Case, Tier, entries
from flowborne_validation.findings import Figures, Rule, figure_of, over


@cache
def cases() -> dict[str, Case]:
    """Every case by its id, from cases.toml."""
    text = files("flowborne_validation").joinpath("cases.toml").read_text(encoding="utf-8")
    rows: dict[str, Any] = tomllib.loads(text)
    coarse, alone = rows.pop("coarse"), rows.pop("alone")
    return {
        name: case_of(name, module, dict(row), name in coarse, name in alone)
        for module, some in rows.items()
        for name, row in some.items()
    }


def case_of(name: str, module: str, row: dict[str, Any], coarse: bool, alone: bool) -> Case:
    """The case of a row of the table."""
    on, tiers = row.pop("on", ""), [tier.value for tier in Tier]
    runs: dict[Tier, list[Callable[[], Figures]]] = {}
    rules = {}
    for key, entry in row.items():
        for part in entry if isinstance(entry, list) else [entry]:
            if not part.keys() & set(tiers):
                rules[key] = Rule(**part)
            shared = {name: value for name, value in part.items() if name not in tiers}
            for tier in (tier for tier in Tier if tier.value in part):
                arguments = {"on": on} | shared | part[tier.value]
                run = partial(measured, f"flowborne_validation.{module}", key, **arguments)
                runs.setdefault(tier, []).append(run)
    return Case(name, {tier: runs[tier] for tier in Tier if tier in runs}, rules, coarse, alone)


def measured(
    module: str, function: str, on: str, each: Sequence[Any] = (), **arguments: Any
) -> Figures:
    """Figures of a function of a module, which is imported for it.

    on    unit of the grids
    each  grids that the function measures one after the other
    """
    measure = partial(getattr(import_module(module), function), **arguments)
    found: Figures = over(each, measure) if each else measure()
    return {name: replace(figure_of(figure), on=on) for name, figure in found.items()}


def case_ids() -> Sequence[str]:
    """Every case, in the order of the reference list."""
    return tuple(entries())


def case(name: str) -> Case:
    """The case with this id. Raises KeyError when there is none."""
    return cases()[name]
