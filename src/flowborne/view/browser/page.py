"""The page of the viewer: its title and style, and the requests that it answers."""

from __future__ import annotations

import http
import json
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from functools import wraps
from ipaddress import ip_address
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from flowborne.view import style

if TYPE_CHECKING:
    from viser import ViserServer

CSS = (
    f":root {{ --mantine-color-dimmed: {style.MUTED} !important; }}"
    ".mantine-Slider-markLabel, .mantine-Notification-description"
    f" {{ color: {style.MUTED} !important; }}"
)
"""viser writes the names of controls in a grey of 4.0:1 on the panel; WCAG 2.2, 1.4.3, asks for
4.5:1."""


def dress(server: ViserServer, name: str) -> None:
    """Give every page that is open, or will be, the name of a run as its title."""
    from viser import _messages

    source = f"""
document.title = {json.dumps(f"{name} – flowborne")};
if (!document.getElementById("flowborne")) {{
  const sheet = document.createElement("style");
  sheet.id = "flowborne";
  sheet.textContent = {json.dumps(CSS)};
  document.head.append(sheet);
}}"""
    # viser has no public way to either; this is how it loads its own scripts
    server.gui._websock_interface.queue_message(_messages.RunJavascriptMessage(source=source))


def is_own(host: str, origin: str | None, served: str) -> bool:
    """Whether a request is one of the page that is served.

    host    the request's Host: name or address, and port
    origin  the request's Origin, which programs that are no browsers leave out
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
def only_own_requests(served: str) -> Iterator[None]:
    """Context in which a server that viser starts answers no requests but its own page's.

    raises  RuntimeError when viser has started its server in some other way
    """
    import websockets.asyncio.server as server

    started = False
    serve = server.serve

    @wraps(serve)
    def guarded(*args: Any, process_request: Any, **options: Any) -> Any:
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

        return serve(*args, process_request=checked, **options)

    vars(server)["serve"] = guarded  # viser hands none of its options on
    try:
        yield
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
