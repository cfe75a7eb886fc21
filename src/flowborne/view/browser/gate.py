"""What the server of a page accepts: requests of its own page, and messages that such a page sends.

All that a client sends passes `Gate`; viser trusts its clients, and one wrong message ends it.
"""

from __future__ import annotations

import http
import logging
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import fields
from functools import wraps
from io import StringIO
from ipaddress import ip_address
from math import dist, hypot, pi
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from viser import ViserServer

LONGEST = 2**16
"""Length of the longest message, bytes: those of a page have less than a thousand."""

FARTHEST = 1e9
"""Largest coordinate of a camera, m."""

NEAREST = 1e-9
"""Smallest distance of a camera from its target, m, and smallest length of a direction."""

ROUNDING = 1e-6
"""Error by which a page rounds the number of a slider, also that of its end."""

SILENT = logging.getLogger("flowborne.page")
"""Logger of the connections: what goes wrong in one of them is the client's."""
SILENT.setLevel(logging.CRITICAL + 1)


class Gate:
    """A server, and the check of all that reaches it.

    server   of viser, with the controls that a page may set; set as soon as there is one
    serving  of websockets
    """

    server: ViserServer
    serving: Any

    def stop(self) -> None:
        """Stop the server at once, and quietly.

        Connections are cut: one that has not asked for anything yet, such as browsers open in
        advance, would keep it for seconds.
        """

        def cut() -> None:
            for connection in list(self.serving.server.handlers):
                connection.transport.abort()

        with suppress(RuntimeError):  # it has been stopped before
            self.server.get_event_loop().call_soon_threadsafe(cut)
        with redirect_stdout(StringIO()):  # viser prints that it has stopped
            self.server.stop()

    def accepts(self, message: Any) -> bool:
        """Whether a message is one that our page sends: a camera, a control or a key.

        All other kinds of viser's messages (shares, uploads, forms) have no use here.
        """
        import msgspec
        from viser import _messages

        kinds: dict[str, tuple[type[Any], Callable[[Any], bool]]] = {
            "ViewerCameraMessage": (_messages.ViewerCameraMessage, self._accepts_camera),
            "GuiUpdateMessage": (_messages.GuiUpdateMessage, self._accepts_value),
            "CommandTriggerMessage": (_messages.CommandTriggerMessage, lambda _: True),
        }
        try:
            found = msgspec.msgpack.decode(message, type=dict[str, Any])
            kind, accepts = kinds[found.pop("type")]
            known = {field.name for field in fields(kind)}
            return known == found.keys() and accepts(msgspec.convert(found, kind))
        except (AttributeError, KeyError, TypeError, ValueError, RecursionError):
            return False

    def _accepts_camera(self, camera: Any) -> bool:
        place, target, up = camera.position, camera.look_at, camera.up_direction
        numbers = (*place, *target, *up, *camera.wxyz, camera.near, camera.far)
        return (
            all(abs(x) <= FARTHEST for x in numbers)  # false for NaN
            and min(dist(place, target), hypot(*up), hypot(*camera.wxyz)) >= NEAREST
            and 0.0 < camera.fov < pi
            and min(camera.image_width, camera.image_height) > 0
        )

    def _accepts_value(self, update: Any) -> bool:
        """Whether the update is of the value only, and one that its control can have."""
        handle: Any = self.server.gui._gui_input_handle_from_uuid.get(update.uuid)
        if handle is None or update.updates.keys() != {"value"}:
            return False
        value = update.updates["value"]
        if hasattr(handle, "options"):
            return value in handle.options
        if hasattr(handle, "min"):
            number = isinstance(value, int | float) and not isinstance(value, bool)
            return number and handle.min - ROUNDING <= value <= handle.max + ROUNDING
        return isinstance(value, bool)


def is_own(host: str, origin: str | None, served: str) -> bool:
    """Whether a request comes from the served page.

    A browser lets any page open a websocket to any host, including this machine, and a page's own
    name can be pointed at this machine's address later (DNS rebinding). Origin reveals the former,
    Host the latter.

    host    the request's Host: name or address, and port
    origin  the request's Origin; programs other than browsers leave it out
    served  name or address at which the page is served
    """
    try:
        name, asking = urlsplit(f"//{host}").hostname or "", urlsplit(origin or "").netloc
    except ValueError:  # it is no URL
        return False
    if origin is not None and asking.lower() != host.lower():
        return False
    machine = socket.gethostname().lower()
    everywhere = _is_address(served) and ip_address(served).is_unspecified
    if _is_address(name):
        return everywhere or name == served or ip_address(name).is_loopback
    own = {"localhost", served.lower()}
    return name in (own | {machine, f"{machine}.local"} if everywhere else own)


@contextmanager
def guarded(served: str) -> Iterator[Gate]:
    """Context in which a server that viser starts answers only requests of its own page, and
    drops all messages that its gate does not accept.

    raises  RuntimeError if viser has started its server in another way
    """
    import viser
    import websockets.asyncio.server as server

    gate, started = Gate(), False
    serve = server.serve

    @wraps(serve)
    def checked_serve(handler: Any, *args: Any, process_request: Any, **options: Any) -> Any:
        nonlocal started
        started = True

        def checked(connection: Any, request: Any) -> Any:
            hosts, origins = (request.headers.get_all(key) for key in ("Host", "Origin"))
            origin = origins[0] if origins else None
            if len(hosts) != 1 or len(origins) > 1 or not is_own(hosts[0], origin, served):
                return connection.respond(
                    http.HTTPStatus.FORBIDDEN,
                    "This is the page of another host. Open the address that flowborne view "
                    "printed.\n",
                )
            return process_request(connection, request)

        async def handle(connection: Any) -> None:
            if connection.subprotocol != f"viser-v{viser.__version__}":
                # the page of another version of viser; 1002 is how it recognises this
                await connection.close(1002, "This page is of another version; load it again.")
                return
            receive = connection.recv

            async def accepted() -> Any:
                while not gate.accepts(message := await receive()):
                    pass
                return message

            connection.recv = accepted
            await handler(connection)

        options |= {"max_size": LONGEST, "logger": SILENT}
        gate.serving = serve(handle, *args, process_request=checked, **options)
        return gate.serving

    vars(server)["serve"] = checked_serve  # viser does not pass options on
    try:
        yield gate
    finally:
        vars(server)["serve"] = serve
    if not started:
        raise RuntimeError("viser does not serve by websockets, so that no request is checked")


def _is_address(name: str) -> bool:
    try:
        ip_address(name)
    except ValueError:
        return False
    return True
