"""Elbows that go with their shoulders: human.elbows = true in a scene file."""

from __future__ import annotations

from typing import Any

from flowborne.motion.human.skeleton import SIDES


def join_elbows(raw: dict[str, Any]) -> None:
    """Name each elbow beside its shoulder wherever joints are named, in a scene as read, in place.

    It is then controlled as strongly, wants what the shoulder wants, and counts in its effort.
    """
    human = raw.get("human")
    if not (isinstance(human, dict) and human.get("elbows") is True):
        return
    for table, keys in (("control", ("joints",)), ("objectives", ("joints", "wanted_by"))):
        entries = raw.get(table)
        for entry in entries if isinstance(entries, list) else []:
            for key in keys:
                if isinstance(entry, dict) and isinstance(entry.get(key), list):
                    entry[key] = _joined(entry[key])


def _joined(joints: list[Any]) -> list[Any]:
    added = [f"{s}_elbow" for s in SIDES if f"{s}_shoulder" in joints]
    return [*joints, *(elbow for elbow in added if elbow not in joints)]
