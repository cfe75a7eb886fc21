"""A study, as in its TOML file: the scene, the keys that vary, and what is measured."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import tomli_w
from pydantic import BeforeValidator, Field, ValidationError, model_validator

from flowborne.base.errors import SceneError
from flowborne.base.phrases import suggestion
from flowborne.base.tables import Count, Number, PlainName, Positive, Table, Text, WholeNumber
from flowborne.scenes.draft import explain
from flowborne.scenes.load import load_scene, read_tables

OPTIMISERS = ("nsga-ii", "tpe")
"""Kinds of sampling that look for the goals."""


def _finite(value: Any) -> Any:
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise ValueError(f"is {value!r}. Give a finite number without quotes")
    return value


End = Annotated[int | float, BeforeValidator(_finite)]
"""End of a range, which stays a whole number if it is one."""


class VaryTable(Table):
    """[[vary]]: a key of the scene that differs between samples.

    key     dotted, as for `flowborne run --set`
    values  list of its values
    lower   smallest value of a range; only whole numbers are drawn if both ends are whole
    upper   largest value of the range
    count   number of values in the range for a grid
    log     whether the range is sampled evenly in the logarithm
    """

    key: Text
    values: tuple[Any, ...] = ()
    lower: End | None = None
    upper: End | None = None
    count: Count | None = None
    log: bool = False

    @model_validator(mode="after")
    def _check(self) -> Self:
        if bool(self.values) == (self.lower is not None and self.upper is not None):
            raise ValueError("needs either values, or lower and upper. Give one of the two")
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            raise ValueError(f"has lower {self.lower:g} and upper {self.upper:g}. Exchange them")
        if self.log and self.lower is not None and self.lower <= 0:
            raise ValueError(f"has log = true and lower {self.lower:g}. Give a lower above 0")
        return self

    @property
    def is_whole(self) -> bool:
        """Whether the key has a range of whole numbers."""
        return isinstance(self.lower, int) and isinstance(self.upper, int)

    def ends(self) -> tuple[Any, ...]:
        """Values to check before the study starts: all of a list, both ends of a range."""
        return self.values or (self.lower, self.upper)


class RepeatTable(Table):
    """[[repeat]]: a resolution with which each sample is repeated, for an error bar.

    key     dotted: "domain.resolution", "time.steps_per_frame"
    values  from coarse to fine; three or more give an order of convergence
    """

    key: Text
    values: tuple[Positive | Count, ...]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.values) < 2 or sorted(set(self.values)) != list(self.values):
            raise ValueError(f"has values {list(self.values)}. Give two or more, ascending")
        return self


class MeasureTable(Table):
    """[[measure]]: a number of each run.

    name    of its column in the result
    column  of the history; with `*` the sum of all columns that match: "power_*_W"
    take    how a number is taken of the frames
    after   only frames later than this count, s
    factor  of the number, e.g. -1 for a swimmer that moves towards negative x
    goal    what an optimisation looks for
    """

    name: PlainName
    column: Text
    take: Literal["mean", "rms", "last", "least", "greatest"] = "mean"
    after: Number = 0.0
    factor: Number = 1.0
    goal: Literal["least", "most"] | None = None


class SampleTable(Table):
    """[sample]: how the keys are sampled.

    kind   "grid": all combinations; "random", "latin-hypercube"; "nsga-ii", "tpe": optimisation by
           Optuna
    count  number of samples of all kinds but a grid
    seed   of the random numbers
    batch  samples that an optimiser proposes at once, which can run in parallel; the population of
           "nsga-ii"
    """

    kind: Literal["grid", "random", "latin-hypercube", "nsga-ii", "tpe"] = "grid"
    count: Count | None = None
    seed: WholeNumber = 0
    batch: Count = 8

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.kind == "grid" and self.count is not None:
            raise ValueError("has a count, but its kind is a grid of all values. Remove the count")
        if self.kind != "grid" and self.count is None:
            raise ValueError(f"of kind '{self.kind}' has no count. Give a number of samples")
        if self.kind == "nsga-ii" and self.batch < 2:
            raise ValueError("of kind 'nsga-ii' has batch 1. Give a population of 2 or more")
        return self


class Study(Table):
    """A study, checked and with every default filled in.

    name      of the study; its folder is studies/name
    scene     name of a built-in scene, or path of a scene file from the folder of the study
    settings  dotted key -> value that all runs of the scene have
    """

    name: PlainName
    scene: Text
    settings: dict[str, Any] = Field(default_factory=dict)
    vary: tuple[VaryTable, ...] = Field(min_length=1)
    repeat: tuple[RepeatTable, ...] = ()
    measure: tuple[MeasureTable, ...] = ()
    sample: SampleTable = SampleTable()

    @model_validator(mode="after")
    def _check(self) -> Self:
        keys = [*self.overrides(), *self.keys]
        names = [table.name for table in self.measure]
        for what, all_of_them in (("key", keys), ("measure", names)):
            twice = [name for name in all_of_them if all_of_them.count(name) > 1]
            if twice:
                raise ValueError(f"has the {what} '{twice[0]}' twice. Remove one")
        if self.sample.kind in OPTIMISERS and not self.goals:
            raise ValueError(
                f"has [sample] kind '{self.sample.kind}' and no goal. "
                'Give a [[measure]] goal = "most" or "least"'
            )
        if self.sample.kind == "grid":
            for table in self.vary:
                if not table.values and table.count is None:
                    raise ValueError(
                        f"is a grid and key '{table.key}' a range. Give its number of values, count"
                    )
        return self

    @property
    def keys(self) -> list[str]:
        """Keys that differ between runs."""
        return [*(table.key for table in self.vary), *(table.key for table in self.repeat)]

    @property
    def goals(self) -> tuple[MeasureTable, ...]:
        """Measures with a goal."""
        return tuple(table for table in self.measure if table.goal is not None)

    def overrides(self) -> dict[str, str]:
        """Dotted key -> TOML text of `settings`; nested tables are dotted keys."""
        found: dict[str, str] = {}
        level = [("", self.settings)]
        while level:
            start, table = level.pop()
            for key, value in table.items():
                if isinstance(value, dict):
                    level.append((f"{start}{key}.", value))
                else:
                    found[f"{start}{key}"] = toml_text(value)
        return found


def toml_text(value: Any) -> str:
    """A value as TOML, as `load_scene` takes it; numbers read back exactly."""
    return tomli_w.dumps({"value": value}).removeprefix("value = ").rstrip("\n")


def load_study(path: str | Path) -> Study:
    """The study of a TOML file, checked whole, with the values of its keys one by one.

    raises  SceneError with all problems
    """
    path = Path(path)
    if not path.is_file():
        raise SceneError(f"there is no study file {path}. Correct the path.")
    raw = read_tables(path, "study")
    raw.setdefault("name", path.stem)
    try:
        study = Study.model_validate(raw)
    except ValidationError as error:
        said = dict.fromkeys(explain(one, raw, path.name, Study) for one in error.errors())
        raise SceneError(list(said)) from None
    if Path(study.scene).suffix == ".toml":
        study = study.model_copy(update={"scene": str((path.parent / study.scene).absolute())})
    problems = problems_of(study, f"study {path.name}")
    if problems:
        raise SceneError(problems)
    return study


def problems_of(study: Study, where: str) -> list[str]:
    """What is wrong with the values that a study gives to keys of its scene, each tried alone."""
    try:
        scene = load_scene(study.scene, study.overrides())
    except SceneError as error:
        return [f"{where}, its scene or [settings]: {problem}" for problem in error.problems]
    tried = [("vary", n, table.key, table.ends()) for n, table in enumerate(study.vary, 1)]
    tried += [("repeat", n, table.key, table.values) for n, table in enumerate(study.repeat, 1)]
    problems = []
    for kind, number, key, values in tried:
        at = f"{where}, [[{kind}]] {number}, key '{key}'"
        start, _, name = key.partition(".")
        if start == "constants" and name not in scene.constants:
            end = suggestion(name, scene.constants, "Its constants are")
            problems.append(f"{at}: the scene has no constant '{name}'{end}")
        else:
            wrong = (_wrong(study, key, value, at) for value in values)
            problems += next(filter(None, wrong), [])
    return problems


def _wrong(study: Study, key: str, value: Any, at: str) -> list[str]:
    text = toml_text(value)
    try:
        load_scene(study.scene, {**study.overrides(), key: text})
    except SceneError as error:
        return [f"{at} = {text}: {problem}" for problem in error.problems]
    return []
