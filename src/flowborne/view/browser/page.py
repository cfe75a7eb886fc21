"""The page of the viewer itself: the title of its tab, and words that can be read."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

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
