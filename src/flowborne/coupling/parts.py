"""Into how many parts a step is divided: no body crosses more than one cell in any.

What a body leaves behind and takes up is known on the mean of both ends of a step alone, so that
fluid leaks through a plate that crosses more than its own thickness: 8.8 % of the dye at 2.4 cells
a step. The fluid's own speed asks for no parts: its transport has substeps (see `fluid.transport`).
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from flowborne.coupling.motion import JointCommand
from flowborne.coupling.operators import twists
from flowborne.coupling.report import StepReport
from flowborne.coupling.world import World
from flowborne.fluid.grid import Array
from flowborne.fluid.transport import parts_for
from flowborne.solids.dynamics import kinematics


def parts_of(world: World, velocity: Array, dt: float) -> int:
    """Number of parts of a step in which the bodies move with `velocity` (nv,) for `dt` (s): no
    point of them crosses more than a cell in a part."""
    fluid, model = world.setup.fluid, world.setup.solid
    if fluid is None or fluid.one_way or not velocity.any():
        return 1
    pose, fastest = kinematics(model, world.solid.q), 0.0
    shapes = world.setup.shapes
    if shapes.body.size:
        turned = np.einsum("gij,gkj->gki", pose.geom_rotation[shapes.source], shapes.tips)
        at = turned + pose.geom_position[shapes.source][:, None]
        twist = twists(pose, velocity)[shapes.body][:, None]
        speed = twist[..., :3] + np.cross(twist[..., 3:], at)
        fastest = float(np.linalg.norm(speed, axis=-1).max())
    if pose.vertices.size:
        skin = (pose.vertex_jacobian @ velocity).reshape(-1, 3)
        fastest = max(fastest, float(np.linalg.norm(skin, axis=1).max()))
    return parts_for(fastest * dt / fluid.grid.spacing)


def part_of(command: JointCommand, world: World, left: int) -> JointCommand:
    """What the joints do in the next of `left` parts of what is left of a step: the same, but
    drives that may give way change their velocity evenly."""
    part, v = command.copy(), world.solid.v
    limited = np.isfinite(command.torque_limit)
    evenly = v + (command.final_velocity - v) / left
    part.final_velocity[limited] = evenly[limited]
    return part


def joined(reports: list[StepReport]) -> StepReport:
    """The report of a step from those of its parts: means of forces, sums of what was exchanged,
    and the state at the end."""
    last = reports[-1]
    if len(reports) == 1:
        return last

    budget = [report.momentum for report in reports]
    sums = ("exchanged", "advection", "boundary", "crossed", "jet", "forces")
    momentum = replace(
        last.momentum,
        **{name: np.sum([getattr(m, name) for m in budget], axis=0) for name in sums},
        exchange_error=max(m.exchange_error for m in budget),
        budget_error=max(m.budget_error for m in budget),
    )
    means = [f.name for f in fields(StepReport) if f.name.endswith("_wrench")]
    means += ["actuator", "centre"]
    return replace(
        last,
        dt=sum(report.dt for report in reports),
        **{n: np.mean([getattr(r, n) for r in reports], axis=0) for n in means},
        iterations=sum(r.iterations for r in reports),
        divergence=max(r.divergence for r in reports),
        fastest=max(r.fastest for r in reports),
        momentum=momentum,
        work=sum(r.work for r in reports),
        expelled=sum(r.expelled for r in reports),
        dye_error=max(r.dye_error for r in reports),
        seconds={k: sum(r.seconds.get(k, 0.0) for r in reports) for k in last.seconds},
        limited=np.unique(np.concatenate([r.limited for r in reports])),
    )
