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
"""Style of dimmed text: viser's grey has a contrast of 4.0:1 on the panel, and WCAG 2.2, 1.4.3,
requires 4.5:1."""


def style_page(server: ViserServer, name: str) -> None:
    """Set the title of all open and future pages to the name of a run, and their style."""
    from viser import _messages

    source = f"""
document.title = {json.dumps(f"{name} – flowborne")};
if (!document.getElementById("flowborne")) {{
  const sheet = document.createElement("style");
  sheet.id = "flowborne";
  sheet.textContent = {json.dumps(CSS)};
  document.head.append(sheet);
}}"""
    # viser has no public function for either; it loads its own scripts like this
    server.gui._websock_interface.queue_message(_messages.RunJavascriptMessage(source=source))


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
def only_own_requests(served: str) -> Iterator[None]:
    """Context in which a server that viser starts answers only requests of its own page.

    raises  RuntimeError if viser has started its server in another way
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

    vars(server)["serve"] = guarded  # viser does not pass options on
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
