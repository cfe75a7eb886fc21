"""The page of the viewer: its title, its style, and what viser's own page lacks."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from flowborne.view import style

if TYPE_CHECKING:
    from viser import ViserServer

CSS = f"""
:root {{ --mantine-color-dimmed: {style.MUTED} !important; }}
.mantine-Slider-markLabel, .mantine-Notification-description {{
  color: {style.MUTED} !important;
}}
body * {{ letter-spacing: 0 !important; }}
.mantine-Slider-root + .mantine-NumberInput-root {{ width: 4.2rem !important; }}
.mantine-ScrollArea-content {{ box-sizing: border-box; padding-right: 10px; }}
#ended {{
  position: fixed; z-index: 1000; top: 0; left: 0; right: 0; padding: 10px 16px;
  font: 15px sans-serif; text-align: center; color: {style.PAPER}; background: {style.ACCENT};
}}
#ended:empty {{ display: none; }}
@media (max-width: 600px) {{
  .mantine-Paper-root[style*="position: fixed"],
  .mantine-Paper-root[style*="position: fixed"] .mantine-ScrollArea-content > div {{
    width: 100% !important;
  }}
}}
"""
"""Style of the page. Dimmed text: viser's grey has a contrast of 4.0:1 on the panel, and WCAG 2.2,
1.4.3, requires 4.5:1. Scroll bars have room, and a phone's panel its whole width."""


def style_page(server: ViserServer, name: str) -> None:
    """Set the title of all open and future pages to the name of a run, and their style; they get
    names of controls for screen readers, and say when the server has ended."""
    from viser import _messages

    page = json.dumps({"title": f"{name} – flowborne", "css": CSS})
    source = f"const page = {page};\n{Path(__file__).with_name('page.js').read_text('utf-8')}"
    # viser has no public function for either; it loads its own scripts like this
    server.gui._websock_interface.queue_message(_messages.RunJavascriptMessage(source=source))
