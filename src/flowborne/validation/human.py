"""A standing human whose back and arms look for least effort: K8 and K9."""

from __future__ import annotations

import numpy as np

from flowborne import Array, Simulation, load_scene
from flowborne.validation.case import Case, Finding, Tier, at_most
from flowborne.validation.standing import (
    BACK,
    MASS,
    SHOULDERS,
    SPREAD,
    G,
    Load,
    Pose,
    settled,
    standing,
)

LEANS = ((12.0, 15.0, 10.0), (-20.0, 5.0, 0.0), (0.0, -25.0, -15.0))
"""Of the back, degrees; see `Pose`."""

RAISED_THIGH = (25.0, -40.0, 0.0)
"""Left thigh spread and lifted into the way of the hanging arm."""


def torque_at_back(simulation: Simulation) -> Array:
    """(3,) torque of its drive in the world's axes, N m; a ball joint tells it in its body's."""
    return np.asarray(simulation.body(BACK).rotation @ simulation.joint(BACK).drive)


def back_over_hips(quick: bool) -> list[Finding]:
    """K8: the back brings what is above it over itself; its effort is the weight's moment."""
    findings = []
    for lean in LEANS[: 1 if quick else None]:
        free = settled(standing("human-gravity-back", {**SPREAD, BACK: lean}, initial={}))
        said = f"centre of mass beside the back's joint from a lean of {lean} degrees, m"
        findings.append(at_most(said, Load.on(free, BACK).off_centre, 0.01))
    said = "torque at the back over M g (x_c - x_j), less one, about both horizontal axes"
    return [*findings, at_most(said, max(map(torque_off_moment, LEANS)), 1e-6)]


def torque_off_moment(lean: tuple[float, float, float]) -> float:
    """Torque that holds a back in a lean, less the weight's moment, in parts of that."""
    held = standing(
        "human-gravity-back", {**SPREAD, BACK: lean}, initial={}, control=[], objectives=[]
    )
    held.advance_frame()
    load = Load.on(held, BACK)
    moment = load.mass.sum() * G * np.array([load.reach[1], -load.reach[0], 0.0])
    return float(np.abs(torque_at_back(held) - moment).max() / np.linalg.norm(moment))


def arms_hang(quick: bool) -> list[Finding]:
    """K9: arms hang below the shoulders and the rest balances; a leg in the way is answered.

    Free arms are those of the standard body: the scene's own has thighs that reach its hands.
    """
    start: Pose = {
        BACK: (12.0, 15.0, 10.0),
        "left_shoulder": (10.0, -40.0, 0.0),
        "right_shoulder": (-20.0, 30.0, 0.0),
    }
    arms = settled(standing("human-gravity-arms", start, human={"mass": MASS}))
    findings = [
        at_most(f"centre of mass beside {joint}, m", Load.on(arms, joint).off_centre, 0.01)
        for joint in (BACK, *SHOULDERS)
    ]
    return [*findings, arms_serve_the_back(), *arm_is_blocked()]


def arms_serve_the_back() -> Finding:
    """Arms with no wish but the back's least effort, over arms that hang, on a back that leans."""
    serving, hanging = back_held(arms_serve=True), back_held(arms_serve=False)
    said = "back's effort with arms that serve it alone, over arms that hang"
    return Finding(said, serving / hanging, "< 1", "less", serving < hanging)


def back_held(arms_serve: bool) -> float:
    """N m that hold a leaning back when the arms have done one of the things that they want.

    arms_serve  whether that is least effort of the back, or of their own
    """
    tables = load_scene("human-gravity-arms").model_dump(exclude_none=True)
    wishes = [wish for wish in tables["objectives"] if wish["wanted_by"] != (BACK,)]
    simulation = standing(
        "human-gravity-arms",
        {BACK: (0.0, 10.0, 0.0)},
        human={"mass": MASS},
        control=[table for table in tables["control"] if table["joints"] == SHOULDERS],
        objectives=[wish for wish in wishes if (wish["joints"] == (BACK,)) == arms_serve],
    )
    return float(np.linalg.norm(torque_at_back(settled(simulation))))


def arm_is_blocked() -> list[Finding]:
    """Fig. 9 b: the left leg is in the way of the left arm."""
    start: Pose = {
        BACK: (0.0, 8.0, 0.0),
        "left_hip": RAISED_THIGH,
        "left_shoulder": (0.0, -35.0, 0.0),
    }
    walker = settled(standing("human-gravity-arms", start))
    left, right = (Load.on(walker, shoulder) for shoulder in SHOULDERS)
    ahead = float(left.reach[0] - right.reach[0])
    shift, expected = torso_shift(Load.on(walker, BACK), left)
    free = Finding(
        "blocked arm's centre of mass ahead of the free one's, m", ahead, "> 0", "ahead", ahead > 0
    )
    said = "torso's shift that balances the blocked arm, less -m_arm d / M_rest, m"
    lines = (f"shift {shift:.4f} m, -m_arm d / M_rest = {expected:.4f} m",)
    return [free, at_most(said, shift - expected, 0.01, lines=lines)]


def torso_shift(back: Load, arm: Load) -> tuple[float, float]:
    """How far forward all but the arm's own reach is from the back, and what balances that reach.

    The arm counts at its shoulder in the first, and by its reach d forward of it in the second.
    """
    in_arm = np.isin(back.names, arm.names)[:, None]
    place = np.where(in_arm, arm.joint, back.centre) - back.joint
    whole = back.mass.sum()
    return float(back.mass @ place[:, 0] / whole), float(-arm.mass.sum() * arm.reach[0] / whole)


CASES = (
    Case("K8", back_over_hips, full=Tier.HALF_HOUR),
    Case("K9", arms_hang, full=Tier.HALF_HOUR),
)
