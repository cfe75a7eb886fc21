"""Fixtures that several folders share."""

import os
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest
from hypothesis import settings
from threadpoolctl import threadpool_limits

from flowborne.kernels import jit
from flowborne.machine import cores, end_with_parent

TESTS = Path(__file__).parent

PROCESSES = str(TESTS / "processes")
"""Folder of a module that every Python imports first which the tests start, pytest's workers among
them. One that only imports flowborne takes 1.07 s of CPU in place of 1.50 s with it."""

os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [PROCESSES, os.environ.get("PYTHONPATH")]))

settings.register_profile("same every time", derandomize=True, deadline=None)
settings.load_profile("same every time")

MODEL = """
<mujoco>
  <worldbody>
    <body name="block">
      <joint name="hinge" type="hinge" axis="0 0 1" limited="false"/>
      <geom name="block" type="box" size="0.5 0.1 1" pos="0.5 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""

SCENE = """
name = "small"
dimensions = 2

[time]
frames_per_second = 24.0
frames = 12
steps_per_frame = 2

[solids]
model = "block.xml"
density = 100.0

[initial]
positions = { hinge = 60.0 }

[[wind]]
kind = "faces"
velocity = [5.0, 0.0]
density = 1.2

[[control]]
joints = ["hinge"]
strength = 60.0
probe = 5.0

[[objectives]]
kind = "wind-drag"
goal = "least"
direction = [1.0, 0.0]
bodies = ["block"]

[output]
checkpoint_every = 5
"""


FIRST = "coupling/test_flux_form.py"
"""What compiles nearly all of a step in a fluid. While one process does that, another one takes
what needs little of it, and neither compiles what the other does."""

DRY = (
    "characters",
    "solids",
    "base",
    "runs",
    "motion",
    "scenes/test_load.py",
    "scenes/test_capture.py",
    "scenes/test_check.py",
    "scenes/test_human_scenes.py",
    "validation/test_human.py",
    "shapes",
    "view",
)
"""Folders and files whose tests need little of a fluid, those that need none first."""

WET = "characters/test_folder.py", "solids/tissue/test_symmetry.py"
"""Files in there that need all of a step."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files in the order in which processes take them up: see FIRST; then those of most tests."""
    tests = Counter(item.path for item in items)

    def order(item: pytest.Item) -> tuple[int, int, str]:
        path = item.path.relative_to(TESTS).as_posix()
        dry = (n for n, start in enumerate(DRY) if path.startswith(start) and path not in WET)
        place = -1 if path == FIRST else next(dry, len(DRY))
        return place, -tests[item.path], path

    items.sort(key=order)


def pytest_xdist_auto_num_workers() -> int:
    """Test processes side by side: one a core, but no more than memory has room for."""
    return min(cores(), 4)


@pytest.fixture(scope="session", autouse=True)
def share_of_the_cores() -> Iterator[None]:
    """Kernels of a test run on its process's share of the cores and BLAS on one thread, as in a
    validation: threads of BLAS that wait spin, on a core that another process needs.

    Of the session, so that it holds for its fixtures, whose kernels would compile twins otherwise.
    """
    share = max(1, cores() // int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))
    with pytest.MonkeyPatch.context() as patch, threadpool_limits(limits=1, user_api="blas"):
        patch.setattr(jit, "cores", lambda: share)
        yield


@pytest.fixture
def small_scene(tmp_path):
    """Path of a wind-only scene with one hinge, which runs in milliseconds."""
    folder = tmp_path / "scene"
    folder.mkdir()
    (folder / "block.xml").write_text(MODEL)
    path = folder / "small.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs of a study are made by threads, which start at once."""
    made = "flowborne.studies.workers.ProcessPoolExecutor"
    monkeypatch.setattr(made, lambda most, **_: ThreadPoolExecutor(most))


@pytest.fixture(scope="session")
def two_processes() -> Iterator[ProcessPoolExecutor]:
    """What `Processes(2)` starts."""
    with ProcessPoolExecutor(2, get_context("spawn"), end_with_parent) as pool:
        yield pool


@pytest.fixture
def shared_processes(monkeypatch: pytest.MonkeyPatch, two_processes: ProcessPoolExecutor) -> None:
    """`Processes(2)` finds its workers started, and leaves them to the next test: each takes 2 s
    until it has the kernels of a step. That it starts and stops its own is held by
    tests/control/test_executors.py and tests/test_drills.py."""
    pool = "flowborne.control.executors.ProcessPoolExecutor"
    monkeypatch.setattr(pool, lambda *_: two_processes)
    monkeypatch.setattr(two_processes, "shutdown", lambda: None)
