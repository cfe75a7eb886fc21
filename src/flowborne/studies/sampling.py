"""The samples of a study: grids, random and Latin hypercube, or proposed by Optuna.

A sampler with a seed proposes the same samples for the same results, so that nothing of it is kept:
a study that goes on asks again from the start, and finds the results on the disc.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from flowborne.base.errors import SceneError
from flowborne.base.extras import optional
from flowborne.studies.schema import Study, VaryTable

MOST_RUNS = 100_000
"""Most runs of a study; each has two files in one folder."""

DIRECTIONS = {"least": "minimize", "most": "maximize"}
"""Goal of a measure -> direction of Optuna."""

Sample = dict[str, Any]
"""Dotted key of the scene -> value."""


def samples_of(study: Study) -> list[Sample]:
    """All samples of a study without goals to look for, in their order."""
    keys = [table.key for table in study.vary]
    if study.sample.kind == "grid":
        axes = [grid_values(table) for table in study.vary]
        return [dict(zip(keys, values, strict=True)) for values in product(*axes)]
    assert study.sample.count is not None
    random = np.random.default_rng(study.sample.seed)
    if study.sample.kind == "random":
        units = random.random((study.sample.count, len(keys)))
    else:
        from scipy.stats.qmc import LatinHypercube  # takes most of a second to import

        units = LatinHypercube(len(keys), rng=random).random(study.sample.count)
    return [
        {table.key: value_at(table, float(u)) for table, u in zip(study.vary, row, strict=True)}
        for row in units
    ]


def grid_values(table: VaryTable) -> list[Any]:
    """Values of a key in a grid: its list, or evenly from end to end of its range."""
    if table.values:
        return list(table.values)
    assert table.count is not None
    if table.count == 1:
        return [table.lower]
    lower, upper = _ends(table)
    points = np.linspace(lower, upper, table.count).tolist()
    points = [math.exp(x) for x in points] if table.log else points
    points[0], points[-1] = table.lower, table.upper  # exactly
    return list(dict.fromkeys(map(round, points))) if table.is_whole else points


def value_at(table: VaryTable, unit: float) -> Any:
    """Value of a key for a random number from 0 to 1, evenly over its list or range."""
    if table.values:
        return table.values[int(unit * len(table.values))]
    lower, upper = _ends(table)
    if table.is_whole and not table.log:
        return int(lower + math.floor(unit * (upper - lower + 1.0)))
    value = lower + unit * (upper - lower)
    value = math.exp(value) if table.log else value
    return round(value) if table.is_whole else value


def _ends(table: VaryTable) -> tuple[float, float]:
    """Ends of a range, in the logarithm where it is sampled in that."""
    assert table.lower is not None
    assert table.upper is not None
    lower, upper = table.lower, table.upper
    return (math.log(lower), math.log(upper)) if table.log else (float(lower), float(upper))


def repeats_of(study: Study) -> list[Sample]:
    """Resolutions of every sample, the finest last: each key over its values, others at their
    finest, as for `flowborne.error_bar`."""
    finest = {table.key: table.values[-1] for table in study.repeat}
    coarser = [{**finest, table.key: n} for table in study.repeat for n in table.values[:-1]]
    return [*coarser, finest]


def count_samples(study: Study) -> int:
    """Number of samples. Raises SceneError where they make too many runs."""
    if study.sample.kind == "grid":
        samples = math.prod(len(table.values) or table.count or 1 for table in study.vary)
    else:
        samples = study.sample.count or 0
    runs = samples * len(repeats_of(study))
    if runs > MOST_RUNS:
        raise SceneError(
            f"study {study.name} has {runs} runs, and {MOST_RUNS} are the most. "
            "Give fewer values, or a smaller count."
        )
    return samples


class Optimiser:
    """Asks Optuna for batches of samples, and tells it the results.

    A batch is proposed from all results of earlier batches, whatever the order in which its own
    runs end.

    raises  SceneError when Optuna is not installed
    """

    def __init__(self, study: Study) -> None:
        optuna = optional("optuna", "Optuna", "study", "optimisations")
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        how = study.sample
        if how.kind == "nsga-ii":
            sampler = optuna.samplers.NSGAIISampler(population_size=how.batch, seed=how.seed)
        else:
            sampler = optuna.samplers.TPESampler(seed=how.seed, constant_liar=True)
        self._failed = optuna.trial.TrialState.FAIL
        self._study = optuna.create_study(
            directions=[DIRECTIONS[str(table.goal)] for table in study.goals], sampler=sampler
        )
        self._tables = study.vary
        self._batch = how.batch
        self._trials: list[Any] = []

    def ask(self, most: int) -> list[Sample]:
        """The next samples: a batch, and no more than `most`."""
        self._trials = [self._study.ask() for _ in range(min(self._batch, most))]
        return [
            {table.key: _suggested(trial, table) for table in self._tables}
            for trial in self._trials
        ]

    def tell(self, results: Sequence[tuple[float, ...]]) -> None:
        """The goals' values of each sample of the last batch; nan for a failed one."""
        for trial, values in zip(self._trials, results, strict=True):
            if all(map(math.isfinite, values)):
                self._study.tell(trial, values)
            else:
                self._study.tell(trial, state=self._failed)


def _suggested(trial: Any, table: VaryTable) -> Any:
    if table.values:
        return table.values[trial.suggest_categorical(table.key, range(len(table.values)))]
    suggest = trial.suggest_int if table.is_whole else trial.suggest_float
    return suggest(table.key, table.lower, table.upper, log=table.log)
