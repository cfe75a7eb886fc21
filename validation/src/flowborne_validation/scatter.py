"""Scatter of the block in a stream: over its poses (K12), and over its starts (K13)."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from flowborne import Array, Simulation, load_scene, step
from flowborne_validation.controller_in_flow import course, from_wind
from flowborne_validation.findings import Curve, Figure, Figures, Plot

BLOCK = "ns-block-drag-max"

POSES, APART, ARCS = 48, 0.25, (46.0, 34.0)
"""Number of poses in an arc, degrees from each to the next, and middles of the arcs in degrees, at
the first of which the scene starts."""

SHAPES = {"box": 'size="0.1 0.5 0.5"', "capsule": 'type="capsule" size="0.1 0.4" euler="90 0 0"'}
"""The block's geom in MJCF, and a capsule of the same length and width."""

STREAMS = {"ideal": 0.0, "Re 100": 10.0}
"""Viscosities in Pa s; rho U L is 1000 Pa s."""


def arc(middle: float) -> Array:
    """(POSES,) angles in degrees about a middle."""
    half = 0.5 * APART * (POSES - 1)
    return np.linspace(middle - half, middle + half, POSES)


def settled(shape: str, viscosity: float, cells: int, angles: Array) -> Array:
    """Objective of the scene at each of some angles in degrees, N per m. It is that of the
    controller's trial of the present pose, with the scene's steps to settle. The flow starts as
    potential flow about that pose: a trial from another pose would add the body's own motion."""
    model = resources.files("flowborne.scenes.library").joinpath("block.xml").read_text()
    found = []
    with TemporaryDirectory() as folder:
        file = Path(folder) / "block.xml"
        geom = f'<geom name="block" {SHAPES[shape]}'
        file.write_text(model.replace(f'<geom name="block" {SHAPES["box"]}', geom))
        for angle in angles:
            settings = {
                "solids.model": str(file),
                "domain.resolution": str(cells),
                "fluid.viscosity": str(viscosity),
                "initial.positions.hinge": str(angle),
            }
            with Simulation(load_scene(BLOCK, settings), workers=1) as simulation:
                controller = simulation.controller
                assert controller is not None
                here = controller.trials(simulation.world, step).values(np.zeros((1, 1)))
            found.append(float(here[0]))
    return np.array(found)


def scatter(values: Array) -> float:
    """Root of the mean square about a fit of fifth degree over equally spaced poses, over the mean
    value."""
    x = np.linspace(-1.0, 1.0, len(values))
    away = values - np.polyval(np.polyfit(x, values, 5), x)
    return float(np.sqrt(np.mean(away**2)) / abs(values.mean()))


def scatter_over_poses(grids: Sequence[int], arcs: int) -> Figures:
    """K12: a smooth objective, up to the scatter that a box's corners keep on any grid; over some
    of ARCS. The largest scatter over the mean is chosen, see K12's reference."""
    found = {}
    for shape in SHAPES:
        for stream in STREAMS:
            title = f"{shape}, {stream}: scatter of the settled objective over its mean"
            found[title] = in_stream(shape, stream, grids, ARCS[:arcs])
    return found


def in_stream(shape: str, stream: str, grids: Sequence[int], arcs: Sequence[float]) -> Figure:
    """Scatter of a shape in a stream on each grid (rms over the arcs), and its drag in the first
    arc."""
    values, lines, curves = [], [], []
    for cells in grids:
        drags = [-settled(shape, STREAMS[stream], cells, arc(middle)) for middle in arcs]
        parts = [scatter(drag) for drag in drags]
        values.append(float(np.sqrt(np.mean(np.square(parts)))))
        said = [f"{100.0 * p:.2f} % about {a:g} degrees" for a, p in zip(arcs, parts, strict=True)]
        lines.append(f"{cells:>6g} cells a side: {', '.join(said)}")
        curves.append(Curve(f"{cells} cells a side", arc(arcs[0]), drags[0]))
    return Figure(values, grids, lines=lines, plot=Plot("angle (degrees)", "drag (N/m)", curves))


def scatter_over_starts(grids: Sequence[int]) -> Figures:
    """K13: final poses of most drag from several starts, on which they should not depend. Poses at
    the same angle to either side of the stream are mirror images, and count as the same."""
    starts = np.linspace(30.0, 60.0, 8)
    means, deviations, lines = [], [], []
    for cells in grids:
        finals = [course(BLOCK, resolution=cells, start=start).final for start in starts]
        angles = np.array([from_wind(final) for final in finals])
        means.append(float(angles.mean()))
        deviations.append(float(angles.std(ddof=1)))
        ends = (f"{s:.3g} to {f:.2f}" for s, f in zip(starts, finals, strict=True))
        lines.append(f"{cells:>6g} cells a side, degrees: {', '.join(ends)}")
    title = f"{BLOCK}: mean of the final angles to the stream, degrees"
    return {
        title: Figure(means, grids, lines=lines),
        f"{BLOCK}: their standard deviation, degrees": Figure(deviations, grids),
    }
