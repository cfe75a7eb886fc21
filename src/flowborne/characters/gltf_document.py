"""A glTF file as typed tables, not yet checked for consistency.

source  Khronos glTF 2.0 specification, sections 3.4, 3.6 and 4.4 (GLB), and appendix C
"""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Annotated, Any, Literal
from urllib.parse import unquote, unquote_to_bytes, urlsplit

from pydantic import BaseModel, ConfigDict, Field, Strict, ValidationError, model_validator
from pydantic.alias_generators import to_camel

from flowborne.base.errors import SceneError
from flowborne.base.given import check_file
from flowborne.characters.limits import MAX_FILE_BYTES, wrong

JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942

Index = Annotated[int, Strict(), Field(ge=0, lt=1 << 53)]
Size = Annotated[int, Strict(), Field(ge=1, lt=1 << 53)]
Number = Annotated[float, Field(strict=True, ge=-1e30, le=1e30, allow_inf_nan=False)]
Three = Annotated[list[Number], Field(min_length=3, max_length=3)]
Four = Annotated[list[Number], Field(min_length=4, max_length=4)]
Sixteen = Annotated[list[Number], Field(min_length=16, max_length=16)]


class _Table(BaseModel):
    """Unknown keys are ignored; null counts as a missing key."""

    model_config = ConfigDict(extra="ignore", frozen=True, alias_generator=to_camel)

    @model_validator(mode="before")
    @classmethod
    def _without_null(cls, data: Any) -> Any:
        if isinstance(data, dict):
            return {key: value for key, value in data.items() if value is not None}
        return data


class Buffer(_Table):
    byte_length: Size
    uri: str | None = None


class BufferView(_Table):
    buffer: Index
    byte_offset: Index = 0
    byte_length: Size
    byte_stride: Annotated[int, Strict(), Field(ge=0, le=252)] = 0


class SparseIndices(_Table):
    buffer_view: Index
    byte_offset: Index = 0
    component_type: Literal[5121, 5123, 5125]


class SparseValues(_Table):
    buffer_view: Index
    byte_offset: Index = 0


class Sparse(_Table):
    count: Size
    indices: SparseIndices
    values: SparseValues


class Accessor(_Table):
    buffer_view: Index | None = None
    byte_offset: Index = 0
    component_type: Literal[5120, 5121, 5122, 5123, 5125, 5126]
    normalized: bool = False
    count: Size
    type: Literal["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]
    sparse: Sparse | None = None


class Node(_Table):
    name: str = ""
    children: list[Index] = []
    mesh: Index | None = None
    skin: Index | None = None
    matrix: Sixteen | None = None
    translation: Three = [0.0, 0.0, 0.0]
    rotation: Four = [0.0, 0.0, 0.0, 1.0]
    scale: Three = [1.0, 1.0, 1.0]


class Primitive(_Table):
    attributes: dict[str, Index]
    indices: Index | None = None
    material: Index | None = None
    mode: Index = 4


class TextureInfo(_Table):
    index: Index
    tex_coord: Index = 0


class BaseColour(_Table):
    base_color_factor: Four = [1.0, 1.0, 1.0, 1.0]
    base_color_texture: TextureInfo | None = None


class Material(_Table):
    pbr_metallic_roughness: BaseColour = BaseColour()


class Texture(_Table):
    source: Index | None = None


class Image(_Table):
    buffer_view: Index | None = None
    uri: str | None = None


class Mesh(_Table):
    primitives: Annotated[list[Primitive], Field(min_length=1)]


class Skin(_Table):
    name: str = ""
    joints: Annotated[list[Index], Field(min_length=1)]
    inverse_bind_matrices: Index | None = None


class Target(_Table):
    node: Index | None = None
    path: str


class Channel(_Table):
    sampler: Index
    target: Target


class Sampler(_Table):
    input: Index
    output: Index
    interpolation: Literal["LINEAR", "STEP", "CUBICSPLINE"] = "LINEAR"


class Animation(_Table):
    name: str = ""
    channels: list[Channel]
    samplers: list[Sampler]


class Document(_Table):
    """The parts of a glTF document that a character needs."""

    extensions_required: list[str] = []
    buffers: list[Buffer] = []
    buffer_views: list[BufferView] = []
    accessors: list[Accessor] = []
    nodes: list[Node] = []
    meshes: list[Mesh] = []
    materials: list[Material] = []
    textures: list[Texture] = []
    images: list[Image] = []
    skins: list[Skin] = []
    animations: list[Animation] = []


def read_document(path: Path) -> tuple[Document, list[memoryview]]:
    """The tables of a .glb or .gltf file, and the bytes of its buffers.

    raises  SceneError when it is too large, truncated, not glTF, or has a buffer outside its folder
    """
    data, binary = _bounded(path, path.name), None
    if data[:4] == b"glTF":
        data, binary = _chunks(path.name, data)
    try:
        document = Document.model_validate(json.loads(data))
    except ValidationError as error:
        first = error.errors()[0]
        value = "" if first["type"] == "missing" else f", not {repr(first['input'])[:60]}"
        raise wrong(f"{path.name}, {_place(first['loc'])}: {first['msg']}{value}") from None
    except RecursionError:
        raise wrong(f"{path.name}: its JSON is nested hundreds deep") from None
    except ValueError as error:
        raise wrong(f"{path.name} cannot be read as glTF: {str(error)[:100]}") from None
    return document, _buffers(path, document, binary)


def _bounded(path: Path, shown: str) -> bytes:
    """The bytes of a file; raises SceneError when there are too many, or it cannot be read."""
    try:
        check_file(path, None)
        with open(path, "rb") as file:
            data = file.read(MAX_FILE_BYTES + 1)
    except (OSError, ValueError) as error:
        said = getattr(error, "strerror", None) or str(error)
        raise SceneError(
            f"{shown} cannot be read ({said}). Put it there, or export the character as one .glb."
        ) from None
    if len(data) > MAX_FILE_BYTES:
        raise SceneError(
            f"{shown} is larger than the maximum of {MAX_FILE_BYTES / 2**30:g} GB. Export fewer "
            "meshes and clips."
        )
    return data


def _chunks(name: str, data: bytes) -> tuple[bytes, bytes | None]:
    """JSON and binary chunk of a GLB file."""
    found: dict[int, bytes] = {}
    start = 12
    while start + 8 <= len(data):
        length, kind = struct.unpack_from("<II", data, start)
        if start + 8 + length > len(data):
            raise wrong(
                f"{name} cannot be read as glTF: a chunk of {length} bytes at byte {start} ends "
                f"after the file, which has {len(data)}"
            )
        found.setdefault(kind, data[start + 8 : start + 8 + length])
        start += 8 + length
    if JSON_CHUNK not in found:
        raise wrong(f"{name} cannot be read as glTF: it has no JSON chunk")
    return found[JSON_CHUNK], found.get(BINARY_CHUNK)


def _buffers(path: Path, document: Document, binary: bytes | None) -> list[memoryview]:
    asked = sum(buffer.byte_length for buffer in document.buffers)
    if asked > MAX_FILE_BYTES:
        raise SceneError(
            f"{path.name}: its buffers need {asked / 2**30:.3g} GB; the maximum is "
            f"{MAX_FILE_BYTES / 2**30:g} GB. Export fewer meshes and clips."
        )
    found = []
    for number, buffer in enumerate(document.buffers):
        where = f"{path.name}, buffers[{number}]"
        if buffer.uri is not None:
            data = _from_uri(path, buffer.uri, where)
        elif number == 0 and binary is not None:
            data = binary
        else:
            raise wrong(f"{where} has neither a uri nor a binary chunk")
        if len(data) < buffer.byte_length:
            raise wrong(
                f"{where} has {len(data)} bytes, and its byteLength is {buffer.byte_length}"
            )
        found.append(memoryview(data)[: buffer.byte_length])
    return found


def _from_uri(path: Path, uri: str, where: str) -> bytes:
    """The content of a data URI, or of the file in the folder of `path` that a URI names."""
    if uri[:5].lower() == "data:":
        try:
            return embedded(uri)
        except ValueError as error:
            raise wrong(f"{where}: its data uri cannot be read ({error})") from None
    file = path.parent / inside(uri, path.parent, where)
    return _bounded(file, f"{where}, {uri[:100]!r},")


def embedded(uri: str) -> bytes:
    """The content of a data uri of any type, base64 or percent-encoded.

    source  RFC 2397; base64 may have line breaks and lack its padding
    raises  ValueError
    """
    head, comma, text = uri.partition(",")
    if not comma:
        raise ValueError("it has no comma")
    content = unquote_to_bytes(text)
    if not head.lower().endswith(";base64"):
        return content
    plain = b"".join(content.split()).rstrip(b"=")
    return base64.b64decode(plain + b"=" * (-len(plain) % 4), validate=True)


def inside(uri: str, folder: Path, where: str) -> Path:
    """The path, relative to `folder`, that a percent-encoded reference names.

    raises  SceneError when it leaves the folder: by a scheme, a host, an absolute path, a part '..'
            or a symbolic link
    """
    plain = unquote(uri).replace("\\", "/")
    relative = Path(plain)
    try:
        parts = urlsplit(plain)
        leaves = bool(parts.scheme or parts.netloc) or "\0" in plain or ":" in plain
        leaves = leaves or relative.is_absolute() or ".." in relative.parts
        leaves = leaves or not (folder / relative).resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):
        leaves = True
    if leaves:
        raise SceneError(
            f"{where} names {uri[:100]!r}, which is not in the folder of the file. Put it "
            "there, or export the character as one file."
        )
    return relative


def _place(keys: tuple[int | str, ...]) -> str:
    """A path in the document: ("accessors", 3, "count") -> accessors[3].count."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)
    return text.lstrip(".") or "document"
