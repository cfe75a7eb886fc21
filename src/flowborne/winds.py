"""Simple winds, which push bodies and do not feel them."""

from __future__ import annotations

from flowborne.solids.wind import Wind, WindFaces, WindField, WindForce

__all__ = ["Wind", "WindFaces", "WindField", "WindForce"]
