"""The viewer answers its own page, and no other one."""

from __future__ import annotations

import socket
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from flowborne.view.browser.gate import guarded, is_own
from flowborne.view.browser.viewer import open_viewer

pytest.importorskip("viser", reason="the viewer needs viser: pip install 'flowborne[view]'")

MACHINE = socket.gethostname()


@pytest.mark.parametrize(
    ("host", "origin", "served", "own"),
    [
        ("127.0.0.1:8080", None, "127.0.0.1", True),
        ("127.0.0.1:8080", "http://127.0.0.1:8080", "127.0.0.1", True),
        ("localhost:8080", "http://localhost:8080", "127.0.0.1", True),
        ("[::1]:8080", "http://[::1]:8080", "127.0.0.1", True),
        ("lab:8080", "http://lab:8080", "lab", True),
        ("127.0.0.1:8080", "http://evil.example", "127.0.0.1", False),
        ("127.0.0.1:8080", "http://127.0.0.1:9090", "127.0.0.1", False),
        ("127.0.0.1:8080", "null", "127.0.0.1", False),
        ("127.0.0.1:8080", "http://[", "127.0.0.1", False),
        ("evil.example:8080", "http://evil.example:8080", "127.0.0.1", False),
        ("localhost.evil.example", None, "127.0.0.1", False),
        ("10.0.0.7:8080", None, "127.0.0.1", False),
        ("", None, "127.0.0.1", False),
        ("10.0.0.7:8080", "http://10.0.0.7:8080", "0.0.0.0", True),
        (f"{MACHINE}:8080", f"http://{MACHINE}:8080", "0.0.0.0", True),
        ("evil.example:8080", "http://evil.example:8080", "0.0.0.0", False),
    ],
)
def test_own_requests_have_the_host_that_is_served(
    host: str, origin: str | None, served: str, own: bool
) -> None:
    assert is_own(host, origin, served) == own


def test_a_server_that_is_not_checked_is_no_server() -> None:
    with pytest.raises(RuntimeError, match="no request is checked"), guarded("lab"):
        pass


@pytest.fixture
def port(write_run: Callable[..., Path]) -> Iterator[int]:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        free = int(found.getsockname()[1])
    folder = write_run(frames=1)
    viewer = open_viewer(folder, "127.0.0.1", free)
    yield free
    viewer.server.stop()


def status_of_page(port: int, headers: dict[str, str]) -> int:
    """HTTP status of the page, asked for with some headers."""
    request = urllib.request.Request(f"http://127.0.0.1:{port}/", headers=headers)
    try:
        with urllib.request.urlopen(request) as page:
            return int(page.status)
    except urllib.error.HTTPError as refused:
        return refused.code


def status_of_socket(port: int, headers: dict[str, str]) -> int:
    """HTTP status of the websocket; 101 once it has said something."""
    import viser
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    with socket.create_connection(("127.0.0.1", port)) as line:
        try:
            with connect(
                f"ws://{headers['Host']}/",
                sock=line,
                origin=headers.get("Origin"),  # type: ignore[arg-type]
                subprotocols=[f"viser-v{viser.__version__}"],  # type: ignore[list-item]
                compression=None,
            ) as client:
                return 101 if client.recv(timeout=10.0) else 0
        except InvalidStatus as refused:
            return refused.response.status_code


def test_pages_of_other_hosts_reach_neither_page_nor_socket(port: int) -> None:
    own = f"127.0.0.1:{port}"
    for headers, answered in (
        ({"Host": own}, True),
        ({"Host": own, "Origin": f"http://{own}"}, True),
        ({"Host": f"localhost:{port}", "Origin": f"http://localhost:{port}"}, True),
        ({"Host": own, "Origin": "https://evil.example"}, False),
        ({"Host": f"evil.example:{port}", "Origin": f"http://evil.example:{port}"}, False),
    ):
        assert status_of_page(port, headers) == (200 if answered else 403)
        assert status_of_socket(port, headers) == (101 if answered else 403)
