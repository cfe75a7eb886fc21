"""Workers end with their parent, in the middle of a task and while they wait for one."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

PARENT = """
from flowborne.control.executors import Processes
from flowborne_validation.running import side_by_side

if __name__ == "__main__":
    pid = "__import__('os').getpid()"
    idle = Processes(1)
    (waiting,) = idle.map(eval, [pid])
    tasks = pid, "__import__('time').sleep(600)"
    for _, busy in side_by_side(eval, tasks, 1, lambda task: None):
        print(waiting, busy, flush=True)
"""


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_no_worker_outlives_its_parent(tmp_path: Path) -> None:
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    workers = [int(pid) for pid in parent.stdout.readline().split()]
    assert len(workers) == 2
    assert all(map(alive, workers))
    parent.kill()
    parent.wait()
    while any(map(alive, workers)):
        time.sleep(0.05)
