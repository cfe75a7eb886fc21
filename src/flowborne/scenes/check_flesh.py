"""Contradictions between the flesh of a scene and the rest of it."""

from __future__ import annotations

from collections.abc import Iterator

from flowborne.scenes.draft import Draft
from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import SolidModel
from flowborne.solids.state import SolidState


def check_flesh(draft: Draft) -> Iterator[str]:
    """What can be said before the flesh is meshed."""
    scene = draft.scene
    if not scene.flesh:
        return
    for index, table in enumerate(scene.flesh):
        if scene.is_slab and (table.thickness is not None or table.surface is not None):
            yield (
                f"{draft.at('flesh', index)}: flesh is meshed in 3 dimensions alone. Set "
                "dimensions = 3, or give a mesh of triangles at z = 0 in place of its thickness "
                "or surface."
            )
    if scene.solids is None:
        yield (
            f"{draft.at('flesh')}: flesh grows on the bodies of a model file. "
            "Add [solids] with a model, or drop [[flesh]]."
        )
    names = [table.name for table in scene.flesh]
    for index, table in enumerate(scene.flesh):
        if table.name in names[:index]:
            yield f"{draft.at('flesh', index)}: another flesh is called '{table.name}'. Rename one."
        if table.damping != scene.flesh[0].damping:
            yield (
                f"{draft.at('flesh', index)}: its damping is {table.damping:g} s, that of "
                f"'{names[0]}' {scene.flesh[0].damping:g} s. Give all flesh the same."
            )


def check_flesh_places(draft: Draft, model: SolidModel, start: SolidState) -> Iterator[str]:
    """No flesh may start outside the domain."""
    domain = draft.scene.domain
    if model.flesh is None or domain is None or not draft.scene.has_fluid:
        return
    vertices = kinematics(model, start.q).vertices
    for flesh, name in enumerate(model.flesh.names):
        own = vertices[model.flesh.surface[model.flesh.of_surface == flesh]].reshape(-1, 3)
        for axis in range(len(domain.lower)):
            low, high = own[:, axis].min(), own[:, axis].max()
            first, last = domain.lower[axis], domain.upper[axis]
            if low < first or high > last:
                yield (
                    f"{draft.at('flesh', flesh)}: '{name}' reaches from {low:g} to {high:g} m in "
                    f"{'xyz'[axis]} at the start, outside the domain from {first:g} to {last:g} m. "
                    "Move the body or enlarge the domain."
                )
