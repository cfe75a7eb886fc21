"""A standing human in the wind: K10."""

from __future__ import annotations

import numpy as np

from flowborne import Simulation
from flowborne.validation.case import Case, Finding, Tier, at_most, near
from flowborne.validation.standing import (
    BACK,
    SHOULDERS,
    SPREAD,
    G,
    Load,
    human,
    settled,
    standing,
)

SHARE = 0.15
"""Force of the wind that acts at the centre of mass, as a part of the weight."""


def wind_at_centre() -> list[dict[str, object]]:
    """[[wind]]: a force on each body by its mass, so that all of it acts at their centre."""
    model = human()
    return [
        {"kind": "force", "force": [-SHARE * G * mass, 0.0, 0.0], "bodies": [name]}
        for name, mass in zip(model.body_names[1:], model.body_mass[1:].tolist(), strict=True)
    ]


def leans_into_the_wind() -> list[Finding]:
    """(a) The back in a wind at the centre of mass, and in that of eq. (2)."""
    centred = settled(standing("human-wind-back", SPREAD, wind=wind_at_centre()))
    law = float(np.degrees(np.arctan(SHARE)))
    return [
        *lean_findings("wind at the centre of mass", centred),
        near("its angle, atan(F / M g), degrees", Load.on(centred, BACK).lean, law, absolute=1.0),
        *lean_findings("wind on faces", settled(standing("human-wind-back", SPREAD))),
    ]


def lean_findings(said: str, simulation: Simulation) -> list[Finding]:
    """That a back has settled along the net force, into the wind."""
    back = Load.on(simulation, BACK)
    return [
        at_most(f"{said}: net force off the back's line, degrees", back.off_line, 1.0),
        Finding(f"{said}: lean into it, degrees", back.lean, "> 0", "sign", back.lean > 0.0),
    ]


def arms_in_the_wind() -> list[Finding]:
    """(b) Arms along the net force on them, blown back; (c) arms that want least drag."""
    trailing = settled(standing("human-wind-arms", {}))
    findings = []
    for shoulder in SHOULDERS:
        arm = Load.on(trailing, shoulder)
        off, back = f"{shoulder}: net force off the line of the arm, degrees", arm.lean
        findings += [
            at_most(off, arm.off_line, 1.0),
            Finding(f"{shoulder}: blown back by, degrees", back, "> 0", "sign", back > 0.0),
        ]
    held = settled(standing("human-wind-drag", {}))
    drags = [drag_of_arms(simulation) for simulation in (held, trailing)]
    said = "drag of arms that want little of it over that of arms that want little effort"
    findings.append(Finding(said, drags[0] / drags[1], "<= 1", "less", drags[0] <= drags[1]))
    return findings


def drag_of_arms(simulation: Simulation) -> float:
    """Force of the wind on both arms along it, N."""
    return float(-sum(Load.on(simulation, shoulder).force[:, 0].sum() for shoulder in SHOULDERS))


def in_the_wind(quick: bool) -> list[Finding]:
    """K10."""
    return leans_into_the_wind() + arms_in_the_wind()


CASES = (Case("K10", in_the_wind, full=Tier.HALF_HOUR),)
