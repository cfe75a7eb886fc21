"""The viewer of a simulation that is played: what buttons and settings in the panel do."""

from __future__ import annotations

import shlex
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from time import monotonic, sleep
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import pytest

import flowborne as fb
from flowborne.cli.main import main

pytest.importorskip("viser", reason="the viewer needs viser: pip install 'flowborne[view]'")

from flowborne.play.viewer import PlayViewer, free_folder, open_play

from ..made_runs import drift_scene

DIRECTION = "wind: direction (°)"


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@pytest.fixture
def viewer(small_scene: Path, tmp_path: Path) -> Iterator[PlayViewer]:
    scene = fb.load_scene(small_scene)
    opened = open_play(scene, tmp_path / "out", host="127.0.0.1", port=free_port(), workers=1)
    opened.running = False
    yield opened
    opened.close()


def until(viewer: PlayViewer, reached: Callable[[], bool]) -> None:
    """Tick until something is so."""
    began = monotonic()
    while not reached():
        assert monotonic() - began < 20.0
        viewer.tick(0.01)
        viewer.wait(0.001)


def stepped(viewer: PlayViewer, frames: int) -> None:
    for _ in range(frames):
        before = len(viewer.run)
        viewer.panel.asked.put("▶")
        until(viewer, lambda before=before: len(viewer.run) > before)
    viewer.tick(0.0)


def test_a_domain_that_moves_is_where_it_is(tmp_path: Path) -> None:
    scene = fb.load_scene(drift_scene(tmp_path))
    played = open_play(scene, tmp_path / "out", host="127.0.0.1", port=free_port(), workers=1)
    played.running = False
    stepped(played, 5)
    run, handles = played.run, played.server.scene._handle_from_node_name
    moved = run.origins()[-1] - run.origins()[0]
    assert moved[0] > 0.1
    assert handles["/run/domain"].position == pytest.approx(moved)
    assert handles["/run"].position == pytest.approx(-played._path[-1])
    played.close()


def test_runs_until_it_is_paused(viewer: PlayViewer) -> None:
    viewer.panel.asked.put("run or pause")
    until(viewer, lambda: len(viewer.run) >= 12)
    assert "24 in real time" in viewer.panel._said.content
    viewer.panel.asked.put("pause")
    until(viewer, lambda: viewer._job is None and not viewer.running)
    count = len(viewer.run)
    viewer.tick(0.0)
    viewer.look()
    assert len(viewer.run) == count
    assert viewer.panel.curves.plots[-1].data[0][-1] == pytest.approx((count - 1) / 24)


def test_a_setting_acts_in_the_next_frame_and_is_shown_at_every_frame(viewer: PlayViewer) -> None:
    stepped(viewer, 2)
    viewer.panel._dials[DIRECTION].value = 90.0
    stepped(viewer, 1)
    changed = viewer.run.moments[-1]
    assert changed.snapshot.report.values == {"wind.0.velocity": [0.0, 5.0, 0.0]}
    viewer.panel.asked.put("◀")
    viewer.tick(0.0)
    assert viewer.panel.dials[DIRECTION] == 0.0
    assert "run drops the frame after this one" in viewer.panel._said.content
    viewer.panel.asked.put("newest")
    viewer.tick(0.0)
    assert viewer.panel.dials[DIRECTION] == 90.0


def test_goes_on_from_an_earlier_frame(viewer: PlayViewer) -> None:
    stepped(viewer, 4)
    first = viewer.run.state(3)["q"]
    viewer.panel._slider.value = 2 / 24
    viewer.tick(0.0)
    assert viewer.timeline.number == 2
    viewer.panel.asked.put("run")
    until(viewer, lambda: viewer.run.frames[-1] == 3)
    viewer.panel.asked.put("pause")
    until(viewer, lambda: viewer._job is None and not viewer.running)
    assert np.array_equal(viewer.run.state(3)["q"], first)


def test_records_into_a_new_folder(viewer: PlayViewer, tmp_path: Path) -> None:
    stepped(viewer, 2)
    for name in ("out", "out-2"):
        viewer.panel.asked.put("save as a run")
        until(viewer, lambda name=name: f"{name}; they repeat" in viewer.panel._said.content)
        assert len(fb.open_run(tmp_path / name)) == 3
    assert free_folder(tmp_path / "out") == tmp_path / "out-3"


def test_a_frame_that_fails_pauses_and_is_said(
    viewer: PlayViewer, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> None:
        raise fb.BlowUpError(1, 1, "a velocity is not a finite number")

    monkeypatch.setattr(viewer._play.simulation, "advance_frame", fail)
    viewer.panel.asked.put("run")
    until(viewer, lambda: "not a finite number" in viewer.panel._said.content)
    assert not viewer.running


def test_input_motion_stands_beside_a_walker(tmp_path: Path) -> None:
    scene = fb.load_scene("human-wind-back")
    opened = open_play(scene, tmp_path / "out", host="127.0.0.1", port=free_port(), workers=1)
    opened.running = False
    opened.panel._controls["ghost"].value = "beside"
    stepped(opened, 12)
    assert opened._ghost is not None
    place = [np.array(mesh.position) for mesh in opened._ghost.meshes]
    moment = opened.run.moments[-1]
    assert moment.ghost is not None
    np.testing.assert_allclose(place, moment.ghost["geom_position"], atol=1e-6)
    assert np.linalg.norm(opened._ghost_frame.position) > 0.5
    away = np.abs(moment.ghost["geom_position"] - moment.state["geom_position"])
    assert 0.001 < away.max() < 0.5
    opened.close()


def test_a_scene_that_does_not_exist_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["play", "human-wind-bakc"])
    assert left.value.code == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert "did you mean 'human-wind-back'?" in line


def test_ending_while_a_run_is_saved_says_how_far_it_is(
    viewer: PlayViewer, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    stepped(viewer, 30)
    viewer.panel.asked.put("save as a run")
    until(viewer, lambda: "saving frame" in viewer.panel._said.content)
    with pytest.raises(KeyboardInterrupt, match=r"recording stopped at frame \d+ of 30") as ended:
        viewer.close()
    assert capfd.readouterr() == ("", "")
    command = shlex.split(str(ended.value).partition("continue with: flowborne ")[2])
    with pytest.raises(SystemExit, match="0"):
        main([*command, "--no-film"])
    assert len(fb.open_run(tmp_path / "out")) == 31


def test_a_frame_that_takes_minutes_does_not_keep_the_viewer(
    viewer: PlayViewer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(viewer._play.simulation, "advance_frame", lambda: sleep(60.0))
    viewer.panel.asked.put("run")
    until(viewer, lambda: viewer._job is not None)
    began = monotonic()
    viewer.close()
    assert monotonic() - began < 3.0


def test_one_button_runs_and_pauses(viewer: PlayViewer) -> None:
    for running, label in ((False, "run"), (True, "pause"), (False, "run")):
        viewer.running = running
        viewer.tick(0.0)
        assert viewer.panel._buttons.options == ("◀", label, "▶", "newest")


def test_plots_show_the_last_ten_seconds_with_goal_and_unit(viewer: PlayViewer) -> None:
    stepped(viewer, 260)
    viewer.look()
    curves = viewer.panel.curves
    times = curves.plots[-1].data[0]
    assert times[-1] == pytest.approx(260 / 24)
    assert times[0] == pytest.approx(times[-1] - 10.0, abs=0.05)
    assert curves._titles[0][0] == "objective: least wind-drag (N/m)"


def test_names_and_messages_are_no_html(tmp_path: Path, small_scene: Path) -> None:
    evil = '<img src=x onerror="alert(1)">'
    model = small_scene.with_name("block.xml")
    model.write_text(model.read_text().replace('name="hinge"', f"name={quoteattr(evil)}"))
    text = small_scene.read_text().replace("{ hinge =", f"{{ '{evil}' =")
    small_scene.write_text(text.replace('"hinge"', f"'{evil}'"))
    scene, out = fb.load_scene(small_scene), tmp_path / evil
    opened = open_play(scene, out, host="127.0.0.1", port=free_port(), workers=1)
    opened.running = False
    stepped(opened, 2)
    opened.panel.asked.put("save as a run")
    until(opened, lambda: "they repeat" in opened.panel._said.content)
    opened.look()
    shown = [getattr(handle, "content", "") for handle in contents(opened.server.gui)]
    assert any("&lt;img" in content for content in shown)
    assert not any("<img" in content for content in shown)
    opened.close()


def contents(gui: Any) -> list[Any]:
    """Handles of all that is in a panel."""
    return [h for held in gui._container_handle_from_uuid.values() for h in held._children.values()]
