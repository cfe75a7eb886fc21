"""A simulation is advanced by one caller at a time."""

from __future__ import annotations

import threading


class Turn:
    """Context that one caller at a time can enter. A copy has not been entered.

    raises  RuntimeError on entering it a second time
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()

    def __enter__(self) -> None:
        if not self._lock.acquire(blocking=False):
            raise RuntimeError(
                "the simulation is being advanced already, by another thread or by its own policy: "
                "give each thread a Simulation of its own"
            )

    def __exit__(self, *raised: object) -> None:
        self._lock.release()

    def __deepcopy__(self, memo: object) -> Turn:
        return Turn()

    def __reduce__(self) -> str:
        raise TypeError(
            "a simulation cannot be pickled: give the other process its scene, and make a "
            "Simulation there"
        )
