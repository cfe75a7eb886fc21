"""Contradictions between the mouths of a scene, its fluid and its model."""

from __future__ import annotations

from collections.abc import Iterator

from flowborne.coupling.step import cut_by_bodies, jets_at
from flowborne.coupling.world import Setup, World
from flowborne.scenes.bodies import initial_state
from flowborne.scenes.build_fluid import fluid_of
from flowborne.scenes.build_mouths import mouths_of
from flowborne.scenes.check_bodies import unknown_body
from flowborne.scenes.draft import Draft
from flowborne.solids.model import SolidModel


def check_mouths(draft: Draft, model: SolidModel) -> Iterator[str]:
    """Bodies that are there, in a fluid that feels them and can give way."""
    scene = draft.scene
    if not scene.mouths or scene.fluid is None or scene.boundaries is None:
        return
    unknown = []
    for index, mouth in enumerate(scene.mouths):
        unknown += unknown_body(draft, model, mouth.body, "mouths", index)
    yield from unknown
    if scene.fluid.coupling != "two-way" and draft.sound("fluid"):
        yield (
            f"{draft.at('fluid', 'coupling')}: the fluid does not feel bodies with mouths when it "
            f"is '{scene.fluid.coupling}'. Make it 'two-way', or drop [[mouths]]."
        )
        return
    if draft.sound("boundaries") and "open" not in {side.kind for _, side in scene.boundaries}:
        yield (
            f"{draft.at('boundaries')}: what a mouth expels has nowhere to go, as no side is "
            "open. Make a side open."
        )


def check_mouth_cells(draft: Draft, model: SolidModel) -> Iterator[str]:
    """Every mouth must cover cells of the grid at the start; for a scene with no other fault."""
    scene = draft.scene
    if not scene.mouths or draft.broken:
        return
    world = World.at_rest(Setup(model, fluid_of(scene)))
    world.solid = initial_state(scene, model)
    cut = cut_by_bodies(world)
    for index, mouth in enumerate(mouths_of(scene, model)):
        world.setup = Setup(model, world.setup.fluid, mouths=(mouth,))
        try:
            jets_at(world, cut, 0.0)
        except ValueError as error:
            yield f"{draft.at('mouths', index)}: {error}."
