"""Notebooks are their pages: same code, in the same order. `make notebooks` runs them."""

from __future__ import annotations

import json

import pytest

import notebooks

from .blocks import blocks_of


@pytest.mark.parametrize("page", notebooks.PAGES)
def test_a_notebook_is_in_step_with_its_page(page: str) -> None:
    kept = (notebooks.NOTEBOOKS / f"{page}.ipynb").read_text(encoding="utf-8")
    assert kept == notebooks.notebook(page), "run `make notebooks`"


@pytest.mark.parametrize("page", notebooks.PAGES)
def test_its_cells_have_all_that_the_page_runs(page: str) -> None:
    cells = json.loads(notebooks.notebook(page))["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"][1:]
    wanted = []
    for block in blocks_of(notebooks.ROOT / "docs" / f"{page}.md"):
        if block.file:
            wanted.append(f"%%writefile {block.file}\n{block.text}")
        elif block.language == "python":
            wanted.append(block.text)
        elif lines := [one for one in block.text.splitlines() if notebooks.ENDS.match(one)]:
            wanted.append("\n".join(["%%bash", *lines]))
    assert code == [text.rstrip("\n") for text in wanted]


def test_buttons_lead_to_the_repository_where_it_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("GITHUB_REPOSITORY", "READTHEDOCS_GIT_CLONE_URL"):
        monkeypatch.delenv(name, raising=False)
    assert "https://" not in notebooks.buttons("first-creature")
    file = "docs/notebooks/first-creature.ipynb"
    colab = f"https://colab.research.google.com/github/someone/fork/blob/main/{file}"
    binder = f"https://mybinder.org/v2/gh/someone/fork/main?labpath={file}"
    for name, value in {
        "GITHUB_REPOSITORY": "someone/fork",
        "READTHEDOCS_GIT_CLONE_URL": "https://github.com/someone/fork.git",
    }.items():
        with monkeypatch.context() as one:
            one.setenv(name, value)
            said = notebooks.buttons("first-creature")
            assert f"[Open in Colab]({colab})" in said
            assert f"[Open in Binder]({binder})" in said
