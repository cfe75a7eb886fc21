"""What a side of the domain is to the pressure."""

from __future__ import annotations

CLOSED, OPEN, PERIODIC = range(3)
"""What a side is to the pressure: a wall or an inflow, p = 0, or the opposite side."""
