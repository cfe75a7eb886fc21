"""Processes that work for another one, and end with it, however it ends."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time

GRACE = 10.0
"""Seconds that a process has to clean up once it is told to end."""


def end_with_parent() -> None:
    """Let this process, a child of multiprocessing's, end when its parent has.

    A pool's worker that waits for work would wait for ever: it holds both ends of the queue.
    """
    threading.Thread(target=_outlive_no_parent, daemon=True).start()


def _outlive_no_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None, "this process is nobody's worker"
    parent.join()
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE)
    os._exit(1)
