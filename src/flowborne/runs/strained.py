"""Doubts about joints that passed their stops and equalities that came open, from the states."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from flowborne.base.phrases import more_too
from flowborne.kernels.arrays import Mask
from flowborne.runs.run_folder import RunFolderError
from flowborne.runs.states import read_state
from flowborne.solids.model import SolidModel
from flowborne.solids.passed import Equalities, Passed, passed_stops
from flowborne.solids.scratch import DEFAULT_SOLREF


def strained(states: Iterable[Path], model: SolidModel, driven: Mask, dt: float) -> Iterator[str]:
    """Sentences, without a full stop, about the stop and the equality that are farthest off.

    states  files of the states
    driven  (nv,) dofs that something drives
    dt      of a step, s
    """
    if not (model.mj.jnt_limited.any() or model.mj.tendon_limited.any() or model.mj.neq):
        return
    equalities = Equalities(model, dt)
    stops: dict[str, tuple[int, Passed]] = {}
    opened: dict[str, tuple[int, Passed]] = {}
    for path in sorted(states, key=lambda path: int(path.stem)):
        try:
            state = read_state(path, ("q", "v"))
        except RunFolderError:  # a run is used without the states that are damaged
            continue
        _keep(stops, int(path.stem), passed_stops(model, state["q"]))
        _keep(opened, int(path.stem), equalities.at(state["q"], state["v"]))
    if stops:
        frame, worst = _worst(stops)
        yield (
            f"{worst.name} was at {worst.said(worst.place)} in frame {frame}, "
            f"{worst.said(worst.amount)} beyond its range{more_too(stops)}; "
            f"{_remedy(model, worst, driven)}"
        )
    if opened:
        frame, worst = _worst(opened)
        remedy = "drive fewer joints of its loop" if frame else "start where it is closed"
        yield (
            f"{worst.name} was open by {worst.said(worst.amount)} in frame {frame}"
            f"{more_too(opened)}, and its softness explains {worst.said(worst.allowed)}; "
            f"{remedy}, or give it a shorter time constant by solref in the model"
        )


def _keep(found: dict[str, tuple[int, Passed]], frame: int, passed: Iterable[Passed]) -> None:
    """Keep the largest amount of each that is more than it may be."""
    for each in passed:
        if each.amount > each.allowed:
            _, known = found.get(each.name, (0, None))
            if known is None or each.ratio > known.ratio:
                found[each.name] = frame, each


def _worst(found: dict[str, tuple[int, Passed]]) -> tuple[int, Passed]:
    return max(found.values(), key=lambda each: each[1].ratio)


def _remedy(model: SolidModel, stop: Passed, driven: Mask) -> str:
    """What keeps a joint or tendon within its range."""
    if stop.joint >= 0:
        if driven[model.mj.jnt_dofadr[stop.joint]]:
            return "let what drives it stay in the range, or widen the range in the model"
        if not np.array_equal(model.mj.jnt_solref[stop.joint], DEFAULT_SOLREF):
            return "a shorter time constant of solreflimit in the model, or none, makes it stiffer"
        return "take more steps per frame"
    return "a shorter time constant of solreflimit in the model makes it stiffer"
