"""A page that Python serves while the program goes on."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path
from time import monotonic, sleep
from urllib.request import urlopen

import pytest

import flowborne as fb
from flowborne.cli.main import main

pytest.importorskip("viser", reason="the viewer needs viser: pip install 'flowborne[view]'")

Write = Callable[..., Path]


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def test_a_page_is_served_until_it_is_closed(write_run: Write) -> None:
    folder, port = write_run(frames=6), free_port()
    with fb.view(folder, port=port) as page:
        assert page.address == f"http://127.0.0.1:{port}"
        assert repr(page) == f"Page of {folder} at {page.address}"
        assert f'<iframe src="{page.address}"' in page._repr_html_()
        with urlopen(page.address) as answer:
            assert answer.status == 200
        until = monotonic() + 20.0
        while page._viewer._shown is None and monotonic() < until:
            sleep(0.02)
        assert page._viewer._shown is not None
        with pytest.raises(fb.SceneError, match=f"port {port} cannot be used"):
            fb.view(folder, port=port)
    assert not page._thread.is_alive()
    with fb.view(fb.open_run(folder), port=port) as again:
        assert again.folder == folder


def test_a_folder_without_a_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(fb.RunFolderError, match="there is no folder"):
        fb.view(tmp_path / "nothing", port=free_port())


def test_the_command_says_that_the_page_starts_before_it_is_there(
    write_run: Write, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, port = write_run(frames=6), free_port()
    monkeypatch.setattr("flowborne.view.browser.viewer.serve", lambda viewer: viewer.server.stop())
    with pytest.raises(SystemExit) as left:
        main(["view", str(folder), "--port", str(port)])
    lines = capsys.readouterr().out.splitlines()
    assert left.value.code == 0
    assert lines[0] == "starting the page …"
    assert f"viewing {folder} at http://127.0.0.1:{port}; Ctrl-C ends it" in lines
