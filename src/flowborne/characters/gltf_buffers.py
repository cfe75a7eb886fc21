"""Arrays and colours in the buffers of a glTF file.

Every accessor is checked against its view and buffer before it is read. A colour is the factor of a
material times its texture, if that is in the file.

source  Khronos glTF 2.0 specification, sections 3.6.1 and 3.6.2 (buffers and accessors), 3.8
        (textures) and 3.9.2 (materials)
"""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from flowborne.base.colours import to_linear, to_srgb
from flowborne.base.errors import SceneError
from flowborne.characters.gltf_document import Document, Primitive, TextureInfo, embedded
from flowborne.characters.limits import wrong
from flowborne.characters.rig import PLAIN
from flowborne.kernels.arrays import Array, Integers

KINDS = {
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}

MAX_NUMBERS = 30_000_000
"""Largest size of an accessor, which has three numbers for each point."""

MAX_PIXELS = 1 << 26
"""Largest size of a texture."""


class Accessors:
    """The arrays of a document.

    name, document, buffers  of the file
    raises  SceneError when one of them lies outside its view or its buffer
    """

    def __init__(self, name: str, document: Document, buffers: list[memoryview]) -> None:
        self.name, self.document, self.buffers = name, document, buffers
        for number, view in enumerate(document.buffer_views):
            where = f"{name}, bufferViews[{number}]"
            within(view.buffer, buffers, f"{where}.buffer", "buffers")
            end, size = view.byte_offset + view.byte_length, len(buffers[view.buffer])
            if end > size:
                raise wrong(f"{where} ends at byte {end} of a buffer of {size}")
        for number in range(len(document.accessors)):
            self._stored(number)

    def read(self, number: int) -> NDArray[Any]:
        """(count, width) the elements of an accessor; normalized integers become floats."""
        accessor = self.document.accessors[number]
        kind, width = np.dtype(KINDS[accessor.component_type]), WIDTHS[accessor.type]
        values, replaced = self._stored(number)
        if values is None:
            values = np.zeros((accessor.count, width), kind)
        if replaced is not None:
            values = values.copy()
            values[replaced[0]] = replaced[1]
        if accessor.normalized and kind.kind in "iu":
            largest = 2.0 ** (8 * kind.itemsize - (kind.kind == "i")) - 1.0
            return np.maximum(values.astype(float) / largest, -1.0)
        return values

    def numbers(self, number: int, type_: str | None, kinds: tuple[int, ...], where: str) -> Array:
        """(count, width) the elements as floats.

        raises  SceneError unless all are finite, of a type and of one of some component types
        """
        self._check_kind(number, type_, kinds, where)
        values = self.read(number).astype(float)
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0])
            raise wrong(f"{where} (accessors[{number}]): element {row} is not a finite number")
        return values

    def indices(
        self, number: int, type_: str, kinds: tuple[int, ...], limit: tuple[int, str], where: str
    ) -> Integers:
        """(count, width) the elements as integers; as `numbers`.

        limit   number of things that they are indices of, and what these are
        raises  SceneError for an index without a thing
        """
        self._check_kind(number, type_, kinds, where)
        values = self.read(number).astype(np.int64)
        if (largest := int(values.max())) >= limit[0]:
            raise wrong(
                f"{where} (accessors[{number}]) has index {largest}, but there are {limit[0]} "
                f"{limit[1]}"
            )
        return values

    def _check_kind(
        self, number: int, type_: str | None, kinds: tuple[int, ...], where: str
    ) -> None:
        within(number, self.document.accessors, where, "accessors")
        accessor = self.document.accessors[number]
        if accessor.type != (type_ or accessor.type) or accessor.component_type not in kinds:
            raise wrong(
                f"{where} (accessors[{number}]) is {accessor.type} of components "
                f"{accessor.component_type}, not {type_} of {' or '.join(map(str, kinds))}"
            )

    def _stored(
        self, number: int
    ) -> tuple[NDArray[Any] | None, tuple[NDArray[Any], NDArray[Any]] | None]:
        """The elements of an accessor in its buffer, and the indices of those that its sparse part
        replaces, with the new ones; None without them."""
        accessor, where = self.document.accessors[number], f"{self.name}, accessors[{number}]"
        kind, count, width = accessor.component_type, accessor.count, WIDTHS[accessor.type]
        if count * width > MAX_NUMBERS:
            raise SceneError(
                f"{where} needs {count * width:,} numbers; the maximum is {MAX_NUMBERS:,}. Export "
                "fewer points or keys."
            )
        values, view, first = None, accessor.buffer_view, accessor.byte_offset
        if view is not None:
            values = self._view(view, first, kind, (count, width), where)
        sparse, where = accessor.sparse, f"{where}.sparse"
        if sparse is None:
            return values, None
        if sparse.count > count:
            raise wrong(f"{where} replaces {sparse.count} elements of {count}")
        own, new, many = sparse.indices, sparse.values, sparse.count
        chosen = own.component_type
        rows = self._view(own.buffer_view, own.byte_offset, chosen, (many, 1), where).ravel()
        others = self._view(new.buffer_view, new.byte_offset, kind, (many, width), where)
        if (largest := int(rows.max())) >= count:
            raise wrong(f"{where} has index {largest}, but there are {count} elements")
        return values, (rows, others)

    def _view(
        self, number: int, first: int, kind: int, shape: tuple[int, int], where: str
    ) -> NDArray[Any]:
        """(count, width) elements from a byte on; raises SceneError unless they are in the view."""
        within(number, self.document.buffer_views, f"{where}.bufferView", "bufferViews")
        view, type_ = self.document.buffer_views[number], np.dtype(KINDS[kind])
        size = shape[1] * type_.itemsize
        step = view.byte_stride or size
        if step < size:
            raise wrong(f"{where}: its elements have {size} bytes, but byteStride is {step}")
        end = first + step * (shape[0] - 1) + size
        if end > view.byte_length:
            raise wrong(
                f"{where} ends at byte {end} of bufferViews[{number}], which has {view.byte_length}"
            )
        start, strides = view.byte_offset + first, (step, type_.itemsize)
        return np.ndarray(shape, type_, self.buffers[view.buffer], start, strides)


class Colours:
    """The colours of a document's meshes."""

    def __init__(self, arrays: Accessors) -> None:
        self._name, self._document, self._arrays = arrays.name, arrays.document, arrays
        self._images: dict[int, Image.Image | None] = {}

    def of(self, part: Primitive, triangles: Integers, points: int) -> Array:
        """(m, 3) sRGB values from 0 to 1 in the middle of triangles (m, 3) of `points` vertices.

        raises  SceneError when the material has a number that is not in the file
        """
        if part.material is None:
            return np.full((len(triangles), 3), PLAIN)
        materials = self._document.materials
        within(part.material, materials, f"{self._name}, a primitive's material", "materials")
        base = materials[part.material].pbr_metallic_roughness
        light = np.tile(base.base_color_factor[:3], (len(triangles), 1))
        if base.base_color_texture is not None:
            light *= self._texture(base.base_color_texture, part, triangles, points)
        return to_srgb(light)

    def _texture(
        self, texture: TextureInfo, part: Primitive, triangles: Integers, points: int
    ) -> Array:
        """(m, 3) linear values; 1 where the texture is not in the file or cannot be read."""
        textures = self._document.textures
        within(texture.index, textures, f"{self._name}, a baseColorTexture", "textures")
        source, layer = textures[texture.index].source, f"TEXCOORD_{texture.tex_coord}"
        if source is None or layer not in part.attributes:
            return np.ones((len(triangles), 3))
        within(source, self._document.images, f"{self._name}, textures[{texture.index}]", "images")
        where = f"{self._name}, {layer}"
        coordinates = self._arrays.numbers(part.attributes[layer], None, tuple(KINDS), where)
        if coordinates.shape != (points, 2):
            raise wrong(f"{where} is not a pair of numbers for each of the {points} points")
        if source not in self._images:
            self._images[source] = self._image(source)
        image = self._images[source]
        if image is None:
            return np.ones((len(triangles), 3))
        return to_linear(texture_at(image, coordinates[triangles].mean(axis=1)))

    def _image(self, number: int) -> Image.Image | None:
        image = self._document.images[number]
        try:
            if image.buffer_view is not None:
                view = self._document.buffer_views[image.buffer_view]
                end = view.byte_offset + view.byte_length
                content = bytes(self._arrays.buffers[view.buffer][view.byte_offset : end])
            else:
                content = embedded(image.uri or "")
            found = Image.open(BytesIO(content))
            return found.convert("RGB") if found.width * found.height <= MAX_PIXELS else None
        except Exception:  # Pillow's readers raise exceptions of any kind
            return None


def texture_at(image: Image.Image, coordinates: Array) -> Array:
    """(m, 3) sRGB values from 0 to 1 of the nearest pixels.

    coordinates  (m, 2) of the texture: 0 left, 0 above; it repeats beyond 1
    """
    pixels = np.asarray(image.convert("RGB"))
    height, width = pixels.shape[:2]
    inside = np.nan_to_num(coordinates) % 1.0
    columns = np.minimum((inside[:, 0] * width).astype(int), width - 1)
    rows = np.minimum((inside[:, 1] * height).astype(int), height - 1)
    return np.asarray(pixels[rows, columns] / 255.0)


def within(number: int, things: Any, where: str, what: str) -> None:
    """Raise SceneError unless a list has an entry of this number."""
    if number >= len(things):
        raise wrong(f"{where} is {number}, but the file has {len(things)} {what}")
