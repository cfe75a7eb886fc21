"""Tables of a scene that say how the drives of joints follow what they are told."""

from __future__ import annotations

from typing import Annotated, Literal

from flowborne.tables import ByKind, Positive, Table


class ServoExact(Table):
    """The drive reaches every target exactly when it is due."""

    kind: Literal["exact"]


class ServoPD(Table):
    """Critically damped drive.

    frequency  Hz, its natural frequency
    """

    kind: Literal["pd"]
    frequency: Positive


ServoTable = Annotated[ServoExact | ServoPD, *ByKind]

EXACT = ServoExact(kind="exact")
