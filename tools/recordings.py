"""Recorded runs that turn on the front page of the documentation: `make recordings`.

Each is glTF, packed by gzip, in docs/static/turn/NAME.js; docs/static/turn.js shows it. `make
recordings NAMES="eel"` makes this one again.
"""

from __future__ import annotations

import gzip
import json
import sys
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from pygltflib import GLTF2

import flowborne as fb
from committed import ROOT
from flowborne.kernels.arrays import Array
from flowborne.sim.endings import RunOutcome

FOLDER = ROOT / "docs" / "static" / "turn"

TARGETS = 4
"""Morph targets of flesh: each takes some 15 kB, and these are enough for the eye."""


@dataclass(frozen=True)
class Recording:
    """The run of a built-in scene.

    frames    of the run
    angles    of the camera at first, in degrees: from the vertical and about it
    settings  changes of the scene, as those of `--set`
    """

    frames: int
    angles: tuple[float, float] = (70.0, 30.0)
    settings: Mapping[str, str] = field(default_factory=dict)


RECORDINGS = {
    "eel": Recording(240, (25.0, 0.0)),
    "human-wind-back": Recording(96, (75.0, 10.0)),
    "flyer-twist": Recording(270, settings={"domain.resolution": "24"}),
    "fish-robot": Recording(144),
    "swimmer": Recording(
        53,
        settings={
            "domain.lower": "[-6.0, -6.0, -10.0]",
            "domain.upper": "[6.0, 6.0, 6.0]",
            "domain.resolution": "32",
        },
    ),
}


def packed(name: str, run: Path) -> str:
    """A run folder as a script that hands the run to turn.js."""
    with TemporaryDirectory() as folder:
        fb.export(run, Path(folder) / "run.glb", {"targets": TARGETS})
        return script(name, (Path(folder) / "run.glb").read_bytes())


def script(name: str, glb: bytes) -> str:
    """A script that hands a run and its framing to turn.js."""
    target, distance = framing(GLTF2.load_from_bytes(glb))
    entry = {
        "target": [round(float(x), 4) for x in target],
        "angles": [round(float(x), 4) for x in np.radians(RECORDINGS[name].angles)],
        "distance": round(distance, 4),
        "glb": b64encode(gzip.compress(glb, 9, mtime=0)).decode(),
    }
    return f"(window.recordedRuns ??= {{}})[{json.dumps(name)}] = {json.dumps(entry)};\n"


def framing(run: GLTF2) -> tuple[Array, float]:
    """The middle of all places of a creature, y up, and a distance from which all are in view.

    It is as large as at rest, at each place to which its bones move.
    """
    corners = [run.accessors[p.attributes.POSITION] for mesh in run.meshes for p in mesh.primitives]
    lower = np.min([corner.min for corner in corners], axis=0)
    upper = np.max([corner.max for corner in corners], axis=0)
    animation, ways = run.animations[0], []
    for channel in animation.channels:
        if channel.target.path == "translation":
            accessor = run.accessors[animation.samplers[channel.sampler].output]
            start = run.bufferViews[accessor.bufferView].byteOffset + (accessor.byteOffset or 0)
            places = np.frombuffer(run.binary_blob(), np.float32, 3 * accessor.count, start)
            ways.append(places.reshape(-1, 3) - run.nodes[channel.target.node].translation)
    moved = np.concatenate([np.zeros((1, 3)), *ways])
    lower, upper = lower + moved.min(axis=0), upper + moved.max(axis=0)
    x, y, z = 0.5 * (lower + upper)
    return np.array([x, z, -y]), 2.0 * float(np.linalg.norm(upper - lower))


def make(name: str) -> None:
    """Run a scene, and write its recording."""
    recording = RECORDINGS[name]
    with TemporaryDirectory() as folder:
        scene = fb.load_scene(name, recording.settings)
        result = fb.run(scene, folder, frames=recording.frames, film=False)
        if result.outcome is not RunOutcome.DONE:
            sys.exit(f"{name}: {result.message}")
        (FOLDER / f"{name}.js").write_text(packed(name, Path(folder)), encoding="utf-8")


if __name__ == "__main__":
    for name in sys.argv[1:] or RECORDINGS:
        make(name)
