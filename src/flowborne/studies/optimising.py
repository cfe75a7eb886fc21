"""Samples proposed by Optuna from the results of earlier ones.

A sampler with a seed proposes the same samples for the same results, so that nothing of it is kept:
a study that goes on asks again from the start, and finds the results on the disc.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from flowborne.base.extras import optional
from flowborne.studies.sampling import Sample
from flowborne.studies.schema import Study, VaryTable

DIRECTIONS = {"least": "minimize", "most": "maximize"}


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
