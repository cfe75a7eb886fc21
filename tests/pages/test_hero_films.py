"""The front page shows the films by Cycles, and each is the film that the tool makes."""

from __future__ import annotations

import re

import numpy as np
import pytest
from PIL import Image

import hero_films
from committed import ROOT

DOCS = ROOT / "docs"
PAGE = (DOCS / "index.md").read_text(encoding="utf-8")


def test_the_front_page_shows_each_film_with_its_command() -> None:
    shown = re.findall(r"!\[Film: [^\]]+\]\(hero-(\w+)\.webp\)", PAGE)
    commands = re.findall(r'`make hero-films NAMES="(\w+)"`', PAGE)
    assert shown == list(hero_films.FILMS)
    assert sorted(commands) == sorted(shown)
    assert sorted(each.stem for each in DOCS.glob("hero-*")) == sorted(f"hero-{n}" for n in shown)


def test_the_front_page_credits_each_character() -> None:
    for scene in (film.scene for film in hero_films.FILMS.values()):
        if isinstance(scene, hero_films.Character):
            kind = scene.file.removesuffix(".glb").split("-")[-1]
            assert re.search(rf"{kind} and clip by Mesh2Motion, CC0", PAGE, re.I), kind


@pytest.mark.parametrize("name", hero_films.FILMS)
def test_a_film_is_small_and_moves(name: str) -> None:
    film, path = hero_films.FILMS[name], DOCS / f"hero-{name}.webp"
    assert path.stat().st_size <= hero_films.MAX_BYTES
    with Image.open(path) as image:
        assert image.size == (film.width, film.width * 9 // 16)
        assert image.n_frames == film.shown
        first = np.asarray(image.convert("RGB"), float)
        image.seek(film.shown // 2)
        image.load()
        assert image.info["duration"] == round(1000.0 / film.rate)
        assert np.abs(np.asarray(image.convert("RGB"), float) - first).mean() > 1.0
