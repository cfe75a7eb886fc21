"""Sites of a model: named frames on its bodies."""

from __future__ import annotations

from typing import NamedTuple

from flowborne.kernels.arrays import Array
from flowborne.solids.geoms import rotation_of
from flowborne.solids.model import SolidModel


class Site(NamedTuple):
    """A frame on a body.

    body      number of the body
    position  (3,) of its origin in the body's frame, m
    rotation  (3, 3) its axes in the body's frame, as columns
    """

    body: int
    position: Array
    rotation: Array


def sites(model: SolidModel) -> dict[str, Site]:
    """The sites of a model by name."""
    mj = model.mj
    return {
        mj.site(n).name: Site(int(body), mj.site_pos[n].copy(), rotation_of(mj.site_quat[n]))
        for n, body in enumerate(mj.site_bodyid)
    }
