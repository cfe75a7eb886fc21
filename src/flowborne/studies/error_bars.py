"""Error bars of a number, from its values on several grids and with several steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from flowborne.base.arguments import COUNT, COUNTS, PATH, TEXT, TEXTS, Kind, or_none, takes
from flowborne.base.errors import PartError, SceneError
from flowborne.kernels.arrays import Array
from flowborne.scenes.load import load_scene
from flowborne.scenes.schema import Scene
from flowborne.sim.endings import RunOutcome
from flowborne.sim.running import run
from flowborne.view.open_run import OpenRun

FORMAL_ORDER = 2.0
"""Order of the scheme in grid and step for smooth flows."""

LEAST_ORDER, MOST_ORDER = 0.5, 2.0
"""Bounds of the order in the bar: a higher one, by chance, would make the bar too short."""

SAFETY_FACTOR, CAUTIOUS_FACTOR = 1.25, 3.0
"""Factors of safety if the observed order is that of the scheme, and if it is not."""

ORDER_TOLERANCE = 0.1
"""Relative difference of the observed order from the scheme's in the former case."""

LARGEST_ORDER = 30.0
"""Upper bound in the search for the order."""

Convergence = Literal["monotone", "equal", "none", "unknown"]
"""Convergence of the last three values: from one side; all equal; they oscillate, or their
differences grow; unknown for only two values."""


@dataclass(frozen=True)
class Refinement:
    """A number at several resolutions, and its convergence from the last three values.

    The error of value i is C h_i^p with h_i = 1 / resolution_i. Three values give C and p. If they
    oscillate or their differences grow, there is no order, and the bar is their range.

    resolutions   from coarse to fine: cells, or steps per frame
    values        one each
    convergence   of the last three: "monotone", "equal", "none" or "unknown"
    order         observed p; nan unless they approach a value from one side
    extrapolated  value at h = 0 by Richardson extrapolation with that p; nan without p or with
                  p < 0.5, for which the extrapolation is unreliable
    uncertainty   half width of the bar around the finest value, never negative
    spread        largest value minus the smallest, of all
    """

    resolutions: tuple[float, ...]
    values: tuple[float, ...]
    convergence: Convergence
    order: float
    extrapolated: float
    uncertainty: float
    spread: float

    @classmethod
    def of(cls, resolutions: Sequence[float], values: Sequence[float]) -> Refinement:
        """The refinement of known values, in the order of the resolutions.

        raises  ValueError for fewer than two values, resolutions that do not grow or are not
                positive, and numbers that are not finite
        source  order for any ratio of spacings: Celik et al. 2008, "Procedure for estimation and
                reporting of uncertainty due to discretization in CFD applications", J. Fluids Eng.
                130, 078001; factors of safety and bounds of the order: Oberkampf and Roy 2010,
                "Verification and validation in scientific computing", section 8.5; two values:
                Roache 1994, "Perspective: a method for uniform reporting of grid refinement
                studies", J. Fluids Eng. 116, 405
        """
        if len(values) != len(resolutions) or len(values) < 2:
            raise ValueError(
                f"there are {len(values)} values at {len(resolutions)} resolutions. "
                "Give two or more, one for each."
            )
        _check_growing("resolutions", resolutions)
        if not np.isfinite(values).all():
            raise ValueError(f"the values are {list(values)}. Give finite numbers.")
        h = 1.0 / np.array(resolutions[-3:], float)
        f = np.array(values[-3:], float)
        apart = float(np.ptp(f))
        convergence: Convergence = "none"
        order, extrapolated, bar = math.nan, math.nan, apart
        if apart == 0.0:
            convergence, extrapolated = "equal", float(f[-1])
        elif len(f) == 2:
            convergence, bar = "unknown", CAUTIOUS_FACTOR * _remaining(f, h, FORMAL_ORDER)
        elif not math.isnan(order := order_of(h, f)):
            convergence = "monotone"
            if order >= LEAST_ORDER:
                extrapolated = float(f[-1] + np.sign(f[-1] - f[-2]) * _remaining(f, h, order))
            near = abs(order - FORMAL_ORDER) <= ORDER_TOLERANCE * FORMAL_ORDER
            bounded = min(max(order, LEAST_ORDER), MOST_ORDER)
            bar = (SAFETY_FACTOR if near else CAUTIOUS_FACTOR) * _remaining(f, h, bounded)
        spread = float(np.ptp(np.array(values, float)))
        return cls(
            tuple(map(float, resolutions)),
            tuple(map(float, values)),
            convergence,
            order,
            extrapolated,
            bar,
            spread,
        )

    @property
    def value(self) -> float:
        """Value at the finest resolution."""
        return self.values[-1]

    def __str__(self) -> str:
        order = "no order" if math.isnan(self.order) else f"order {self.order:.2g}"
        return f"{self.value:.4g} ± {self.uncertainty:.2g} ({order})"


@dataclass(frozen=True)
class ErrorBar:
    """A number of a scene with its numerical uncertainty.

    value        on the finest grid with the shortest step
    uncertainty  half width of its bar: the sum of those of grids, steps and place
    spread       largest value minus the smallest, of all runs
    grids        its values on all grids, with the shortest step; None for one grid
    steps        its values with all steps, on the finest grid; None for one step
    shifted      value on the finest grid half a cell aside; None for one grid. Its distance from
                 `value` is the half width of the place: if a number varies over a cell, the places
                 half a cell apart are on either side of its mean
    """

    value: float
    uncertainty: float
    spread: float
    grids: Refinement | None
    steps: Refinement | None
    shifted: float | None

    def __str__(self) -> str:
        found = {"grid": self.grids, "step": self.steps}
        parts = [f"{name} {one.uncertainty:.2g}" for name, one in found.items() if one is not None]
        if self.shifted is not None:
            parts.append(f"place {abs(self.shifted - self.value):.2g}")
        return f"{self.value:.4g} ± {self.uncertainty:.2g} ({', '.join(parts)})"


@takes(
    measure=Kind(lambda m: m if callable(m) else TEXT.read(m), "a column's name, or a function"),
    resolutions=COUNTS,
    steps=COUNTS,
    frames=or_none(COUNT),
    settings=or_none(TEXTS),
    out=or_none(PATH),
)
def error_bar(
    scene: str | Path,
    measure: str | Callable[[OpenRun], float],
    resolutions: Sequence[int] = (),
    steps: Sequence[int] = (),
    *,
    frames: int | None = None,
    settings: Mapping[str, str] | None = None,
    out: Path | str | None = None,
) -> ErrorBar:
    """Error bar of a number, from runs of a scene on several grids and with several steps.

    The grids are run with the last number of steps, the steps on the last grid. With several grids
    the last one is run again half a cell aside along every axis, and the sides of the domain with
    it. The bar contains the errors of grid and step only, not those of the model.

    scene        name of a built-in scene, or path of a scene file
    measure      a column of the history, for its mean over all frames, or a function of a run
    resolutions  values of [domain] resolution, ascending; three or more give an order. The scene's
                 by default
    steps        values of [time] steps_per_frame, ascending; likewise
    frames       number of frames; the scene's by default
    settings     further keys of the scene, as for `load_scene`
    out          folder that keeps the runs; by default each is deleted after its measurement
    returns      the number on the finest grid with the shortest step, and its bar
    raises       ValueError for fewer than two grids and two numbers of steps, or if they do not
                 grow, for an unknown column, and a number that is not finite; SceneError if the
                 scene is wrong, or one of its runs ends with another outcome than `done`;
                 RunFolderError if `out` already contains such runs;
                 PartError if `measure` fails
    """
    for name, given in (("resolutions", resolutions), ("steps", steps)):
        if len(given):
            _check_growing(name, given)
    if max(len(resolutions), len(steps)) < 2:
        raise ValueError("an error bar needs two grids or two steps. Give resolutions or steps.")
    cells_of: list[int | None] = [*resolutions] or [None]
    counts: list[int | None] = [*steps] or [None]
    grids = [(cells, counts[-1]) for cells in cells_of]
    times = [(cells_of[-1], count) for count in counts]
    runs = [(*pair, False) for pair in dict.fromkeys([*grids, *times])]
    aside = (*times[-1], True)
    values: dict[tuple[int | None, int | None, bool], float] = {}
    for cells, count, moved in [*runs, aside] if len(grids) > 1 else runs:
        keys = {"domain.resolution": cells, "time.steps_per_frame": count}
        chosen = {key: str(number) for key, number in keys.items() if number is not None}
        name = ", ".join(f"{key}={number}" for key, number in chosen.items())
        name += ", half a cell aside" if moved else ""
        loaded = load_scene(scene, {**(settings or {}), **chosen})
        loaded = _shifted(loaded) if moved else loaded
        with TemporaryDirectory() as thrown_away:
            folder = Path(thrown_away if out is None else out) / name.replace(", ", " ")
            result = run(loaded, folder, frames=frames, film=False)
            if result.outcome is not RunOutcome.DONE:
                raise SceneError(f"no error bar of {scene} with {name}: {result.message}.")
            values[cells, count, moved] = _measured(OpenRun(folder), measure)
    ways = (resolutions, grids), (steps, times)
    grid, step = (
        Refinement.of(numbers, [values[*key, False] for key in keys]) if len(keys) > 1 else None
        for numbers, keys in ways
    )
    value, shifted = values[*times[-1], False], values.get(aside)
    uncertainty = sum(found.uncertainty for found in (grid, step) if found is not None)
    uncertainty += 0.0 if shifted is None else abs(shifted - value)
    return ErrorBar(value, uncertainty, float(np.ptp(list(values.values()))), grid, step, shifted)


def _shifted(scene: Scene) -> Scene:
    """The scene with its domain half a cell further along every axis."""
    domain = scene.domain
    assert domain is not None
    half = 0.5 * domain.spacing()
    corners = {"lower": domain.lower, "upper": domain.upper}
    moved = {name: tuple(x + half for x in corner) for name, corner in corners.items()}
    return scene.model_copy(update={"domain": domain.model_copy(update=moved)})


def order_of(spacings: Array, values: Array) -> float:
    """Order p > 0 of three values from coarse to fine, (f1 - f2) / (f2 - f3) =
    (h1^p - h2^p) / (h2^p - h3^p); nan where there is none."""
    before, last = np.diff(values)
    if before * last <= 0.0:
        return math.nan
    first, second = np.log(spacings[:2] / spacings[1:])

    def excess(p: float) -> float:
        """Logarithm of the ratio of differences that an order makes, over the observed one."""
        made = p * second + math.log(np.expm1(p * first) / np.expm1(p * second))
        return float(made - math.log(before / last))

    least = 1e-6
    if excess(least) >= 0.0:
        return math.nan
    if excess(LARGEST_ORDER) <= 0.0:
        return LARGEST_ORDER
    return float(brentq(excess, least, LARGEST_ORDER))


def _remaining(values: Array, spacings: Array, order: float) -> float:
    """Size of the error of the finest value, from the last two and their order."""
    ratio = spacings[-2] / spacings[-1]
    return float(abs(values[-1] - values[-2]) / (ratio**order - 1.0))


def _measured(done: OpenRun, measure: str | Callable[[OpenRun], float]) -> float:
    if callable(measure):
        with PartError.guarding("the measure"):
            return float(measure(done))
    if measure not in done.history:
        raise ValueError(
            f"the history has no column '{measure}'. Its columns are: {', '.join(done.history)}."
        )
    return float(done.history[measure].mean())


def _check_growing(name: str, numbers: Sequence[float]) -> None:
    if not (numbers[0] > 0 and np.isfinite(numbers).all() and np.all(np.diff(numbers) > 0)):
        raise ValueError(f"{name} are {list(numbers)}. Give positive numbers, from small to large.")
