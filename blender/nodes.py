# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups of geometry nodes."""

from __future__ import annotations

from typing import Any


def add_node(group: Any, kind: str, *inputs: Any, **settings: Any) -> Any:
    """A new node of a kind with these settings.

    inputs  of its enabled sockets, in their order: the output of another node, a value, or None
    """
    node = group.nodes.new(kind)
    for key, value in settings.items():
        setattr(node, key, value)
    enabled = [socket for socket in node.inputs if socket.enabled]
    for socket, given in zip(enabled, inputs, strict=False):
        if hasattr(given, "is_linked"):
            group.links.new(given, socket)
        elif given is not None:
            socket.default_value = given
    return node
