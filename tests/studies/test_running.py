"""What a study finds: numbers, error bars, optima, and its files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import flowborne as fb
from flowborne.base.progress import RunProgress
from flowborne.cli import main as cli
from flowborne.studies import workers
from flowborne.studies.members import Ended, run_member

pytestmark = pytest.mark.usefixtures("in_this_process")

REPEAT = '[[repeat]]\nkey = "time.steps_per_frame"\nvalues = [8, 16, 32]\n[sample]'
"""Makes an error bar of each sample."""


def replaced(path: Path, *pairs: tuple[str, str]) -> Path:
    text = path.read_text()
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


def test_each_run_has_the_number_of_its_keys(study_file: Path, tmp_path: Path) -> None:
    """A mass on a spring of 2 rad/s, let go: x0 cos(2 t); its error bar contains that."""
    news: list[RunProgress] = []
    replaced(study_file, ("[sample]", REPEAT), ("count = 12", "count = 2"))
    found = fb.study(study_file, tmp_path / "out", workers=1, progress=news.append)
    assert len(found) == 6
    assert [(one.frame, one.frames) for one in news] == [(n, 6) for n in range(7)]
    finest = found.columns["finest"]
    assert finest.tolist() == [False, False, True] * 2
    start = found.columns["initial.positions.along"][finest]
    end = 4.0 / found.columns["time.frames_per_second"][finest]
    error = np.abs(found.columns["end"][finest] - start * np.cos(2.0 * end))
    assert (error < found.columns["end_bar"][finest]).all()
    assert np.isnan(found.columns["end_bar"][~finest]).all()
    assert found.units["end"] == found.units["end_bar"] == "m"


def test_the_table_has_units_and_the_page_says_what_it_is_of(
    study_file: Path, tmp_path: Path
) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    replaced(study_file, ("count = 12", "count = 3"), ('goal = "least"', ""))
    found = fb.study(study_file, tmp_path / "out", workers=1)
    table = parquet.read_table(tmp_path / "out" / "result.parquet")
    assert table.field("end").metadata == {b"unit": b"m"}
    assert table["end"].to_pylist() == found.columns["end"].tolist()
    assert table.schema.metadata[b"study"].decode() == study_file.read_text()
    page = (tmp_path / "out" / "index.html").read_text()
    assert "3 samples = 3 runs of scene spring" in page
    assert page.count("<svg") == 2
    found.plot("initial.positions.along", "end", tmp_path / "plot.png")
    assert (tmp_path / "plot.png").stat().st_size > 1000
    with pytest.raises(ValueError, match=r"no column of numbers 'ende'; did you mean 'end'\?"):
        found.plot("sample", "ende", tmp_path / "plot.png")
    with pytest.raises(ValueError, match="the study has no goal"):
        found.front()


def test_without_measures_the_mean_of_every_column_is_taken(
    study_file: Path, tmp_path: Path
) -> None:
    text = study_file.read_text().replace("count = 12", "count = 1")
    start, rest = text.split("[[measure]]")
    study_file.write_text(start + "[sample]" + rest.split("[sample]")[1])
    found = fb.study(study_file, tmp_path / "out", workers=1)
    assert math.isfinite(found.columns["mean position_along_m"][0])
    assert not [name for name in found.columns if "seconds" in name]


@pytest.mark.parametrize("kind", ["tpe", "nsga-ii"])
def test_an_optimiser_finds_the_least_and_continues_where_it_was(
    study_file: Path, tmp_path: Path, kind: str
) -> None:
    """The end x0 cos(0.8) is most for the greatest start, 2 m."""
    pytest.importorskip("optuna")
    replaced(
        study_file,
        ('"latin-hypercube"', f'"{kind}"\nbatch = 4'),
        ('goal = "least"', 'goal = "most"'),
        ("[10.0, 20.0]", "[10.0]"),
        ("count = 12", "count = 8"),
    )
    part = fb.study(study_file, tmp_path / "out", workers=1)
    replaced(study_file, ("count = 8", "count = 20"))
    news: list[RunProgress] = []
    whole = fb.study(study_file, tmp_path / "out", workers=2, progress=news.append)
    assert news[0].frame == 4, "the first batch is finished"
    assert whole.columns["end"][:8].tolist() == part.columns["end"].tolist()
    (best,) = whole.front()
    assert whole.columns["end"][best] == np.max(whole.columns["end"])
    assert whole.columns["initial.positions.along"][best] > 1.7


def test_of_two_goals_the_front_is_where_one_costs_the_other(
    study_file: Path, tmp_path: Path
) -> None:
    second = '[[measure]]\nname = "start"\ncolumn = "position_along_m"\ntake = "greatest"\n'
    second += 'goal = "most"\n[sample]'
    replaced(study_file, ("[sample]", second), ("[10.0, 20.0]", "[10.0]"), ("= 12", "= 5"))
    found = fb.study(study_file, tmp_path / "out", workers=1)
    assert found.front().tolist() == list(range(5))
    assert found.goals == {"end": "least", "start": "most"}


def command(*arguments: object) -> int | str | None:
    with pytest.raises(SystemExit) as left:
        cli.main([str(argument) for argument in arguments])
    return left.value.code


def test_the_command_states_the_runs_first_and_writes_only_then(
    study_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(workers, "CONNECT_SECONDS", 0.5)  # until no scheduler has answered
    for name in cli.BLAS_THREADS:
        monkeypatch.setenv(name, "1")
    replaced(study_file, ("count = 12", "count = 2"))
    assert command("study", study_file, "--check") == 0
    assert capsys.readouterr().out.startswith("study swing: 2 samples = 2 runs of scene spring")
    assert not (tmp_path / "studies").exists()
    options = ("--workers", 1, "--plot", "initial.positions.along,end")
    assert command("study", study_file, *options) == 0
    out = capsys.readouterr().out
    assert "drawn: studies/swing/end over initial.positions.along.svg" in out
    assert "written: studies/swing/result.parquet, studies/swing/index.html" in out
    for wrong, said in (
        (("--workers", 0), "workers is 0"),
        (("--plot", "end,ende"), "no column of numbers 'ende'"),
        (("--dask", "tcp://127.0.0.1:1"), "no Dask scheduler answers"),
        (("--out", tmp_path), "is not empty and was not made by a study"),
    ):
        assert command("study", study_file, *wrong) == 2
        assert said in capsys.readouterr().err


def blown_up_at_20_frames(
    scene: str, settings: dict[str, str], threads: int
) -> tuple[Ended, bytes] | None:
    if settings["time.frames_per_second"] == "20.0":
        return Ended("blew_up", "it blew up in frame 3"), b""
    return run_member(scene, settings, threads)


def test_failed_runs_are_named_and_end_with_1(
    study_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(workers, "run_member", blown_up_at_20_frames)
    replaced(
        study_file,
        ("lower = 0.5\nupper = 2.0", "values = [1.0]"),
        ('kind = "latin-hypercube"\ncount = 12\nseed = 3', ""),
    )
    assert command("study", study_file, "--workers", 1) == 1
    err = capsys.readouterr().err
    assert " failed: it blew up in frame 3" in err
    assert "1 of 2 runs failed; --retry repeats them" in err
    assert "Failed runs" in (tmp_path / "studies" / "swing" / "index.html").read_text()
