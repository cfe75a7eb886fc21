"""Which geoms of a model displace fluid.

Models of others draw a body by some geoms and let others collide in its place; the fluid meets one
of both sets, never their union. A geom is drawn in the groups 0 to 2, as in MuJoCo's viewer, and
touches where its contype or conaffinity is above 0. Planes and height fields, which have no volume,
do neither here: they take part in contact alone.

The choice is written into the groups of the geoms: from then on those below HIDDEN_GROUP displace.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import mujoco
import numpy as np

from flowborne.shapes.closing import is_closed
from flowborne.solids.geoms import (
    HIDDEN_GROUP,
    element_name,
    geom_shape,
    kind_of,
    mesh_of,
    solid_geoms,
)

DRAWN = HIDDEN_GROUP - 1
"""Group of geoms that displace, but were not drawn."""

DECORATION = 0.5
"""Drawn geoms with less than this part of the volume of those that touch are decoration, such as
eyes: what draws a body has about its size."""


@dataclass(frozen=True)
class Displace:
    """Geoms that displace fluid, as a scene names them.

    groups   0 to 5
    classes  of defaults in MJCF, or patterns with * and ?
    names    or patterns; nameless geoms are geom0, geom1, ...
    without  names or patterns of geoms that displace nothing, whatever else is said; alone they
             are taken off what displaces by rule
    """

    groups: tuple[int, ...] = ()
    classes: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    without: tuple[str, ...] = ()

    @property
    def by_rule(self) -> bool:
        return not (self.groups or self.classes or self.names)


BY_RULE = Displace()

LISTED = 12
"""Most names that a message lists."""


def chosen_geoms(spec: mujoco.MjSpec, mj: mujoco.MjModel, displace: Displace) -> set[int]:
    """MuJoCo's numbers of the geoms that displace fluid.

    mj      of the spec
    raises  ValueError when a name, class or group of `displace` is of no geom that could
    """
    names = {g: element_name(mj, mujoco.mjtObj.mjOBJ_GEOM, g) for g in solid_geoms(mj)}
    classes = {geom.id: geom.classname.name for geom in spec.geoms if geom.id in names}
    groups = {g: str(mj.geom_group[g]) for g in names}
    named = [_found(names, key, "name") for key in displace.names]
    without = [_found(names, key, "name") for key in displace.without]
    classed = [_found(classes, key, "class") for key in displace.classes]
    grouped = [_found(groups, str(key), "group") for key in displace.groups]
    by_rule = [_of_body(mj, own) for own in _by_body(mj, names)] if displace.by_rule else []
    chosen = set[int]().union(*named, *classed, *grouped, *by_rule)
    return chosen.difference(*without)


def write_groups(spec: mujoco.MjSpec, chosen: set[int]) -> bool:
    """Write a choice into the groups of the geoms; gives whether that changes one.

    Geoms outside the groups that the compiler takes inertia from get no mass instead.
    """
    lowest, highest = spec.compiler.inertiagrouprange
    changed = False
    for geom in spec.geoms:
        group = min(geom.group, DRAWN) if geom.id in chosen else max(geom.group, HIDDEN_GROUP)
        if not lowest <= geom.group <= highest:
            geom.mass, changed = 0.0, True
        if group != geom.group:
            geom.group, changed = group, True
    spec.compiler.inertiagrouprange = 0, mujoco.mjNGROUP - 1
    return changed


def _found(values: Mapping[int, str], pattern: str, what: str) -> set[int]:
    """Geoms with a value of a pattern. Raises ValueError without any."""
    found = {g for g, value in values.items() if fnmatchcase(value, pattern)}
    if not found:
        known = list(dict.fromkeys(values.values()))
        more = f" and {len(known) - LISTED} more" if len(known) > LISTED else ""
        raise ValueError(
            f"no geom with a volume has the {what} '{pattern}'. There are: "
            f"{', '.join(known[:LISTED]) or 'none'}{more}."
        )
    return found


def _by_body(mj: mujoco.MjModel, geoms: Iterable[int]) -> Iterable[list[int]]:
    bodies: dict[int, list[int]] = {}
    for g in geoms:
        bodies.setdefault(int(mj.geom_bodyid[g]), []).append(g)
    return bodies.values()


def _of_body(mj: mujoco.MjModel, geoms: Sequence[int]) -> Sequence[int]:
    """Of the geoms of one body those that displace by rule: the drawn ones, or those that touch
    where the drawn ones are not closed or are decoration. Those on the world are no one body: of
    them the drawn ones displace."""
    if mj.geom_bodyid[geoms[0]] == 0:
        return [g for g in geoms if mj.geom_group[g] < HIDDEN_GROUP]
    drawn, touching = _drawn_and_touching(mj, geoms)
    if not drawn or not touching or drawn == touching:
        return drawn or touching
    volume, other = _volume(mj, drawn), _volume(mj, touching)
    if np.isnan(volume):
        return drawn if np.isnan(other) else touching
    return touching if volume < DECORATION * other else drawn


def _drawn_and_touching(mj: mujoco.MjModel, geoms: Sequence[int]) -> tuple[list[int], list[int]]:
    """Geoms of one body that draw it, and those that collide for it; the same ones where the model
    does not tell them apart."""
    groups = mj.geom_group
    touches = (mj.geom_contype != 0) | (mj.geom_conaffinity != 0)
    drawn = [g for g in geoms if groups[g] < HIDDEN_GROUP]
    touching = [g for g in geoms if touches[g]]
    passive = [g for g in drawn if not touches[g]]
    if passive and not {groups[g] for g in passive} & {groups[g] for g in touching}:
        return passive, touching
    hidden = [g for g in touching if groups[g] >= HIDDEN_GROUP]
    return (drawn, hidden) if drawn and hidden else (drawn or hidden, drawn or hidden)


def _volume(mj: mujoco.MjModel, geoms: Sequence[int]) -> float:
    """What geoms have together, m^3, overlaps counted twice; not a number with an open one."""
    return sum(_own_volume(mj, g) for g in geoms)


def _own_volume(mj: mujoco.MjModel, geom: int) -> float:
    mesh = mesh_of(mj, geom)
    if kind_of(mj, geom) == "sdf" or (mesh is not None and not is_closed(mesh)):
        return np.nan
    return geom_shape(mj, geom).volume
