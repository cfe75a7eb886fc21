"""What describes the package says the same everywhere."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import yaml
from packaging.requirements import Requirement

from dist import SUPPORTED

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))


def test_zenodo_has_what_the_citation_has() -> None:
    zenodo = json.loads((ROOT / ".zenodo.json").read_text("utf-8"))
    assert zenodo["title"] == CITATION["title"] == PROJECT["name"]
    assert zenodo["license"] == CITATION["license"] == PROJECT["license"]
    assert zenodo["keywords"] == CITATION["keywords"]
    assert zenodo["description"] == CITATION["abstract"]
    assert zenodo["creators"] == [{"name": one["name"]} for one in CITATION["authors"]]


def test_the_conda_recipe_requires_what_the_wheel_does() -> None:
    """conda-forge has MuJoCo for Python by another name."""
    recipe = yaml.safe_load((ROOT / "conda/recipe.yaml").read_text("utf-8"))
    wanted = {"python": PROJECT["requires-python"]}
    for text in PROJECT["dependencies"]:
        requirement = Requirement(text)
        name = requirement.name.replace("mujoco-core", "mujoco-python")
        wanted[name] = str(requirement.specifier)
    found = dict(line.split(" ", 1) for line in recipe["requirements"]["run"])
    assert found.keys() == wanted.keys()
    for name, bounds in found.items():
        assert set(bounds.split(",")) == set(wanted[name].split(",")), name


def test_versions_of_python_that_are_tested_are_those_that_are_named() -> None:
    named = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["classifiers"]))
    workflow = yaml.safe_load((ROOT / ".github/workflows/test.yml").read_text("utf-8"))
    tested = workflow["jobs"]["test"]["strategy"]["matrix"]["python"]
    assert tuple(named) == tuple(tested) == SUPPORTED


def test_every_action_is_pinned_by_hash() -> None:
    workflows = sorted((ROOT / ".github/workflows").glob("*.yml"))
    used = [
        line.split("uses:")[1].strip()
        for path in workflows
        for line in path.read_text("utf-8").splitlines()
        if "uses:" in line
    ]
    assert len(used) > 15
    assert all(re.fullmatch(r"[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", one) for one in used), used
