"""The tables of docs/accuracy.md, from the committed report and from docs/speed.json.

`make speed` measures the scenes of docs/speed.json again.
"""

from __future__ import annotations

import json
import os
import platform
from datetime import UTC, datetime
from math import prod
from pathlib import Path
from time import process_time
from typing import Any

from committed import REPORT, ROOT
from flowborne import Simulation, __version__, load_scene
from flowborne_validation.case import THE_RUN, entry
from flowborne_validation.report import Data, failures, read_report, tier_of
from markdown_text import plain, table
from tolerances import used
from validation_table import distance, link, number, per_cent

SPEED = ROOT / "docs" / "speed.json"

SCENES = {
    "eel": "a robot of six links, prescribed gait, 2D",
    "ns-block-drag-max": "a block in a stream, one controlled joint, 2D",
    "fish": "a fish of flesh, ten controlled joints, 3D",
}
FIRST, MEASURED = 6, 24
"""Frames before the measurement, in which kernels are compiled, and frames that are measured."""

HELD = (
    ("B1", "cD", "drag of a cylinder in a channel, Re 20"),
    ("V3", "largest coefficient", "largest force on a cylinder that oscillates, Re 100"),
    ("I2", "Ca of a sphere in a cube, D/L = 0.3333", "added mass of a sphere in a box"),
    ("B4", "Cd", "drag of a cylinder in open water, Re 40"),
    ("D1", "CSM1 A, tetrahedra, uy in mm", "sag of an elastic bar under its weight, mm"),
    ("V8", "torque / exact, steady", "torque on a cylinder that turns in another"),
    ("D2", "CFD2, drag", "drag of a cylinder with a bar, N/m"),
    ("A1", "T/T0 let go at 90 degrees", "period of a pendulum over that of small swings"),
)
"""Case, quantity and what that is: the first FEW that pass are shown."""
FEW = 5


def held() -> str:
    """The first figures of HELD that pass in the report."""
    data = read_report(REPORT)
    rows = []
    for name, quantity, said in HELD:
        found = finding_of(data, name, quantity)
        if found["verdict"] == "pass":
            value, reference = number(found["value"]), number(found["reference"])
            grid = f"{found['series']['cells'][-1]:g} {found['series']['label']}"
            rows.append([link(name), said, value, reference, plain(per_cent(found)), grid])
    if len(rows) < FEW:
        raise ValueError(f"{len(rows)} figures of HELD pass, and the page shows {FEW}: add others")
    return table(("case", "figure", "flowborne", "published", "error", "grid"), rows[:FEW])


def finding_of(data: Data, name: str, quantity: str) -> dict[str, Any]:
    """A figure of a case in the tier that counts.

    raises  ValueError when the report has no such figure
    """
    findings: list[dict[str, Any]] = data[name][tier_of(data[name])]["findings"]
    for finding in findings:
        if finding["quantity"] == quantity:
            return finding
    raise ValueError(f"case {name} of the report has no quantity '{quantity}'")


def failing() -> str:
    """An item for each case that fails: how many of its figures do, and the one farthest off."""
    data = read_report(REPORT)
    items = []
    for name, found in failed_by_case(data).items():
        worst = farthest_off(found)
        said = f"{plain(worst['quantity'])} **{error_of(worst)}**"
        count = f"{failed_of(data, name, found)} fail"
        items.append(f"* {link(name)} {plain(entry(name).name)}: {said} ({count})\n")
    return "".join(items)


def failed_by_case(data: Data) -> dict[str, list[dict[str, Any]]]:
    """The figures that fail, by the names of their cases."""
    by_case: dict[str, list[dict[str, Any]]] = {}
    for name, _, finding in failures(data):
        by_case.setdefault(name, []).append(finding)
    return by_case


def farthest_off(found: list[dict[str, Any]]) -> dict[str, Any]:
    """The figure that is farthest from its reference, or where that is 0 from what is accepted."""
    return max(found, key=lambda finding: (distance(finding), used(finding) or 0.0))


def failed_of(data: Data, name: str, found: list[dict[str, Any]]) -> str:
    """How many of the figures of a case fail."""
    return f"{len(found)} of {len(data[name][tier_of(data[name])]['findings'])}"


def error_of(finding: dict[str, Any]) -> str:
    """How far a figure is off, in per cent where it can be; else beside what is accepted."""
    if finding["quantity"] == THE_RUN:
        return "stops"
    if part := per_cent(finding):
        return plain(part)
    return plain(f"{abs(finding['value']):.2g}, accepted {finding['tolerance']}")


def speed() -> str:
    """Cells and seconds of SCENES, as they were measured."""
    found = json.loads(SPEED.read_text(encoding="utf-8"))
    rows = [
        [
            f"`{name}`",
            SCENES[name],
            f"{one['cells']:,}",
            f"{one['seconds']:.2g} s for 1/{one['frames_per_second']:g} s",
        ]
        for name, one in found["scenes"].items()
    ]
    head = ("scene", "", "cells", "a frame takes")
    where = f"On one core ({found['processor']}), with the controller's trials"
    return f"{table(head, rows)}\n{where}, {found['date']}, with version `{found['version']}`."


def measure(name: str) -> dict[str, float]:
    """Cells of a scene, and the processor's seconds for one of its frames."""
    scene = load_scene(name)
    with Simulation(scene) as simulation:
        for _ in range(FIRST):
            simulation.advance_frame()
        start = process_time()
        for _ in range(MEASURED):
            simulation.advance_frame()
        seconds = (process_time() - start) / MEASURED
        cells = prod(simulation.world.flow()[0].grid.shape)
    rate = scene.time.frames_per_second
    return {"cells": cells, "frames_per_second": rate, "seconds": float(f"{seconds:.3g}")}


def processor() -> str:
    """Name, family and model of the processor, as far as the system gives them."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    told = {key.strip(): value.strip() for key, _, value in (one.partition(":") for one in lines)}
    keys = (("model name", ""), ("cpu family", "family "), ("model", "model "))
    parts = [before + told[key] for key, before in keys if key in told]
    return ", ".join(parts) or platform.machine()


def write() -> None:
    """Measure SCENES on one core.

    raises  SystemExit without NUMBA_NUM_THREADS=1, which `make speed` sets
    """
    if os.environ.get("NUMBA_NUM_THREADS") != "1":
        raise SystemExit("set NUMBA_NUM_THREADS=1 to measure one core, or run `make speed`")
    found = {
        "date": datetime.now(UTC).date().isoformat(),
        "version": __version__,
        "processor": processor(),
        "scenes": {name: measure(name) for name in SCENES},
    }
    SPEED.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write()
