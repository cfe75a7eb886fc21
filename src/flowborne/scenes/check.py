"""All checks that hold the tables of a scene against each other and against its model."""

from __future__ import annotations

from flowborne.coupling.world import Setup
from flowborne.errors import SceneError
from flowborne.scenes.bodies import initial_state, load_model
from flowborne.scenes.build import mouths_of, surroundings_of
from flowborne.scenes.check_bodies import check_bodies, check_without_bodies
from flowborne.scenes.check_clip import check_clip, check_followers
from flowborne.scenes.controller import check_control
from flowborne.scenes.draft import Draft
from flowborne.scenes.earlier import check_earlier, check_earlier_joints
from flowborne.scenes.flesh import check_flesh
from flowborne.scenes.fluid import check_dimensions, check_fluid, fluid_of
from flowborne.scenes.mouths import check_mouth_cells, check_mouths


def cross_check(draft: Draft) -> list[str]:
    """Everything that is wrong with a scene that the schema accepts."""
    problems = [*check_dimensions(draft), *check_fluid(draft), *check_without_bodies(draft)]
    flesh = check_flesh(
        draft, draft.scene.flesh, slab=draft.scene.is_slab, has_model=draft.scene.solids is not None
    )
    unusable = [*check_earlier(draft), *check_clip(draft), *flesh]
    problems += unusable
    scene = draft.scene
    if (
        not scene.has_bodies
        or unusable
        or not draft.sound("dimensions", "gravity", "clip", "shapes")
    ):
        return problems
    try:
        model = load_model(scene)
    except SceneError as error:
        table = "human" if scene.human is not None else "flesh" if scene.flesh else "solids"
        return problems + [f"{draft.at(table)}: {problem}" for problem in error.problems]
    lost = [*check_earlier_joints(draft, model), *check_followers(draft, model)]
    if lost:
        return problems + lost
    around = surroundings_of(scene, model, draft.broken)
    coupling = scene.fluid.coupling if scene.fluid is not None else "two-way"
    mouths = check_mouths(draft, scene.mouths, coupling, around)
    problems += [*check_bodies(draft, around), *mouths]
    problems += check_control(draft, around)
    if problems or not scene.mouths or draft.broken:
        return problems
    return [
        *check_mouth_cells(
            draft,
            mouths_of(scene, model),
            Setup(model, fluid_of(scene)),
            initial_state(scene, model),
        )
    ]
