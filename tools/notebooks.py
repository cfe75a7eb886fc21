"""Notebooks of pages, in docs/notebooks: `make notebooks` makes and runs them.

The tests run the code of these pages. jupytext turns a page into a notebook in which a block that
is a file is a cell that writes it, and commands that end by themselves are a cell of a shell.
"""

from __future__ import annotations

import os
import re
import sys
import time
from pathlib import Path

from committed import ROOT

NOTEBOOKS = ROOT / "docs" / "notebooks"
PAGES = ("first-creature", "own-objective", "own-controller")

INSTALL = """```python
import importlib.util

if importlib.util.find_spec("flowborne") is None:
    %pip install --quiet "flowborne[film,gym]"
```
"""
"""The first cell: a kernel on the web has no flowborne."""

FILE = re.compile(r"^`([\w.-]+)`:\n\n```\w+\n(.*?)^```$", re.M | re.S)
SHELL = re.compile(r"^```bash\n(.*?)^```$", re.M | re.S)
LINK = re.compile(r"\]\((?!https?://|#)")
MADE = re.compile(r"^<!-- made by .*\n", re.M)

ENDS = re.compile(r"flowborne (?:check|export|film|run|scenes) ?")
"""A command that ends by itself."""


def notebook(page: str) -> str:
    """A page as a notebook without outputs, as JSON."""
    import jupytext

    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    text = FILE.sub(r"```python\n%%writefile \1\n\2```", MADE.sub("", text))
    text = LINK.sub("](../", SHELL.sub(shell, text))
    title, rest = text.split("\n", 1)
    made = jupytext.reads(f"{title}\n\n{INSTALL}{rest}", fmt="md")
    made.metadata = {"kernelspec": {"name": "python3", "display_name": "Python 3"}}
    for number, cell in enumerate(made.cells):
        cell.id = f"{page}-{number}"
        cell.metadata = {}
    return str(jupytext.writes(made, fmt="ipynb")) + "\n"


def shell(found: re.Match[str]) -> str:
    """A block of commands: a cell with those that end by themselves, or none if none does."""
    commands = [line for line in found[1].splitlines() if ENDS.match(line)]
    said = "\n".join(commands)
    return f"```bash\n{said}\n```" if commands else f"```\n{found[1]}```"


def buttons(page: str) -> str:
    """Links to the notebook of a page; also to where it runs on the web, in pages of a repository
    of GitHub, whose name GitHub's and Read the Docs' machines give."""
    file = f"docs/notebooks/{page}.ipynb"
    links = [f"{{download}}`As a notebook <notebooks/{page}.ipynb>`"]
    address = os.environ.get("READTHEDOCS_GIT_CLONE_URL", "").removesuffix(".git")
    name = os.environ.get("GITHUB_REPOSITORY") or address.partition("github.com/")[2]
    if name:
        colab = f"https://colab.research.google.com/github/{name}/blob/main/{file}"
        binder = f"https://mybinder.org/v2/gh/{name}/main?labpath={file}"
        links += [f"[Open in Colab]({colab})", f"[Open in Binder]({binder})"]
    return " · ".join(links)


def write() -> None:
    """Make the notebooks, and run each in a folder of its own below build/notebooks."""
    import nbformat
    from nbclient import NotebookClient

    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    NOTEBOOKS.mkdir(exist_ok=True)
    for page in PAGES:
        text, start = notebook(page), time.monotonic()
        (NOTEBOOKS / f"{page}.ipynb").write_text(text, encoding="utf-8")
        run = nbformat.reads(text, as_version=4)
        folder = ROOT / "build" / "notebooks" / time.strftime(f"{page}-%Y%m%d-%H%M%S")
        folder.mkdir(parents=True)
        NotebookClient(run, timeout=None, resources={"metadata": {"path": str(folder)}}).execute()
        nbformat.write(run, folder / f"{page}.ipynb")
        print(f"{folder / page}.ipynb ran in {time.monotonic() - start:.0f} s")


if __name__ == "__main__":
    write()
