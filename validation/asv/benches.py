"""Every figure of every bench, in the order in which `flowborne bench` prints them."""

from __future__ import annotations

from math import nan

from flowborne_validation.bench import bench_names, run_benches

FIGURES = 8
"""Most figures of a bench."""


class Benches:
    """A figure by the name of its bench and its number, counted from 1; nan beyond the last."""

    params = (bench_names(), range(1, FIGURES + 1))
    param_names = ("bench", "figure")
    timeout = 7200.0

    def setup_cache(self) -> dict[str, list[float]]:
        """Run each bench once, in one process as `flowborne bench` does."""
        found = {name: [row.value for row in run_benches([name])] for name in bench_names()}
        most = max(map(len, found.values()))
        if most > FIGURES:
            raise ValueError(f"a bench has {most} figures; make FIGURES as large")
        return found

    def track_figure(self, found: dict[str, list[float]], bench: str, figure: int) -> float:
        """The figure, in the unit of its title."""
        values = found[bench]
        return values[figure - 1] if figure <= len(values) else nan
