"""Turek and Hron's channel with a flag behind a cylinder: rigid in D2, of flesh in D3."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from flowborne import Array, Fluid, Grid, Setup, SolidModel, StepReport, World
from flowborne.bodies import FleshMesh, FleshTable
from flowborne.worlds import Boundaries, BoundaryInflow, BoundaryNoSlip, BoundaryOpen
from flowborne_validation.case import reference
from flowborne_validation.findings import Figure, Figures
from flowborne_validation.flesh import round_root
from flowborne_validation.flesh_bars import flat_mesh, grown_from, tissue_table
from flowborne_validation.shedding import Oscillation, amplitude, crest
from flowborne_validation.worlds import NOWHERE, Parabola, mjcf, recorded, refined

LENGTH, HEIGHT = 2.5, 0.41
"""m, of the channel."""

CYLINDER = '<geom type="cylinder" pos="0.2 0.2 0" size="0.05 0.5"/>'
RIGID = mjcf(CYLINDER, '<geom type="box" pos="0.4 0.2 0" size="0.2 0.01 0.5"/>')
"""The cylinder, and with the rigid flag of D2 from the cylinder's middle to its end A."""

END, SIZE = (0.6, 0.2), (0.35, 0.02)
"""A, the middle of the flag's end, and length from the cylinder on and thickness, m."""

DENSITY, VISCOSITY = 1000.0, 1.0
"""Of the fluid, kg/m^3 and Pa s."""

CELLS, CFL = (35, 2), 1.0
"""Cells of flesh along and across the flag, with which D1 is 0.5 % off; cells that the fastest
inflow crosses in a step."""

BEHIND = 0.1
"""Cells between A and the plane of the grid before it. With 44 cells across the channel and steps
of 41 the sides of the flag at rest lie 0.39 and 0.54 of a cell above planes. On others, and with
its end in other places, it has another lift: D6."""


@dataclass(frozen=True)
class Flow:
    """A row of the benchmark.

    mean     velocity of the inflow over its height, m/s
    longest  s until it is steady or periodic on the first grid
    tissue   of the flag; None for a rigid one
    """

    name: str
    mean: float
    longest: float
    tissue: FleshTable | None = None

    @property
    def peak(self) -> float:
        return 1.5 * self.mean

    @property
    def case(self) -> str:
        """Its case in the reference list."""
        return "D2" if self.tissue is None else "D3"


SETTLING = 0.1
"""Damping time of the flesh of FSI1, s. It has no effect at rest; without it the swing after 4 s is
still a fifth of the deflection."""


def flag_tissue(shear: float, density: float, damping: float = 0.0) -> FleshTable:
    """St. Venant-Kirchhoff material with a shear modulus in N/m^2 and Poisson's ratio 0.4."""
    return tissue_table(2.8 * shear, 0.4, density, damping)


def flag_of(tissue: FleshTable) -> SolidModel:
    """The flag behind the cylinder, held by a row of its cells in the cylinder."""
    along, across = CELLS
    inside = SIZE[0] / along
    points, elements = flat_mesh((along + 1, across), (SIZE[0] + inside, SIZE[1]))
    points[:, 0] -= inside
    held = points[:, 0] < 0.5 * inside
    points[:, 0] += round_root(points[:, 1]) * np.minimum(1.0, 1.0 - points[:, 0] / SIZE[0])
    points[:, :2] += np.array(END) - (SIZE[0], 0.0)
    mesh = FleshMesh(points, elements, tuple("clamp" if h else "" for h in held))
    cylinder = CYLINDER.replace("/>", ' contype="0" conaffinity="0"/>')
    return grown_from(mesh, tissue, cylinder, NOWHERE)


CFD = (Flow("CFD1", 0.2, 8.0), Flow("CFD2", 1.0, 5.0), Flow("CFD3", 2.0, 6.0))
FSI = (
    Flow("FSI1", 0.2, 8.0, flag_tissue(0.5e6, 1e3, SETTLING)),
    Flow("FSI2", 1.0, 10.0, flag_tissue(0.5e6, 1e4)),
    Flow("FSI3", 2.0, 6.0, flag_tissue(2.0e6, 1e3)),
)


def channel(cells: int, flow: Flow, behind: float = BEHIND, rigid: str = RIGID) -> World:
    """The channel at rest, `cells` across it; the cylinder belongs to the world, body 0.

    behind  cells between A and the plane of the grid before it
    rigid   MJCF of cylinder and flag, if the flag is rigid
    """
    h = HEIGHT / cells
    ahead = (behind - END[0] / h) % 1.0
    wall = BoundaryNoSlip()
    fluid = Fluid(
        Grid.slab(round(LENGTH / h + ahead), cells, h, (-ahead * h, 0.0)),
        DENSITY,
        VISCOSITY,
        Boundaries(BoundaryInflow(Parabola(flow.peak)), BoundaryOpen(), wall, wall),
        tolerance=1e-7,
    )
    if flow.tissue is None:
        solid = SolidModel.from_string(rigid, slab=True, gravity=NOWHERE)
    else:
        solid = flag_of(flow.tissue)
    return World.at_rest(Setup(solid, fluid))


def time_step(world: World, flow: Flow) -> float:
    """s, see CFL."""
    return CFL * world.flow()[0].grid.spacing / flow.peak


def moved(world: World) -> Array:
    """(2,) displacement of A, m; zero for a rigid flag."""
    flesh = world.setup.solid.flesh
    if flesh is None:
        return np.zeros(2)
    away = np.abs(flesh.rest[:, :2] - END).max(axis=1)
    a = int(np.argmin(away))
    return np.asarray(flesh.vertices(world.solid.q)[a] - flesh.rest[a])[:2]


def march(world: World, flow: Flow, seconds: float) -> Array:
    """(steps, 4) drag and lift of cylinder and flag together, N/m, and displacement of A, m."""
    dt = time_step(world, flow)

    def figures(report: StepReport) -> tuple[float, ...]:
        forces = (report.pressure_wrench + report.viscous_wrench)[:, :2].sum(axis=0)
        return (*forces, *moved(world))

    return recorded(world, dt, round(seconds / dt), figures)


SHORTER, LAST = 0.5, 0.1
"""Parts of a flow's longest time: on finer grids and when quick; the last of that time, for the
means and the remaining changes."""


def steady(flow: Flow, grids: Sequence[int], quick: bool) -> tuple[Array, list[str]]:
    """(4, grids) drag, lift and displacement of A in a steady flow, and their changes as text."""
    found, lines = [], []
    for n, world, first in refined(grids, partial(channel, flow=flow), Parabola(flow.peak)):
        rows = march(world, flow, flow.longest * (1.0 if first and not quick else SHORTER))
        last = rows[-max(2, round(LAST * len(rows))) :]
        found.append(last.mean(axis=0))
        drag, lift, *_ = np.ptp(last, axis=0)
        title = f"drag still changes by {drag:.2g}, lift by {lift:.2g}"
        lines.append(f"{n:>6g} cells across the channel: {title}")
    return np.array(found).T, lines


PERIODS = 4
"""Evaluated periods at the end of a run."""


@dataclass(frozen=True)
class Flutter:
    """Figures of a periodic motion, or of one that has come to rest.

    means, amplitudes  (4,) mean and half the difference of the extremes of drag (N/m), lift (N/m)
                       and the two coordinates of A (m), over whole periods
    frequency          Hz, of a rigid flag's lift, or of A across the channel; 0 at rest
    line               its deviation from a periodic motion
    """

    means: Array
    amplitudes: Array
    frequency: float
    line: str


def flutter(rows: Array, dt: float) -> Flutter:
    """Figures of the last PERIODS periods of drag, lift and displacement of A (steps, 4). With
    fewer periods, of the LAST part of the rows."""
    _, lift, _, up = rows.T
    clock = up if up.any() else lift
    seen = Oscillation(dt, clock)
    if seen.rises().size <= PERIODS:
        last = rows[-round(LAST * len(rows)) :]
        middle, swing = 0.5 * (last.max(axis=0) + last.min(axis=0)), 0.5 * np.ptp(last, axis=0)
        return Flutter(middle, swing, 0.0, f"at rest; lift still changes by {2.0 * swing[1]:.2g}")
    steps, period = seen.last(PERIODS)
    last = rows[steps]
    middle = [0.5 * (crest(v)[0] - crest(-v)[0]) for v in last.T]
    swing = [amplitude(v) for v in last.T]
    count = round(period / dt)
    first, final = (amplitude(part) for part in (last[:count, 1], last[-count:, 1]))
    line = f"lift's amplitude {first:.5g} in the first period, {final:.5g} in the last"
    return Flutter(np.array(middle), np.array(swing), 1.0 / period, line)


def periodic(flow: Flow, grids: Sequence[int]) -> tuple[Array, Array, Array, list[str]]:
    """A flow that flutters, grid after grid: means (4, grids), amplitudes (4, grids), frequencies
    (grids,), and deviations from a periodic motion as text."""
    seen, lines = [], []
    for n, world, first in refined(grids, partial(channel, flow=flow), Parabola(flow.peak)):
        rows = march(world, flow, flow.longest * (1.0 if first else SHORTER))
        seen.append(flutter(rows, time_step(world, flow)))
        lines.append(f"{n:>6g} cells across the channel: {seen[-1].line}")
    means, swings = np.array([s.means for s in seen]).T, np.array([s.amplitudes for s in seen]).T
    return means, swings, np.array([s.frequency for s in seen]), lines


def rigid_flag(grids: Sequence[int], quick: bool) -> Figures:
    """D2: drag and lift of the rigid flag in a steady flow."""
    found: dict[str, Figure] = {}
    for flow in CFD[:2]:
        values, lines = steady(flow, grids, quick)
        exact = reference("D2", flow.name)
        found[f"{flow.name}, drag"] = Figure(values[0], grids, exact["drag"], lines=lines)
        found[f"{flow.name}, lift"] = Figure(values[1], grids, exact["lift"])
    return found


def rigid_flag_in_vortices(grids: Sequence[int]) -> Figures:
    """D2: the same with the vortices of CFD3."""
    means, swings, frequencies, lines = periodic(CFD[2], grids)
    exact, found = reference("D2", "CFD3"), {}
    for name, mean, swing in zip(("drag", "lift"), means[:2], swings[:2], strict=True):
        found[f"CFD3, {name} mean"] = Figure(mean, grids, exact[f"{name} mean"], lines=lines)
        found[f"CFD3, {name} amplitude"] = Figure(swing, grids, exact[f"{name} amplitude"])
    return found | {"CFD3, frequency": Figure(frequencies, grids, exact["frequency"])}


def flag_of_flesh(grids: Sequence[int], quick: bool) -> Figures:
    """D3: FSI1, which comes to rest."""
    values, lines = steady(FSI[0], grids, quick)
    found = {}
    for axis, name in ((2, "ux"), (3, "uy"), (0, "drag"), (1, "lift")):
        exact, low, high = reference("D3", "FSI1")[name]
        judged = {"within": (low, high), "tolerance": f"{low:g} to {high:g}"}
        shown = lines if axis == 2 else ()
        figure = Figure(values[axis], grids, exact, lines=shown, judged=judged)
        found[f"FSI1, {name}"] = figure
    return found


def fluttering_flags(grids: Sequence[int]) -> Figures:
    """D3: FSI2 and FSI3."""
    found = {}
    for flow in FSI[1:]:
        means, swings, frequencies, lines = periodic(flow, grids)
        exact = reference("D3", flow.name)
        for name, mean, swing in zip(("drag", "lift", "ux", "uy"), means, swings, strict=True):
            listed, published = ", ".join(f"{v:.4g}" for v in mean), exact[f"{name} mean"]
            shown = [f"mean {listed} from grid to grid, published {published:g}", *lines]
            title = f"{name} amplitude"
            found[f"{flow.name}, {title}"] = Figure(swing, grids, exact[title], lines=shown)
        found[f"{flow.name}, frequency"] = Figure(frequencies, grids, exact["frequency"])
    return found
