"""Base colours of a glTF file: the factor of a material, times its texture where it is in the file.

source  Khronos glTF 2.0 specification, sections 3.8 (textures) and 3.9.2 (materials)
"""

from __future__ import annotations

from io import BytesIO

import numpy as np
from PIL import Image

from flowborne.characters.colours import PLAIN, texture_at
from flowborne.characters.gltf_accessors import Accessors, within, wrong
from flowborne.characters.gltf_document import Document, Primitive, TextureInfo, embedded
from flowborne.characters.rig import Array, Integers
from flowborne.colours import to_linear, to_srgb

MOST_PIXELS = 1 << 26
"""Of a texture."""


class Colours:
    """The colours of a document's meshes."""

    def __init__(
        self, name: str, document: Document, arrays: Accessors, buffers: list[memoryview]
    ) -> None:
        self._name, self._document, self._arrays = name, document, arrays
        self._buffers = buffers
        self._images: dict[int, Image.Image | None] = {}

    def of(self, part: Primitive, triangles: Integers, points: int) -> Array:
        """(m, 3) sRGB values from 0 to 1 of triangles (m, 3) of `points` vertices, each that in its
        middle.

        raises  SceneError when the material names what is not there
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
        """(m, 3) light; 1 where the texture is not in the file or cannot be read."""
        textures = self._document.textures
        within(texture.index, textures, f"{self._name}, a baseColorTexture", "textures")
        source, layer = textures[texture.index].source, f"TEXCOORD_{texture.tex_coord}"
        if source is None or layer not in part.attributes:
            return np.ones((len(triangles), 3))
        within(source, self._document.images, f"{self._name}, textures[{texture.index}]", "images")
        where = f"{self._name}, {layer}"
        within(part.attributes[layer], self._arrays, where, "accessors")
        places = self._arrays.numbers(part.attributes[layer], where)
        if places.shape != (points, 2):
            raise wrong(f"{where} is not a pair of numbers for each of the {points} points")
        if source not in self._images:
            self._images[source] = self._image(source)
        image = self._images[source]
        if image is None:
            return np.ones((len(triangles), 3))
        return to_linear(texture_at(image, places[triangles].mean(axis=1)))

    def _image(self, number: int) -> Image.Image | None:
        image = self._document.images[number]
        try:
            if image.buffer_view is not None:
                view = self._document.buffer_views[image.buffer_view]
                end = view.byte_offset + view.byte_length
                content = bytes(self._buffers[view.buffer][view.byte_offset : end])
            else:
                content = embedded(image.uri or "")
            found = Image.open(BytesIO(content))
            return found.convert("RGB") if found.width * found.height <= MOST_PIXELS else None
        except Exception:  # its readers raise whatever goes wrong in them
            return None
