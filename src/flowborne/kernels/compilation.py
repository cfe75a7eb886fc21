"""Watching Numba compile."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def compilation_watched(notify: Callable[[int], None]) -> Iterator[None]:
    """Call `notify(n)` when the n-th kernel begins to compile.

    Kernels that come from the cache of an earlier run are not compiled, and nothing is called.
    Calls come from whichever thread compiles.
    """
    from numba.core import event

    class Listener(event.Listener):
        compiled = 0

        def on_start(self, started: object) -> None:
            self.compiled += 1
            notify(self.compiled)

        def on_end(self, ended: object) -> None:
            """Nothing: only the beginning of a compilation is news."""

    listener = Listener()
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)
