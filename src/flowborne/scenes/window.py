"""A domain that follows bodies: its checks, and the fluid's window."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flowborne.base.phrases import listed
from flowborne.coupling.cut import following
from flowborne.coupling.world import Fluid
from flowborne.fluid.grid import Array
from flowborne.fluid.window import crosses
from flowborne.scenes.draft import Draft
from flowborne.scenes.dye import DyeBox
from flowborne.scenes.schema import Scene
from flowborne.scenes.sides import InflowSide
from flowborne.solids.model import SolidModel


def followed_by(scene: Scene) -> bool:
    """Whether the domain is a window that follows something."""
    return scene.domain is not None and scene.domain.follow != "nothing"


def axes_of(scene: Scene) -> tuple[int, ...]:
    """Axes along which the window moves."""
    assert scene.domain is not None
    along = "xyz"[: scene.dimensions] if scene.domain.along is None else scene.domain.along
    return tuple(sorted({"xyz".index(name) for name in along}))


def with_window(fluid: Fluid, scene: Scene, model: SolidModel, q: Array) -> Fluid:
    """The fluid whose grid follows what the scene names, from the positions q (nq,) on."""
    if not followed_by(scene):
        return fluid
    assert scene.domain is not None
    name = scene.domain.follow
    bodies = np.flatnonzero(model.moving).tolist()
    return following(
        fluid,
        model,
        q,
        bodies if name == "bodies" else [model.body_names.index(name)],
        axes_of(scene),
    )


def check_window(draft: Draft) -> Iterator[str]:
    """There must be fluid beyond the sides across which the domain moves."""
    scene = draft.scene
    if not followed_by(scene):
        if scene.domain is not None and scene.domain.along is not None:
            yield (
                f"{draft.at('domain', 'along')}: the domain follows nothing. "
                "Give follow, or drop this key."
            )
        return
    if not scene.has_bodies:
        yield (
            f"{draft.at('domain', 'follow')}: there are no bodies. "
            "Add [solids] with a model, or drop this key."
        )
    axes = axes_of(scene)
    if scene.is_slab and 2 in axes:
        yield (
            f"{draft.at('domain', 'along')}: a scene of 2 dimensions has no z. Give x, y or both."
        )
        return
    if scene.boundaries is None or not draft.sound("boundaries"):
        return
    for name, side in scene.boundaries:
        kind = side.boundary
        if "xyz".index(name[0]) in axes and not crosses(kind):
            others = ", ".join(f'"{"xyz"[a]}"' for a in axes if "xyz"[a] != name[0])
            yield (
                f"{draft.at('boundaries', name)}: the domain follows bodies along {name[0]}, and "
                f"beyond a {kind.kind} side there is no fluid. Make the side far, open or inflow"
                + (f", or give [domain] along = [{others}]." if others else ".")
            )
        across = [a for a in axes if a != "xyz".index(name[0])]
        if isinstance(side, InflowSide) and side.profile == "parabolic" and across:
            yield (
                f"{draft.at('boundaries', name)}: its profile is 0 at the edges of the side, which "
                f"move along {listed(['xyz'[a] for a in across])} with the domain. Give profile = "
                f'"uniform", or [domain] along = ["{name[0]}"].'
            )


def window_notes(scene: Scene) -> Iterator[str]:
    """What a domain that moves leaves behind, without full stops."""
    if not followed_by(scene):
        return
    assert scene.domain is not None
    axes = axes_of(scene)
    along = "" if len(axes) == scene.dimensions else f" along {listed(['xyz'[a] for a in axes])}"
    yield (
        f"[domain]: it follows {scene.domain.follow}{along}, and vortices and dye that it leaves "
        "behind are lost"
    )
    fixed = [f"[[sources]] {n}" for n, _ in enumerate(scene.sources, start=1)]
    fixed += [
        f"[[dye]] {n}"
        for n, dye in enumerate(scene.dye, start=1)
        if isinstance(dye, DyeBox) or dye.axis in axes
    ]
    if fixed:
        yield (
            f"[domain]: {listed(fixed)} {'stays' if len(fixed) == 1 else 'stay'} in place, and "
            f"{'acts' if len(fixed) == 1 else 'act'} only while the domain is there"
        )


def check_followed(draft: Draft, model: SolidModel) -> Iterator[str]:
    """What the domain follows must be a body that can move."""
    if not followed_by(draft.scene):
        return
    assert draft.scene.domain is not None
    name = draft.scene.domain.follow
    if name == "bodies":
        if not model.moving.any():
            yield f"{draft.at('domain', 'follow')}: no body of the model moves. Drop this key."
        return
    unknown = list(draft.unknown_body(model, name, "domain", "follow"))
    yield from unknown
    if not unknown and not model.moving[model.body_names.index(name)]:
        yield (
            f"{draft.at('domain', 'follow')}: body '{name}' does not move. "
            'Name one that does, or give "bodies".'
        )
