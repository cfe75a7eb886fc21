"""Elements of flesh that have turned inside out.

A St. Venant-Kirchhoff material resists compression less and less: at 1/sqrt(3) of its length it
gives way, and its mirror image is at rest, so an element that has turned inside out can stay so.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flowborne.solids.flesh import Flesh

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Inversion:
    """Elements with det F <= 0.

    elements  (k,) their numbers in the flesh, ascending
    of        how many elements there are
    worst     number of the element with the least det F
    ratio     that det F
    place     (3,) where its middle is, m
    name      of its flesh
    """

    elements: NDArray[np.int64]
    of: int
    worst: int
    ratio: float
    place: Array
    name: str

    def sentence(self) -> str:
        """For the person who runs it, without a full stop."""
        place = ", ".join(f"{x:.4g}" for x in self.place)
        return (
            f"{len(self.elements)} of {self.of} elements of flesh are inside out, "
            f"the worst in '{self.name}' at ({place}) m with det F = {self.ratio:.3g} (element "
            f"{self.worst}). Take shorter steps, stiffen the flesh, or give it larger elements "
            "there"
        )


def inversion(flesh: Flesh, q: Array) -> Inversion | None:
    """What is inside out at positions q (nq,); None when nothing is."""
    ratios = flesh.volume_ratios(q)
    wrong = np.flatnonzero(~(ratios > 0.0))
    if wrong.size == 0:
        return None
    worst = int(wrong[np.argmin(ratios[wrong])])
    middle = flesh.vertices(q)[flesh.elements[worst]].mean(axis=0)
    name = flesh.names[int(flesh.of_element[worst])]
    return Inversion(wrong, len(ratios), worst, float(ratios[worst]), middle, name)
