"""Ctrl-C and SIGTERM while a run is written."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class Signals:
    """Ctrl-C and SIGTERM during a run: recorded, and raised only where that is safe.

    asked  whether one has arrived
    """

    def __init__(self) -> None:
        self.asked = False
        self._safe = False
        self._earlier: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Signals:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._earlier[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *raised: object) -> None:
        for number, handler in self._earlier.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: object) -> None:
        self.asked = True
        if self._safe:
            self._safe = False
            raise KeyboardInterrupt

    @contextmanager
    def interruptible(self) -> Iterator[None]:
        """Context that a signal ends by KeyboardInterrupt, also one that arrived before."""
        if self.asked:
            raise KeyboardInterrupt
        self._safe = True
        try:
            yield
        except Exception as error:
            # an interrupt becomes a SystemError while a kernel returns its result
            if not self.asked:
                raise
            raise KeyboardInterrupt from error
        finally:
            self._safe = False
