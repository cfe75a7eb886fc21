"""Which geoms of a model displace fluid.

Many models draw a body with some geoms and collide with others; only one of both sets displaces
fluid, never their union. A geom is drawn in the groups 0 to 2, as in MuJoCo's viewer, and collides
if its contype or conaffinity is above 0. Planes and height fields have no volume and take part in
contact only.

The choice is written into the groups of the geoms: afterwards, geoms below HIDDEN_GROUP displace.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import mujoco
import numpy as np

from flowborne.base.phrases import listed
from flowborne.shapes.closing import is_closed
from flowborne.solids.geoms import (
    HIDDEN_GROUP,
    element_name,
    geom_shape,
    kind_of,
    mesh_of,
    solid_geoms,
)

DRAWN_GROUP = HIDDEN_GROUP - 1
"""Group for geoms that displace fluid but were not drawn."""

DECORATION_SHARE = 0.5
"""Drawn geoms with less than this part of the volume of colliding geoms are decoration (eyes)."""


@dataclass(frozen=True)
class Displace:
    """Geoms that displace fluid, as chosen in a scene.

    groups   0 to 5
    classes  classes of defaults in MJCF, or patterns with * and ?
    names    names or patterns; nameless geoms are geom0, geom1, ...
    without  names or patterns of geoms that never displace fluid; they are removed from the choice,
             or from the geoms chosen by rule
    """

    groups: tuple[int, ...] = ()
    classes: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    without: tuple[str, ...] = ()

    @property
    def by_rule(self) -> bool:
        return not (self.groups or self.classes or self.names)


BY_RULE = Displace()


def chosen_geoms(spec: mujoco.MjSpec, mj: mujoco.MjModel, displace: Displace) -> set[int]:
    """MuJoCo's numbers of the geoms that displace fluid.

    mj      of the spec
    raises  ValueError when no geom with a volume has a name, class or group of `displace`
    """
    names = {g: element_name(mj, mujoco.mjtObj.mjOBJ_GEOM, g) for g in solid_geoms(mj)}
    classes = {geom.id: geom.classname.name for geom in spec.geoms if geom.id in names}
    groups = {g: str(mj.geom_group[g]) for g in names}
    named = [_found(names, key, "name") for key in displace.names]
    without = [_found(names, key, "name") for key in displace.without]
    classed = [_found(classes, key, "class") for key in displace.classes]
    grouped = [_found(groups, str(key), "group") for key in displace.groups]
    by_body: dict[int, list[int]] = {}
    for g in names:
        by_body.setdefault(int(mj.geom_bodyid[g]), []).append(g)
    by_rule = [_of_body(mj, own) for own in by_body.values()] if displace.by_rule else []
    chosen = set[int]().union(*named, *classed, *grouped, *by_rule)
    return chosen.difference(*without)


def write_groups(spec: mujoco.MjSpec, chosen: set[int]) -> bool:
    """Write a choice into the groups of the geoms; return whether a geom changes.

    Geoms outside the groups that the compiler takes inertia from get zero mass instead.
    """
    lowest, highest = spec.compiler.inertiagrouprange
    changed = False
    for geom in spec.geoms:
        group = min(geom.group, DRAWN_GROUP) if geom.id in chosen else max(geom.group, HIDDEN_GROUP)
        if not lowest <= geom.group <= highest:
            geom.mass, changed = 0.0, True
        if group != geom.group:
            geom.group, changed = group, True
    spec.compiler.inertiagrouprange = 0, mujoco.mjNGROUP - 1
    return changed


def _found(values: Mapping[int, str], pattern: str, what: str) -> set[int]:
    """Geoms with a value that matches a pattern. Raises ValueError without any."""
    found = {g for g, value in values.items() if fnmatchcase(value, pattern)}
    if not found:
        known = listed(list(dict.fromkeys(values.values()))) or "none"
        raise ValueError(f"no geom with a volume has the {what} '{pattern}'. There are: {known}.")
    return found


def _of_body(mj: mujoco.MjModel, geoms: Sequence[int]) -> Sequence[int]:
    """The geoms of one body that displace fluid by rule.

    They are the drawn geoms, or the colliding ones if the drawn ones are open or decoration. On the
    world, which is not one body, the drawn geoms displace.
    """
    if mj.geom_bodyid[geoms[0]] == 0:
        return [g for g in geoms if mj.geom_group[g] < HIDDEN_GROUP]
    drawn, colliding = _drawn_and_colliding(mj, geoms)
    if not drawn or not colliding or drawn == colliding:
        return drawn or colliding
    volume, other = _volume(mj, drawn), _volume(mj, colliding)
    if np.isnan(volume):
        return drawn if np.isnan(other) else colliding
    return colliding if volume < DECORATION_SHARE * other else drawn


def _drawn_and_colliding(mj: mujoco.MjModel, geoms: Sequence[int]) -> tuple[list[int], list[int]]:
    """Drawn and colliding geoms of one body; the same if the model does not distinguish them."""
    groups = mj.geom_group
    collides = (mj.geom_contype != 0) | (mj.geom_conaffinity != 0)
    drawn = [g for g in geoms if groups[g] < HIDDEN_GROUP]
    colliding = [g for g in geoms if collides[g]]
    passive = [g for g in drawn if not collides[g]]
    if passive and not {groups[g] for g in passive} & {groups[g] for g in colliding}:
        return passive, colliding
    hidden = [g for g in colliding if groups[g] >= HIDDEN_GROUP]
    return (drawn, hidden) if drawn and hidden else (drawn or hidden, drawn or hidden)


def _volume(mj: mujoco.MjModel, geoms: Sequence[int]) -> float:
    """Total volume of geoms, m^3, overlaps counted twice; nan if one is open."""
    for g in geoms:
        mesh = mesh_of(mj, g)
        if kind_of(mj, g) == "sdf" or (mesh is not None and not is_closed(mesh)):
            return np.nan
    return sum(geom_shape(mj, g).volume for g in geoms)
