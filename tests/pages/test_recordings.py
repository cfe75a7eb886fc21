"""The front page shows the runs that were recorded, and each is glTF that moves."""

from __future__ import annotations

import gzip
import json
import re
from base64 import b64decode

import numpy as np
import pytest

import recordings
import viewer_script
from committed import ROOT

pygltflib = pytest.importorskip("pygltflib")


def test_the_front_page_shows_every_recording() -> None:
    text = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    listed = text.split("## Runs to turn")[1].split("\n## ")[0]
    assert re.findall(r"`flowborne run ([\w-]+)`", listed) == list(recordings.RECORDINGS)


@pytest.mark.parametrize("name", recordings.RECORDINGS)
def test_a_recording_is_small_and_moves(name: str) -> None:
    script = (recordings.FOLDER / f"{name}.js").read_text(encoding="utf-8")
    assert len(script) < 500_000
    said = re.fullmatch(r'\(window\.recordedRuns \?\?= \{\}\)\["([\w-]+)"\] = (.*);\n', script)
    assert said
    assert said[1] == name
    entry = json.loads(said[2])
    assert np.degrees(entry["angles"]) == pytest.approx(
        recordings.RECORDINGS[name].angles, abs=0.01
    )
    assert entry["distance"] > 0.0
    run = pygltflib.GLTF2.load_from_bytes(gzip.decompress(b64decode(entry["glb"])))
    rate = run.asset.extras["frames_per_second"]
    frames = max(run.accessors[one.input].count for one in run.animations[0].samplers)
    assert frames == recordings.RECORDINGS[name].frames + 1
    assert rate > 0
    assert run.meshes


def test_the_viewer_has_all_that_the_page_uses() -> None:
    script = viewer_script.three()
    page = (ROOT / "docs" / "static" / "turn.js").read_text(encoding="utf-8")
    assert "SPDX-License-Identifier: MIT" in script[:200]
    for name in sorted(set(re.findall(r"THREE\.(\w+)", page))):
        assert f".{name}=" in script, name
