"""A study that is killed loses nothing and does nothing twice, on a cluster that changes."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flowborne as fb
from flowborne.studies import workers

distributed = pytest.importorskip("distributed")

RUNS = 24
COMMAND = [sys.executable, "-m", "flowborne", "study"]
PATIENCE = 120.0
"""Most seconds that anything here takes."""


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A worker in this process, which need not import flowborne again."""
    one = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "protocol": "tcp"}
    with distributed.LocalCluster(**one, dashboard_address=None) as made:
        yield made


def waited_for(condition: Callable[[], object]) -> None:
    """Wait until something holds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def finished(folder: Path) -> dict[str, int]:
    """File of each finished member -> when it was written, ns."""
    return {path.name: path.stat().st_mtime_ns for path in folder.glob("members/*.json")}


def killed_after(runs: int, command: list[str], folder: Path) -> dict[str, int]:
    """Kill a study at once when so many runs are finished; those that are."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    waited_for(lambda: len(finished(folder)) >= runs or process.poll() is not None)
    assert process.poll() is None, "the study ended before it could be killed"
    process.kill()
    process.wait()
    return finished(folder)


def test_a_study_killed_three_times_on_a_cluster_is_as_an_undisturbed_one(
    study_file: Path, tmp_path: Path, cluster: Any, in_this_process: None
) -> None:
    text = study_file.read_text().replace("count = 12", f"count = {RUNS}")
    study_file.write_text(text)
    folder = tmp_path / "killed"
    address = cluster.scheduler_address
    command = [*COMMAND, str(study_file), "--out", str(folder), "--dask", address]
    before: dict[str, int] = {}
    for part in (1, 2, 3):
        now = killed_after(part * RUNS // 5, command, folder)
        assert before.items() <= now.items()
        before = now
    another = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1",
         "--no-dashboard", "--local-directory", str(tmp_path)],
        stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        waited_for(lambda: len(cluster.scheduler_info["workers"]) == 2)
        whole = fb.study(study_file, folder, dask=address)
    finally:
        another.terminate()
        another.wait()
    assert before.items() <= finished(folder).items()
    assert len(finished(folder)) == len(whole) == RUNS
    undisturbed = fb.study(study_file, tmp_path / "undisturbed", workers=1)
    assert (folder / "result.parquet").read_bytes() == (
        undisturbed.folder / "result.parquet"
    ).read_bytes()
    assert set(whole.columns["outcome"]) == {"done"}


def test_any_number_of_workers_gives_the_same_bits(study_file: Path, tmp_path: Path) -> None:
    tables = {
        (fb.study(study_file, tmp_path / str(n), workers=n).folder / "result.parquet").read_bytes()
        for n in (1, 2)
    }
    assert len(tables) == 1


DEADLY = """
import os, signal
from pathlib import Path
from flowborne.studies.members import run_member as run

def run_member(scene, settings, threads):
    if settings["initial.positions.along"] == "1.25" and not Path("mended").exists():
        os.kill(os.getpid(), signal.SIGKILL)
    return run(scene, settings, threads)
"""


def test_a_run_whose_process_dies_fails_alone_and_is_repeated_on_request(
    study_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "deadly.py").write_text(DEADLY)
    monkeypatch.setattr(workers, "run_member", import_module("deadly").run_member)
    text = study_file.read_text().replace("lower = 0.5\nupper = 2.0", "values = [0.5, 1.25, 2.0]")
    study_file.write_text(text.split("[sample]")[0].replace("[10.0, 20.0]", "[10.0]"))
    found = fb.study(study_file, workers=1)
    assert found.columns["outcome"].tolist() == ["done", "failed", "done"]
    assert np.isnan(found.columns["end"]).tolist() == [False, True, False]
    assert set(found.failed.values()) == {"the process of this run died; perhaps memory was short"}
    before = finished(found.folder)
    assert fb.study(study_file, workers=1).failed == found.failed
    assert finished(found.folder) == before
    (tmp_path / "mended").touch()
    whole = fb.study(study_file, workers=1, retry=True)
    assert not whole.failed
    again = {name for name, at in finished(found.folder).items() if at != before[name]}
    assert again == {f"{name}.json" for name in found.failed}
