"""Every command, file and snippet of the pages works, in the order in which it stands there.

Each page has a folder of its own. The rule by which its commands are cut down, for time:

  flowborne run      2 frames, no film, and at most COARSE cells along the longest side
  FRAMES, GRIDS      in a piece of Python: 2, and (16, 24, 32)
  a study            2 samples, 2 frames, 24 cells, and grids as above

A run that a page takes for granted is made first. What no test can run is named in ELSEWHERE.
"""

from __future__ import annotations

import re
import shutil
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from flowborne.cli import main as cli
from flowborne.scenes.load import library
from flowborne.scenes.plugins import LOADED
from flowborne.scenes.schema import Scene
from flowborne.studies.schema import Study

from ..characters import rigged
from .blocks import Block, blocks_of

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
WITH_BLOCKS = [page for page in PAGES if blocks_of(page)]

COARSE = 40
"""Cells along the longest side."""

CUT = {
    re.compile(r"^FRAMES = .*$", re.M): "FRAMES = 2",
    re.compile(r"^GRIDS = .*$", re.M): "GRIDS = (16, 24, 32)",
}

STUDY = {
    re.compile(r"^count = .*$", re.M): "count = 2",
    re.compile(r"^time\.frames = .*$", re.M): "time.frames = 2",
    re.compile(r"^domain\.resolution = .*$", re.M): "domain.resolution = 24",
    re.compile(r"^values = \[61, 122, 244\]$", re.M): "values = [16, 24, 32]",
    re.compile(r"^after = .*$", re.M): "after = 0.0",
}
"""Of the file of a study, which has tables [[vary]]."""

ELSEWHERE = {
    "python3 -m venv": "makes an environment; `make demo` does that",
    "python -m venv": "makes an environment for Blender, which is no part of the tests",
    "blender/bin/": "Blender is no part of the tests",
    "make blender-sample": "installs Blender as a module",
    "pip install": "installs",
    "source": "is for a shell",
    "ssh": "needs another machine",
    "dask worker": "works until it is stopped; tests/studies/test_kills.py starts one",
    "flowborne view": "serves until it is stopped; tests/view/browser has its tests",
    "flowborne play": "serves until it is stopped; tests/play has its tests",
}
"""Beginning of a command that is not run -> why."""

GIVEN = ("fish-whale.glb", "shark-animations.glb", "character.glb")
"""Files that pages take for granted; a rigged box that swims stands in for each."""


def exempt(words: list[str]) -> str | None:
    """The entry of ELSEWHERE that a command is of, if any."""
    line = " ".join(words)
    return next((start for start in ELSEWHERE if line.startswith(start)), None)


def run(words: list[str]) -> None:
    """Run a command of flowborne's, which has to end well."""
    with pytest.raises(SystemExit) as ended:
        cli.main(words)
    assert ended.value.code == 0, f"flowborne {' '.join(words)}"


def cut_down(words: list[str]) -> list[str]:
    """The words of `flowborne run` as the rule has it."""
    kept, left = [], iter(words)
    for word in left:
        value = next(left) if word in ("--frames", "--set") else ""
        if word == "--set" and not value.startswith("domain.resolution="):
            kept += [word, value]
        elif word not in ("--frames", "--set"):
            kept.append(word)
    file = Path(words[1]) if words[1].endswith(".toml") else library() / f"{words[1]}.toml"
    domain = tomllib.loads(file.read_text(encoding="utf-8")).get("domain")
    if domain is not None:
        kept += ["--set", f"domain.resolution={min(COARSE, domain['resolution'])}"]
    return [*kept, "--frames", "2", "--no-film"]


def stand_in(path: Path) -> None:
    """A rigged box whose clip is called as that of the page."""
    gltf = pytest.importorskip("pygltflib")
    rigged.write_glb(path)
    character = gltf.GLTF2().load(str(path))
    character.animations[0].name = "Swim Horizontal"
    character.save(str(path))


def taken_for_granted(words: list[str]) -> Iterator[list[str]]:
    """Commands that make the run of which a command speaks."""
    if words[0] in ("film", "export") and not Path(words[1]).exists():
        yield cut_down(["run", Path(words[1]).name])


def obey(words: list[str], kept: Path) -> None:
    """Run a line of a page, cut down.

    kept  folder of runs of built-in scenes that other pages have made, too
    """
    for before in taken_for_granted(words):
        make(before, kept)
    if words[0] == "run":
        make(cut_down(words), kept)
    else:
        run(words)


def make(words: list[str], kept: Path) -> None:
    """Make a run, or take it from what was kept."""
    if words[1].endswith(".toml") or "--out" in words or any(".bvh" in word for word in words):
        run(words)
        return
    folder, copy = Path("runs") / words[1], kept / "_".join(words).replace("/", "_")
    if not copy.exists():
        run(words)
        shutil.copytree(folder, copy)
    elif not folder.exists():
        shutil.copytree(copy, folder)


def less_of(text: str, cuts: dict[re.Pattern[str], str]) -> str:
    """A text, cut down."""
    for pattern, less in cuts.items():
        text = pattern.sub(less, text)
    return text


def execute(text: str, module: ModuleType) -> None:
    """Run a piece of Python, cut down, with the names that those before it have left."""
    exec(compile(less_of(text, CUT), module.__name__, "exec"), module.__dict__)


def is_study(block: Block) -> bool:
    return "[[vary]]" in block.text


def check_snippet(block: Block) -> None:
    """A part of a scene or a study: its tables are known."""
    tables = set(tomllib.loads(block.text))
    assert tables <= set(Scene.model_fields) or tables <= set(Study.model_fields)


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("kept")


@pytest.fixture
def module(request: pytest.FixtureRequest) -> Iterator[ModuleType]:
    """What the pieces of Python of a page are in; plugins are forgotten after it."""
    made = ModuleType(f"page_{request.node.callspec.id}")
    sys.modules[made.__name__] = made
    yield made
    del sys.modules[made.__name__]
    for block in blocks_of(request.node.callspec.params["page"]):
        if block.file.endswith(".py"):
            sys.modules.pop(block.file[:-3], None)
            LOADED.pop(block.file[:-3], None)


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("page", WITH_BLOCKS, ids=[path.stem for path in WITH_BLOCKS])
def test_what_a_page_says_works(
    page: Path, module: ModuleType, kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = blocks_of(page)
    for name in GIVEN:
        if any(name in block.text for block in blocks):
            stand_in(tmp_path / name)
    for block in blocks:
        if block.file:
            text = less_of(block.text, STUDY) if is_study(block) else block.text
            Path(block.file).write_text(text, encoding="utf-8")
    checked = set()
    for block in blocks:
        for words in block.commands():
            if exempt(words) is None:
                assert words[0] == "flowborne", f"{words}: run it, or name it in ELSEWHERE"
                obey(words[1:], kept)
                checked.add(" ".join(words[1:3]))
        if block.language == "python" and not block.file:
            execute(block.text, module)
        elif block.language == "toml" and not block.file:
            check_snippet(block)
    for block in blocks:
        if block.file.endswith(".toml"):
            verb = "study" if is_study(block) else "check"
            assert f"{verb} {block.file}" in checked, f"{block.file}: `flowborne {verb}` it"


def test_no_exemption_is_out_of_date() -> None:
    commands = [words for page in PAGES for block in blocks_of(page) for words in block.commands()]
    assert {exempt(words) for words in commands} - {None} == set(ELSEWHERE)


@pytest.mark.parametrize("page", PAGES, ids=[path.stem for path in PAGES])
def test_modules_that_a_page_names_are_there(page: Path) -> None:
    paths = re.findall(r"`((?:src|tools|tests)/[\w./-]+)`", page.read_text(encoding="utf-8"))
    assert not [path for path in paths if not (ROOT / path).exists()]


def test_modules_name_every_page_of_the_method() -> None:
    pages = {path.relative_to(ROOT).as_posix() for path in (ROOT / "docs" / "method").glob("*.md")}
    text = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "src").rglob("*.py"))
    named = set(re.findall(r"^Method: (\S+\.md)\.$", text, re.MULTILINE))
    assert named == pages - {"docs/method/index.md"}
