"""Workers end with their parent, in the middle of a task and while they wait for one."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

BUSY = """
from flowborne_validation.running import side_by_side

if __name__ == "__main__":
    tasks = "__import__('os').getpid()", "__import__('time').sleep(600)"
    for _, pid in side_by_side(eval, tasks, 1, lambda task: None):
        print(pid, flush=True)
"""

IDLE = """
import time
from flowborne.control.executors import Processes

if __name__ == "__main__":
    print(*Processes(1).map(eval, ["__import__('os').getpid()"]), flush=True)
    time.sleep(600)
"""


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.parametrize("text", [BUSY, IDLE], ids=["busy", "idle"])
def test_no_worker_outlives_its_parent(text: str, tmp_path: Path) -> None:
    script = tmp_path / "parent.py"
    script.write_text(text)
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    worker = int(parent.stdout.readline())
    assert alive(worker)
    parent.kill()
    parent.wait()
    while alive(worker):
        time.sleep(0.05)
