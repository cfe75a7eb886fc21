"""What a client sends reaches a server only if a page of ours can send it."""

from __future__ import annotations

import random
import socket
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import pytest

pytest.importorskip("viser", reason="the viewer needs viser: pip install 'flowborne[view]'")

import msgspec
import viser
from viser import _messages
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from flowborne.view.browser.gate import Gate
from flowborne.view.browser.viewer import Viewer, open_viewer

encode = msgspec.msgpack.encode

CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage",
    "wxyz": [1.0, 0.0, 0.0, 0.0],
    "position": [1.0, 2.0, 3.0],
    "fov": 0.8,
    "near": 0.1,
    "far": 100.0,
    "image_height": 800,
    "image_width": 600,
    "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 0.0, 1.0],
}
NAN = float("nan")


@pytest.fixture
def viewer(write_run: Callable[..., Path]) -> Iterator[Viewer]:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = int(found.getsockname()[1])
    opened = open_viewer(write_run(frames=2), "127.0.0.1", port)
    yield opened
    opened.close()


def connected(viewer: Viewer, version: str = viser.__version__) -> ClientConnection:
    own = f"127.0.0.1:{viewer.server.get_port()}"
    return connect(
        f"ws://{own}/",
        origin=f"http://{own}",  # type: ignore[arg-type]
        subprotocols=[f"viser-v{version}"],  # type: ignore[list-item]
        max_size=None,
        compression=None,
    )


def ask(uuid: str, **updates: Any) -> bytes:
    return encode({"type": "GuiUpdateMessage", "uuid": uuid, "updates": updates})


def until(reached: Callable[[], bool]) -> None:
    for _ in range(200):
        if reached():
            return
        sleep(0.02)
    raise AssertionError("not reached in 4 s")


WRONG_CAMERAS: list[dict[str, Any]] = [
    {"position": CAMERA["look_at"]},
    {"position": [1.0, 2.0]},
    {"position": [1e308] * 3},
    {"look_at": [NAN, 1.0, 1.0]},
    {"up_direction": [0.0] * 3},
    {"wxyz": [0.0] * 4},
    {"fov": 0.0},
    {"fov": "0.8"},
    {"image_width": 0},
    {"near": None},
    {"owner": "another field"},
]


@pytest.mark.parametrize("wrong", WRONG_CAMERAS)
def test_a_wrong_camera_is_dropped(viewer: Viewer, wrong: dict[str, Any]) -> None:
    gate = gate_of(viewer)
    assert gate(encode(CAMERA))
    assert not gate(encode(CAMERA | wrong))


def gate_of(viewer: Viewer) -> Callable[[bytes | str], bool]:
    gate = Gate()
    gate.server = viewer.server
    return gate.accepts


def test_a_control_takes_only_what_it_offers(viewer: Viewer) -> None:
    accepts, panel = gate_of(viewer), viewer.panel
    pace, slider, forces = panel._pace._impl.uuid, panel._slider, panel._controls["forces"]
    for value, taken in (("1/2", True), ("3", False), (None, False), (["1"], False), (1, False)):
        assert accepts(ask(pace, value=value)) == taken
    uuid = slider._impl.uuid
    assert accepts(ask(uuid, value=slider.max + 1e-9))  # as a page rounds it
    for value, taken in ((slider.max, True), (0, True), (-5.0, False), (NAN, False), (True, False)):
        assert accepts(ask(uuid, value=value)) == taken
    for value, taken in ((False, True), (0, False), ("x", False)):
        assert accepts(ask(forces._impl.uuid, value=value)) == taken
    assert not accepts(ask(pace, value="1", removed=True))
    assert not accepts(ask(pace, update_cb=[]))
    assert not accepts(ask("no such control", value="1"))


@pytest.mark.parametrize(
    "message",
    [
        encode({"type": "ShareUrlRequest"}),
        encode({"type": "ShareUrlDisconnect"}),
        encode({"type": "RunJavascriptMessage", "source": "alert(1)"}),
        encode({"type": ["ViewerCameraMessage"]}),
        encode([1, 2]),
        encode(None),
        b"",
        b"\x91" * 60_000 + b"\x01",
        "text",
    ],
)
def test_no_other_kind_of_message_is_taken(viewer: Viewer, message: bytes | str) -> None:
    assert not gate_of(viewer)(message)


def test_a_page_cannot_ask_to_be_published(viewer: Viewer, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    monkeypatch.setattr(type(viewer.server), "request_share_url", lambda _: asked.append(1))
    with connected(viewer) as client:
        client.send(encode({"type": "ShareUrlRequest"}))
        client.send(encode(CAMERA))
        until(lambda: len(viewer.server.get_clients()) == 1)
    assert not asked


def odd_message(choose: random.Random, controls: list[str]) -> bytes | str:
    """A message that no page sends; or one with a part that is odd."""
    odd: Any = [
        None,
        True,
        -1,
        2**63,
        1e308,
        NAN,
        "",
        "<b>",
        [],
        [[1]],
        {},
        b"\x00",
        [NAN] * 3,
        "1",
    ]
    kind = choose.choice(_messages.Message.get_subclasses())
    good = encode(CAMERA)
    made: list[bytes | str] = [
        encode(CAMERA | {choose.choice(list(CAMERA)): choose.choice(odd)}),
        ask(choose.choice(controls), **{choose.choice(["value", "props"]): choose.choice(odd)}),
        encode({"type": kind.__name__} | {f.name: choose.choice(odd) for f in fields(kind)}),
        encode({"type": "CommandTriggerMessage", "uuid": choose.choice(odd)}),
        good[: choose.randrange(len(good))],
        choose.randbytes(50),
        bytes([choose.choice([0x91, 0x81, 0xDD])]) * 30_000,
        choose.choice(["text", "\u202e"]),
    ]
    return choose.choice(made)


def test_nothing_that_a_client_sends_ends_the_viewer_or_reaches_the_terminal(
    viewer: Viewer, capfd: pytest.CaptureFixture[str]
) -> None:
    choose = random.Random(66)
    controls = list(viewer.server.gui._gui_input_handle_from_uuid)
    for _ in range(4):
        with connected(viewer) as client:
            for _ in range(40):
                client.send(odd_message(choose, controls))
            client.send(encode(CAMERA))
            until(lambda: len(viewer.server.get_clients()) == 1)
            viewer.tick(0.01)
            viewer.look()
        until(lambda: not viewer.server.get_clients())
    with socket.create_connection(("127.0.0.1", viewer.server.get_port())) as line:
        line.sendall(b"\x16\x03\x01 no HTTP\r\n\r\n")
    with connected(viewer, "0") as client, pytest.raises(ConnectionClosed, match="another version"):
        client.recv(timeout=5.0)
    assert viewer.panel.settings.forces in (True, False)
    viewer.close()
    assert capfd.readouterr() == ("", "")


def test_a_camera_at_the_edge_of_what_is_taken_has_keys(viewer: Viewer) -> None:
    with connected(viewer) as client:
        for x in (1e9, 1e-9):
            camera = encode(CAMERA | {"position": [x, 0.0, 0.0], "look_at": [0.0] * 3})

            def stands(camera: bytes = camera, x: float = x) -> bool:
                client.send(camera)  # again, as the server brings a new page to the first view
                found = list(viewer.server.get_clients().values())
                return bool(found) and found[0].camera.position[0] == x

            until(stands)
            viewer.look()


def test_a_connection_that_says_nothing_does_not_keep_the_server(viewer: Viewer) -> None:
    """Browsers open some in advance."""
    with socket.create_connection(("127.0.0.1", viewer.server.get_port())) as line:
        line.sendall(b"GET / HT")
        sleep(0.2)
        began = monotonic()
        viewer.close()
        assert monotonic() - began < 0.9
