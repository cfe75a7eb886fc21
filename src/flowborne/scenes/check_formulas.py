"""Formulas and constants of a scene that cannot be used."""

from __future__ import annotations

from collections.abc import Iterator

from flowborne.errors import SceneError
from flowborne.motion.formula import RESERVED, Formula
from flowborne.phrases import suggestion
from flowborne.scenes.draft import Draft
from flowborne.scenes.schema_solids import MotionFormulaTable


def check_formulas(draft: Draft) -> Iterator[str]:
    """Names of constants, and formulas that are wrong, or not finite in a frame of the run."""
    scene = draft.scene
    if not draft.sound("constants"):
        return
    used: set[str] = set()
    wrong = []
    for where, text in _formulas(draft):
        try:
            formula = Formula(text, scene.constants)
            used |= formula.names()
            for frame in range(scene.time.frames + 1):
                formula.at(frame * scene.frame_time)
        except SceneError as error:
            wrong.append(f"{where}: {error}")
        except ArithmeticError as error:
            wrong.append(f"{where}: {error}. Change it, or end the run before.")
    yield from wrong
    for name in scene.constants:
        if name in RESERVED or not name.isidentifier():
            yield f"{draft.at('constants')}: '{name}' cannot be a constant's name. Change it."
        elif not (wrong or name in used) and draft.sound("motion", "mouths"):
            end = suggestion(name, used, "They use")
            yield f"{draft.at('constants')}: no formula uses '{name}'{end}"


def _formulas(draft: Draft) -> Iterator[tuple[str, str]]:
    """Where a formula is, for a message, and its text."""
    for index, motion in enumerate(draft.scene.motion):
        if isinstance(motion, MotionFormulaTable):
            yield draft.at("motion", index, "position"), motion.position
    for index, mouth in enumerate(draft.scene.mouths):
        if mouth.factor is not None:
            yield draft.at("mouths", index, "factor"), mouth.factor
