"""The fluid of a scene: grid, boundaries, sources, dyes."""

from __future__ import annotations

from collections.abc import Callable

from flowborne.coupling.world import Fluid
from flowborne.fluid.boundary import (
    SIDES,
    Boundaries,
    Boundary,
    BoundaryClosed,
    BoundaryInflow,
    BoundaryNoSlip,
    BoundaryOpen,
    BoundaryPeriodic,
    Source,
)
from flowborne.fluid.grid import Array, Grid
from flowborne.motion.inflow import (
    Bands,
    DyeBandsValue,
    Factor,
    FactorKeyframes,
    FactorRamp,
    FactorSteady,
    ProfileParabolic,
    ProfileUniform,
    Span,
    even_bands,
)
from flowborne.motion.tracks import Curve
from flowborne.scenes.check_fluid import band_axis
from flowborne.scenes.schema import Scene
from flowborne.scenes.schema_fluid import (
    BoundarySide,
    ClosedSide,
    Domain,
    DyeBands,
    DyeBox,
    InflowSide,
    NoSlipSide,
    OpenSide,
    SourceTable,
)
from flowborne.tables import as_interval, triple

DyeValue = Callable[[Array, Array, Array, float], Array]


def grid_of(domain: Domain) -> Grid:
    """The grid that fills a domain; a domain with corners of two numbers is a slab."""
    counts, h = domain.counts(), domain.spacing()
    if len(counts) == 2:
        return Grid.slab(counts[0], counts[1], h, (domain.lower[0], domain.lower[1]))
    x, y, z = domain.lower
    return Grid((counts[0], counts[1], counts[2]), h, (x, y, z))


def fluid_of(scene: Scene) -> Fluid | None:
    """The fluid's fixed properties; None when the scene has none, or leaves it out."""
    if scene.domain is None or not scene.has_fluid:
        return None
    assert scene.fluid is not None
    assert scene.boundaries is not None
    table, grid = scene.fluid, grid_of(scene.domain)
    sides = {
        name: _boundary(name, side, scene, grid)
        for name, side in scene.boundaries
        if not (scene.is_slab and name[0] == "z")
    }
    x, y, z = table.body_force
    return Fluid(
        grid,
        table.density,
        viscosity=table.viscosity,
        boundaries=Boundaries(**sides),
        sources=tuple(_source(source) for source in scene.sources) + tuple(_boxes(scene)),
        scalars=scene.scalars(),
        body_force=(x, y, z),
        advection=table.advection,
        tolerance=table.tolerance,
        one_way=table.coupling == "one-way",
    )


def _boundary(name: str, side: BoundarySide, scene: Scene, grid: Grid) -> Boundary:
    if isinstance(side, ClosedSide):
        return BoundaryClosed()
    if isinstance(side, NoSlipSide):
        x, y, z = side.velocity
        return BoundaryNoSlip((x, y, z))
    if isinstance(side, OpenSide):
        return BoundaryOpen()
    if isinstance(side, InflowSide):
        return BoundaryInflow(_profile(name, side, grid), _entering_dyes(name, scene, grid))
    return BoundaryPeriodic()


def _profile(name: str, side: InflowSide, grid: Grid) -> ProfileUniform | ProfileParabolic:
    x, y, z = side.velocity
    if side.profile == "uniform":
        return ProfileUniform((x, y, z), _factor(side))
    normal = SIDES.index(name) // 2
    spans = tuple(_span(axis, grid) for axis in grid.axes if axis != normal)
    return ProfileParabolic((x, y, z), spans, _factor(side))


def _span(axis: int, grid: Grid) -> Span:
    return axis, grid.origin[axis], grid.upper[axis]


def _factor(side: InflowSide) -> Factor:
    if side.times is not None and side.factors is not None:
        return FactorKeyframes(Curve(side.times, side.factors))
    return FactorRamp(side.ramp) if side.ramp > 0.0 else FactorSteady()


def _entering_dyes(side: str, scene: Scene, grid: Grid) -> dict[str, DyeValue]:
    groups: dict[str, tuple[Bands, ...]] = {}
    for dye in scene.dye:
        if isinstance(dye, DyeBands) and dye.side == side:
            groups[dye.name] = (*groups.get(dye.name, ()), _bands(dye, grid))
    return {name: DyeBandsValue(bands) for name, bands in groups.items()}


def _bands(dye: DyeBands, grid: Grid) -> Bands:
    axis, low, high = _span("xyz".index(band_axis(dye)), grid)
    ends = dye.bands
    if ends is None:
        assert dye.count is not None
        assert dye.width is not None
        ends = even_bands(low, high, dye.count, dye.width)
    return Bands(axis, ends, dye.value, as_interval(dye.start, dye.stop))


def _source(table: SourceTable) -> Source:
    return Source(
        triple(table.lower),
        triple(table.upper),
        table.volume_rate,
        None if table.velocity is None else triple(table.velocity),
        dict(table.dye),
        as_interval(table.start, table.stop),
    )


def _boxes(scene: Scene) -> list[Source]:
    return [
        Source(
            triple(dye.lower),
            triple(dye.upper),
            scalars={dye.name: dye.value},
            times=as_interval(dye.start, dye.stop),
        )
        for dye in scene.dye
        if isinstance(dye, DyeBox)
    ]
