"""The fluid in the scene: dye, vortices, and a slice with arrows of the velocity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from flowborne.fluid.grid import Grid
from flowborne.kernels.arrays import Array, Mesh, Pixels, Single
from flowborne.runs.states import cell_velocity
from flowborne.view import style
from flowborne.view.browser.meshes import nothing, repeated, show_mesh
from flowborne.view.browser.settings import Settings
from flowborne.view.fields import (
    Field,
    FieldDye,
    FieldNumber,
    FieldVortices,
    Legend,
    Scale,
    faded,
    field_of,
    over,
)
from flowborne.view.glyphs import flat_arrows
from flowborne.view.run import Run, State
from flowborne.view.shot import Shot
from flowborne.view.space.fluid import vortex_surface
from flowborne.view.space.lighting import scattered

if TYPE_CHECKING:
    from viser import SceneApi


MIN_IMAGE_SIDE = 768
"""Minimum longer side of the image that is sent, pixels, unless it has to be fast."""

ARROWS = 28
"""Arrows along the longer side of the plane."""

MIN_SPEED = 0.04
"""Speed below which there is no arrow, in highest speeds."""


ARROW_OFFSET = 0.05
"""Distance of the arrows from the image, in arrow spacings."""

ARROW = np.array([[0, 6, 1], [6, 5, 1], [2, 4, 3]])
"""Triangles of the corners of a flat arrow."""

FINE = 2_000_000
"""Points up to which vortices are found on a grid twice as fine: limited by transfer time."""

MAX_SPLATS = 60_000
"""Maximum number of cells of dye that are sent; beyond it, blocks of eight cells are merged."""

FAINT = 0.08
"""Density of dye below which it is invisible."""

SPLAT_DEVIATION = 0.6
"""Standard deviation of the Gaussian of a cell of dye, in cells."""

DYE_DEPTH = 1.6
"""Depth of full dye that transmits 1/e of the light, in cells."""


def across(axis: int) -> tuple[int, int]:
    """The other two axes."""
    first, second = (n for n in range(3) if n != axis)
    return first, second


def velocity_arrows(grid: Grid, state: State, axis: int, coordinate: float, speed: float) -> Mesh:
    """Flat arrows of the fluid's velocity in a plane normal to an axis at `coordinate`, m.

    speed  m/s, of an arrow that reaches the next one; faster ones have the same length
    """
    sides = across(axis)
    shape = [grid.shape[side] for side in sides]
    stride = max(1, round(max(shape) / ARROWS))
    picked = [np.arange(stride // 2, count, stride) for count in shape]
    layer = int(np.clip((coordinate - grid.origin[axis]) / grid.spacing, 0, grid.shape[axis] - 1))
    at = np.ix_(*(picked[sides.index(n)] if n in sides else [layer] for n in range(3)))
    velocity = cell_velocity(grid, state)[at][..., list(sides)].reshape(-1, 2).astype(float)
    free = (state["open"][at] > 0.5).ravel() & np.isfinite(velocity).all(axis=1)
    share = np.linalg.norm(velocity, axis=1) / speed
    spacing = stride * grid.spacing
    i, j = (index.ravel() for index in np.meshgrid(*picked, indexing="ij"))
    middle = np.array([grid.origin[side] for side in sides])
    middle = middle + grid.spacing * (np.stack([i, j], axis=1) + 0.5)
    shown = free & (share > MIN_SPEED)
    if not shown.any():
        return nothing()
    vectors = (spacing / speed / np.maximum(1.0, share))[:, None] * velocity
    corners = flat_arrows((middle - 0.5 * vectors)[shown], vectors[shown], 0.09 * spacing)
    # on both sides of the image
    points = np.empty((len(corners), 2, 7, 3))
    points[..., list(sides)] = corners[:, None]
    points[..., axis] = coordinate + spacing * np.array([[-ARROW_OFFSET], [ARROW_OFFSET]])
    return repeated(points.reshape(-1, 7, 3), ARROW)


def enlarged(image: Pixels, side: int) -> Pixels:
    """An image (n, m, 3), smoothly enlarged until its longer side has `side` pixels."""
    height, width = image.shape[:2]
    scale = side / max(height, width)
    if scale <= 1.0:
        return image
    small = Image.fromarray(np.ascontiguousarray(image))
    size = (max(1, round(scale * width)), max(1, round(scale * height)))
    large = np.asarray(small.resize(size, Image.Resampling.BICUBIC))
    # cubics undershoot, which would show as dark seams
    return np.maximum(large, image.min(axis=(0, 1)))


class Fluid:
    """The visible fluid of a run, on scales that are taken from its frames on first use.

    toward  (3,) to the camera, which defines clockwise
    """

    def __init__(
        self, scene: SceneApi, run: Run, toward: Array, side: int = MIN_IMAGE_SIDE
    ) -> None:
        """`side`: minimum longer side of an image, pixels."""
        self._side = side
        self.toward = toward
        self._scene, self._run = scene, run
        self._fields: dict[str, Field | None] = {}

    def show(self, state: State, settings: Settings) -> None:
        """Show a state by the settings."""
        grid = self._run.grid_at(state)
        if self._run.is_slab:
            self._show_slab(state, grid, settings)
        else:
            field = self._field(settings.field)
            self._show_dye(state, grid, field if isinstance(field, FieldDye) else None)
            self._show_vortices(state, grid, field if isinstance(field, FieldVortices) else None)
            self._show_slice(state, grid, settings)
        self._show_velocity(state, grid, settings)

    def legend(self, settings: Settings) -> tuple[Legend, Sequence[Scale]]:
        """(name, colour) of what is shown in its own colour, and the colour scales."""
        shown = [self._field(settings.field), self._field(settings.slice)]
        names = [name for field in shown if field is not None for name in field.legend]
        scales = [field.scale for field in shown if field is not None]
        return names, [scale for scale in scales if scale is not None]

    def _show_slab(self, state: State, grid: Grid, settings: Settings) -> None:
        field = self._field(settings.field)
        assert not isinstance(field, FieldVortices)
        image = np.zeros((1, 1, 4), np.uint8) if field is None else field.image(state)
        if self._run.window_axes:
            image = faded(image, self._run.window_axes)
        self._show_image(over(image, self._run.shot.colour), grid, 2, 0.0)

    def _show_slice(self, state: State, grid: Grid, settings: Settings) -> None:
        field = self._field(settings.slice)
        if not isinstance(field, FieldNumber):
            self._scene.remove_by_name("/run/slice")
            return
        axis, coordinate = self._plane(grid, settings)
        image = field.layer(state, axis, (coordinate - grid.origin[axis]) / grid.spacing)
        self._show_image(image.swapaxes(0, 1), grid, axis, coordinate)

    def _plane(self, grid: Grid, settings: Settings) -> tuple[int, float]:
        """Axis normal to the plane that is shown, and its coordinate on the grid of a state, m."""
        if self._run.is_slab:
            return 2, 0.0
        moved = grid.origin[settings.axis] - self._run.grid_at({}).origin[settings.axis]
        return settings.axis, settings.coordinate + moved

    def _show_image(self, image: Pixels, grid: Grid, axis: int, coordinate: float) -> None:
        """Show colours (n, m, 3) of the cells in a plane normal to an axis at `coordinate`, m.

        Rows are along the later of the other two axes, columns along the earlier one.
        """
        first, second = across(axis)
        low, high = np.array(grid.origin), np.array(grid.upper)
        centre = 0.5 * (low + high)
        centre[axis] = coordinate
        axes = np.eye(3)[[first, second]]
        rotation = np.column_stack([*axes, np.cross(*axes)])
        self._scene.add_image(
            "/run/slice",
            enlarged(image, self._side),
            float(high[first] - low[first]),
            float(high[second] - low[second]),
            format="jpeg",
            jpeg_quality=90,
            cast_shadow=False,
            receive_shadow=False,
            wxyz=Rotation.from_matrix(rotation).as_quat(scalar_first=True),
            position=centre,
        )

    def _show_velocity(self, state: State, grid: Grid, settings: Settings) -> None:
        """Show arrows of the velocity in the plane; that of the limit reaches the next arrow."""
        mesh = nothing()
        if settings.velocity:
            plane = self._plane(grid, settings)
            speed = self._field("speed")
            assert isinstance(speed, FieldNumber)
            mesh = velocity_arrows(grid, state, *plane, speed.limit)
        show_mesh(
            self._scene,
            "/run/velocity",
            mesh,
            color=style.rgb(style.TEXT),
            opacity=0.85,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _show_vortices(self, state: State, grid: Grid, vortices: FieldVortices | None) -> None:
        points, faces, warm = np.zeros((0, 3)), np.zeros((0, 3), int), np.zeros(0, bool)
        if vortices is not None:
            surface = vortex_surface(vortices, state, grid, self.toward, FINE)
            if surface.n_points:
                points, faces = surface.points, surface.regular_faces
                warm = surface.point_data["sense"][faces].mean(axis=1) > 0.0
        for name, chosen, colour in (
            ("left", faces[warm], style.SPIN_LEFT[1]),
            ("right", faces[~warm], style.SPIN_RIGHT[1]),
        ):
            show_mesh(
                self._scene,
                f"/run/vortices/{name}",
                (points, chosen),
                color=style.rgb(colour),
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )

    def _show_dye(self, state: State, grid: Grid, dye: FieldDye | None) -> None:
        """Show a Gaussian for each cell with dye, lit as smoke."""
        smoke = None if dye is None else cloud(grid, dye, state, self.toward)
        if smoke is None or not len(smoke[0]):
            self._scene.remove_by_name("/run/dye")
            return
        centres, colours, opacities, size = smoke
        self._scene.add_gaussian_splats(
            "/run/dye",
            centres.astype(np.float32),
            np.broadcast_to((SPLAT_DEVIATION * size) ** 2 * np.eye(3), (len(centres), 3, 3)),
            colours,
            opacities[:, None],
        )

    def _field(self, name: str) -> Field | None:
        if name not in self._fields:
            self._fields[name] = field_of(self._run, Shot.model_validate({"field": name}))
        return self._fields[name]


def cloud(
    grid: Grid, dye: FieldDye, state: State, toward: Array
) -> tuple[Array, Single, Single, float]:
    """Centres (n, 3) m, colours (n, 3) and opacities (n,) of the cells with dye, and their size, m.

    toward  (3,) to the camera, for scattered light
    """
    colour, density = dye.smoke(state)
    size, solid = grid.spacing, (1.0 - state["open"]).astype(np.float32)
    while np.count_nonzero(density > FAINT) > MAX_SPLATS:
        colour, density, solid = _coarser(colour), _coarser(density), _coarser(solid)
        size *= 2.0
    light = scattered(density / np.float32(DYE_DEPTH), solid, toward)
    chosen = np.argwhere(density > FAINT)
    at = tuple(chosen.T)
    centres = np.asarray(grid.origin) + size * (chosen + 0.5)
    # Gaussians at every cell add up to 2 pi SPLAT_DEVIATION^2 times the height of one
    opacity = (1.0 - np.exp(-density[at] / DYE_DEPTH)) / (2.0 * np.pi * SPLAT_DEVIATION**2)
    return centres, np.clip(colour[at] * light[at], 0.0, 1.0), np.clip(opacity, 0.0, 1.0), size


def _coarser(values: Single) -> Single:
    """Means over blocks of 2^3 cells; odd cells at the upper ends are dropped."""
    for axis in range(3):
        values = np.moveaxis(values, axis, 0)
        if len(values) > 1:
            values = values[: len(values) // 2 * 2]
            values = np.float32(0.5) * (values[::2] + values[1::2])
        values = np.moveaxis(values, 0, axis)
    return values
