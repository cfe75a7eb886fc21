"""What a scene says that can be run and is implausible.

A warning is one sentence for people, without a full stop: where, what is implausible with its
value, and after a semicolon a value that would do. A kind of warning is a function in WARNINGS.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from flowborne.base.phrases import listed, rounded_up
from flowborne.control.objective_kinds import ObjectiveInputMotionTable
from flowborne.coupling.world import TRIAL_TOLERANCE, Setup
from flowborne.motion.clip_reading import MIN_STANDING_COSINE, standing_axis
from flowborne.motion.tracks import SPEED_SAMPLES
from flowborne.scenes.bodies import bones_of, held_joints, in_centimetres, left_free, undriven
from flowborne.scenes.build import surroundings_of
from flowborne.scenes.capture import capture_of
from flowborne.scenes.flesh import staleness
from flowborne.scenes.motions import ServoPDTable
from flowborne.scenes.schema import Scene
from flowborne.scenes.warn_bodies import (
    bodies_not_met,
    discs_not_met,
    fixed_outside,
    floors_in_fluid,
    implausible_density,
    leaking_bodies,
    lost_in_domain,
    mass_apart,
    only_to_see,
    thin_bodies,
)
from flowborne.scenes.warn_speed import fast_bodies, fast_flow, unlike_the_sea
from flowborne.scenes.warn_stops import past_stops, soft_stops
from flowborne.scenes.warn_trim import counted_twice, pinned_under_lid
from flowborne.scenes.warn_units import (
    clips,
    densities_alone,
    gravity,
    inertias,
    model_in_centimetres,
    ranges,
    sizes,
    slow_steps,
    winds,
)
from flowborne.solids.model import SLIDE, joint_kind, joint_unit

LEAST_STRENGTH = 2.0 * math.pi
"""Degrees/s. Whoever types radians for anything up to a turn a second types less than this; in
degrees it is a right angle in 14 s."""

GRADIENT_ERROR = 1e-3
"""Relative error of a gradient that trials are solved for (`coupling.world.TRIAL_TOLERANCE`)."""

LEAST_PROBE = math.degrees(TRIAL_TOLERANCE / GRADIENT_ERROR)
"""Degrees, 0.57. The pressure of a trial is right to TRIAL_TOLERANCE of itself, and two trials
differ by about the probe in radians of it: a smaller probe has a gradient worse than
GRADIENT_ERROR."""


def angles_in_radians(scene: Scene, setup: Setup) -> Iterator[str]:
    """Strengths and probes of turning joints so small that they are radians by their looks."""
    for number, table in enumerate(scene.control, start=1):
        if joint_kind(setup.solid, table.joints[0]) == SLIDE:
            continue
        strength = max(table.strengths)
        if strength < LEAST_STRENGTH * (1.0 - 1e-9):
            yield (
                f"[[control]] {number}: a strength of {strength:g} degrees/s takes "
                f"{90.0 / strength:.3g} s to a right angle; "
                f"{_meant(strength, LEAST_STRENGTH, 'rad/s', 'degrees/s')}"
            )
        if table.probe < LEAST_PROBE * (1.0 - 1e-9):
            yield (
                f"[[control]] {number}: a probe of {table.probe:g} degrees is too small for a "
                f"gradient; {_meant(table.probe, LEAST_PROBE, 'rad', 'degrees')}"
            )


def _meant(value: float, least: float, radians: str, degrees: str) -> str:
    """The number in degrees, if it was radians, and if not, or if that is no better, the least."""
    turned = f"{math.degrees(value):.3g}"
    if float(turned) >= least:
        return f"{value:g} {radians} are {turned} {degrees}"
    return f"{rounded_up(least)} {degrees} will do"


def too_slow(scene: Scene, setup: Setup) -> Iterator[str]:
    """Joints that are to be close to a motion which is faster than they can be.

    A target is no farther ahead of its joint than strength lets it be in a decision, and a PD law
    is 2 / w behind a steady rate: it goes at w / 2 times what the target is ahead.
    """
    able, time, model = scene.controller, scene.controller.every * scene.frame_time, setup.solid
    share = 1.0
    if isinstance(able.servo, ServoPDTable):
        share = min(1.0, np.pi * able.servo.frequency * time)
    times = np.linspace(0.0, scene.time.frames * scene.frame_time, SPEED_SAMPLES)
    around = surroundings_of(scene, model)
    for number, table in enumerate(scene.objectives, start=1):
        if not isinstance(table, ObjectiveInputMotionTable):
            continue
        motion, unit = table.reference(around), joint_unit(model, table.joint)
        needed = max(float(np.linalg.norm(motion.velocity(at))) for at in times) / unit
        for place, control in enumerate(scene.control, start=1):
            fastest = share * control.strength
            if table.joint in control.joints and needed > fastest * (1.0 + 1e-9):
                rate = "m/s" if joint_kind(model, table.joint) == SLIDE else "degrees/s"
                yield (
                    f"[[objectives]] {number}: '{table.joint}' is to be close to a motion of "
                    f"up to {needed:.3g} {rate}, and goes at {fastest:.3g} at most; a strength of "
                    f"{rounded_up(needed / share)} in [[control]] {place}"
                    + (" or a larger frequency of its servo" if share < 1.0 else "")
                    + " lets it follow"
                )


def limp_joints(scene: Scene, setup: Setup) -> Iterator[str]:
    """Joints between bodies that nothing drives and that have no stiffness; see `undriven`."""
    limp = undriven(scene, setup.solid, setup.motions)
    if limp:
        yield (
            f"[solids]: nothing drives {listed(limp)}, and no stiffness holds "
            f"{'it' if len(limp) == 1 else 'them'}; hold = true keeps joints as they start, "
            "[[motion]], [[control]] and [[actuator]] move them, and stiffness in the model makes "
            "them springs"
        )


def holding_nothing(scene: Scene, setup: Setup) -> Iterator[str]:
    """A hold = true in a model that has no joint for it."""
    if scene.solids is None or scene.solids.hold is not True:
        return
    if held_joints(setup.solid, setup.motions):
        return
    free = left_free(scene, setup.solid, setup.motions)
    tip = f"hold = {json.dumps(free)} holds {listed(free)}" if free else "drop it"
    yield (
        "[solids]: hold = true holds no joint: it is for those between bodies that nothing drives, "
        f"and not for joints on the world or in a loop; {tip}"
    )


def lying(scene: Scene, setup: Setup) -> Iterator[str]:
    """A person who would stand with another axis of the file up."""
    capture = capture_of(scene)
    if scene.clip is None or capture is None or capture.posture is None:
        return
    other = standing_axis(capture.posture, capture.up)
    if capture.posture[2] < MIN_STANDING_COSINE and other is not None:
        yield (
            f"[clip]: with up = '{capture.up}' the person of {scene.clip.file} lies; "
            f"up = '{other}' makes it stand"
        )


def stale_meshes(scene: Scene, setup: Setup) -> Iterator[str]:
    """Meshes that flesh names and that were not made of it."""
    for number, table in enumerate(scene.flesh, start=1):
        if why := staleness(bones_of(scene), table, scene.folder):
            yield (
                f"[[flesh]] {number}: {table.mesh} {why}, so that each process meshes the flesh "
                "anew, differently, and a run keeps the mesh that it began with; copy "
                f"{table.kept_as} from the folder of a run to the scene, and name it as mesh"
            )


Warn = Callable[[Scene, Setup], Iterator[str]]
"""Warnings of one kind about a scene and what was built of it."""

WARNINGS: tuple[Warn, ...] = (
    sizes,
    gravity,
    model_in_centimetres,
    winds,
    densities_alone,
    inertias,
    leaking_bodies,
    thin_bodies,
    lost_in_domain,
    implausible_density,
    mass_apart,
    only_to_see,
    bodies_not_met,
    counted_twice,
    pinned_under_lid,
    floors_in_fluid,
    fixed_outside,
    fast_bodies,
    fast_flow,
    slow_steps,
    ranges,
    clips,
    angles_in_radians,
    too_slow,
    limp_joints,
    holding_nothing,
    stale_meshes,
    soft_stops,
    past_stops,
    lying,
    unlike_the_sea,
    discs_not_met,
)
"""In the order in which they are listed."""


KINDS: dict[str, Warn] = {warn.__name__: warn for warn in WARNINGS}
"""Name of each kind, as in [accepted_warnings]."""


IN_METRES: tuple[Warn, ...] = (
    sizes,
    gravity,
    winds,
    densities_alone,
    implausible_density,
    mass_apart,
)
"""Those that compare a scene with the world in m and kg."""


def warnings_of(scene: Scene, setup: Setup) -> list[str]:
    """All warnings about a scene that it does not accept, the same before, during and after a
    run."""
    kinds = [warn for kind, warn in KINDS.items() if kind not in scene.accepted_warnings]
    if in_centimetres(scene):
        kinds = [warn for warn in kinds if warn not in IN_METRES]
    return [warning for warn in kinds for warning in warn(scene, setup)]


def accepted_of(scene: Scene, setup: Setup) -> list[str]:
    """The warnings that the scene accepts, each with its reason, as notes."""
    return [
        f"{warning}. Accepted: {why}"
        for kind, why in scene.accepted_warnings.items()
        for warning in KINDS[kind](scene, setup)
    ]


def headline(warnings: Sequence[str], notes: Sequence[str]) -> str:
    """How many there are: "2 warnings", or "no warnings, 1 note"."""
    count, more = len(warnings), len(notes)
    said = f"{count or 'no'} warning{'s' * (count != 1)}"
    return f"{said}, {more} note{'s' * (more > 1)}" if more else said
