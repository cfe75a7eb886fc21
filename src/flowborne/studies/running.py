"""A study from its file to its folder: run what is missing, then write table and page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from time import perf_counter

from filelock import FileLock, Timeout

from flowborne.base.arguments import COUNT, PATH, PROGRESS, TEXT, or_none, read, takes
from flowborne.base.atomic import write_text
from flowborne.base.extras import optional
from flowborne.base.progress import Progress, RunProgress, displayed
from flowborne.base.version import __version__
from flowborne.runs.run_folder import LOCK_NAME, RunFolderError, check_name, make_folder
from flowborne.scenes.load import load_scene
from flowborne.sim.simulation import Simulation
from flowborne.studies.members import Members, member_id, scene_digest
from flowborne.studies.page import write_page
from flowborne.studies.result import Row, StudyResult, measures_of, table_of, values_of
from flowborne.studies.sampling import Optimiser, Sample, count_samples, repeats_of, samples_of
from flowborne.studies.schema import OPTIMISERS, MeasureTable, Study, load_study, toml_text
from flowborne.studies.workers import DaskWorkers, Task, Workers

COPY, TABLE, MEMBERS = "study.toml", "result.parquet", "members"
"""Files in the folder of a study: its copy, which marks the folder, the table, the runs."""


@dataclass(frozen=True)
class Plan:
    """A study ready to start.

    study     as in its file
    text      of the file
    measures  of each run
    columns   of the history of its scene
    digest    of its scene
    samples   number of samples
    repeats   resolutions of each sample, the finest last
    """

    study: Study
    text: str
    measures: tuple[MeasureTable, ...]
    columns: tuple[str, ...]
    digest: str
    samples: int
    repeats: list[Sample]

    @classmethod
    def of(cls, file: str | Path) -> Plan:
        """The plan of a study file. Raises SceneError with all that is wrong with it."""
        study = load_study(file)
        samples = count_samples(study)
        settings = study.overrides()
        with Simulation(load_scene(study.scene, settings), workers=1) as simulation:
            columns = simulation.columns.names
        return cls(
            study,
            Path(file).read_text(encoding="utf-8-sig"),
            measures_of(study, columns, Path(file).name),
            tuple(columns),
            scene_digest(study.scene, settings),
            samples,
            repeats_of(study),
        )

    @property
    def runs(self) -> int:
        return self.samples * len(self.repeats)

    def __str__(self) -> str:
        """The number of runs, in a line."""
        frames = load_scene(self.study.scene, self.study.overrides()).time.frames
        repeated = f" x {len(self.repeats)} resolutions" if len(self.repeats) > 1 else ""
        return (
            f"study {self.study.name}: {self.samples} samples{repeated} = {self.runs} runs "
            f"of scene {Path(self.study.scene).stem}, {frames} frames each unless a key changes it"
        )

    def settings(self, sample: Sample, repeat: Sample) -> dict[str, str]:
        """TOML text of every key that a run changes in the scene."""
        changed = {key: toml_text(value) for key, value in {**sample, **repeat}.items()}
        return {**self.study.overrides(), **changed}

    def member(self, sample: Sample, repeat: Sample) -> str:
        """Name of the run of a sample with these resolutions."""
        return member_id(self.digest, self.settings(sample, repeat))


@takes(out=or_none(PATH), workers=or_none(COUNT), dask=or_none(TEXT), progress=or_none(PROGRESS))
def study(
    file: str | Path | Plan,
    out: str | Path | None = None,
    *,
    workers: int | None = None,
    dask: str | None = None,
    retry: bool = False,
    progress: Progress | bool | None = None,
) -> StudyResult:
    """Run a study, or what is missing of it, and write its table and page; see docs/studies.md.

    file      TOML file of the study, or the plan of one
    out       folder to write; studies/<name of the study> by default. Finished runs in it are not
              run again
    workers   runs at once; changes no number. One per core by default, and all of a cluster
    dask      address of the scheduler of a Dask cluster; without it processes of this machine are
              started. A script must then guard its start by `if __name__ == "__main__"`
    retry     repeat the runs that failed before
    progress  called when a run has ended; True shows it as the command line does
    returns   the table of all runs
    raises    SceneError if the study or its scene is wrong, a package is missing, or the cluster is
              lost; RunFolderError if `out` cannot be written or another process is writing there;
              KeyboardInterrupt after Ctrl-C. The same call then continues
    """
    plan = file if isinstance(file, Plan) else Plan.of(read(PATH, file, "file"))
    optional("pyarrow", "pyarrow", "study", "tables of studies", "written")
    folder = Path("studies") / plan.study.name if out is None else Path(out)
    with _locked(folder), displayed(progress) as show:
        crew = Workers(workers) if dask is None else DaskWorkers(dask, workers)
        try:
            return _Job(plan, folder, crew, retry, show).run()
        finally:
            crew.close()


@dataclass
class _Job:
    """A study being run into its folder."""

    plan: Plan
    folder: Path
    workers: Workers
    retry: bool
    progress: Progress | None
    finished: set[str] = field(default_factory=set)
    rows: list[Row] = field(default_factory=list)
    began: float = field(default_factory=perf_counter)

    @cached_property
    def members(self) -> Members:
        return Members(self.folder / MEMBERS)

    def run(self) -> StudyResult:
        plan = self.plan
        write_text(self.folder / COPY, plan.text)
        if plan.study.sample.kind in OPTIMISERS:
            optimiser = Optimiser(plan.study)
            places = [plan.measures.index(table) for table in plan.study.goals]
            while left := plan.samples - len(self.rows) // len(plan.repeats):
                rows = self._run(optimiser.ask(left))
                finest = [row for row in rows if row.is_finest]
                optimiser.tell([tuple(row.values[n] for n in places) for row in finest])
        else:
            self._run(samples_of(plan.study))
        result = table_of(plan.study, plan.measures, self.rows, self.folder)
        result.write(
            self.folder / TABLE,
            {"study": plan.text, "scene": plan.study.scene, "flowborne": __version__},
        )
        write_page(result, plan.study, str(plan))
        return result

    def _run(self, samples: Sequence[Sample]) -> list[Row]:
        """Run the members of some samples that are not finished; the rows of all of them."""
        plan, members = self.plan, self.members
        runs = [(sample, repeat) for sample in samples for repeat in plan.repeats]
        names = [plan.member(*one) for one in runs]
        tasks: dict[str, Task] = {}
        for name, one in zip(names, runs, strict=True):
            ended = None if name in tasks else members.get(name)
            if ended and self.retry and not ended.is_complete and name not in self.finished:
                members.forget(name)
                ended = None
            if ended is None:
                tasks[name] = (plan.study.scene, plan.settings(*one))
            else:
                self.finished.add(name)
        self._show(names)
        for name, ended, history in self.workers.done(tasks):
            members.keep(name, ended, history)
            self.finished.add(name)
            self._show(names)
        first = len(self.rows) // len(plan.repeats)
        rows = [
            self._row(first + number // len(plan.repeats), name, one)
            for number, (name, one) in enumerate(zip(names, runs, strict=True))
        ]
        self.rows += rows
        return rows

    def _row(self, sample: int, name: str, run: tuple[Sample, Sample]) -> Row:
        plan, ended = self.plan, self.members.get(name)
        assert ended is not None
        values = (float("nan"),) * len(plan.measures)
        if ended.is_complete:
            values = values_of(self.members, name, plan.measures, plan.columns)
        return Row(sample, name, {**run[0], **run[1]}, run[1] == plan.repeats[-1], ended, values)

    def _show(self, batch: Sequence[str]) -> None:
        """Report the number of finished runs: all of earlier batches, and those of this one."""
        if self.progress is not None:
            done = len(self.rows) + sum(name in self.finished for name in batch)
            seconds = perf_counter() - self.began
            self.progress(RunProgress("member", done, self.plan.runs, seconds))


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Context in which no other process writes this study.

    raises  RunFolderError when one does, or the folder is not that of a study
    """
    check_name(folder)
    found = [entry.name for entry in folder.iterdir()] if folder.is_dir() else []
    if COPY not in found and not all(name.startswith(".") for name in found):
        raise RunFolderError(
            f"{folder} is not empty and was not made by a study; name another folder"
        )
    make_folder(folder)
    try:
        with FileLock(folder / LOCK_NAME, blocking=False):
            yield
    except Timeout:
        raise RunFolderError(
            f"another process is writing the study in {folder}; wait for its end, or name another "
            "folder"
        ) from None
