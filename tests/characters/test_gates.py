"""Files of characters that contradict themselves, ask too much or read elsewhere are refused."""

from __future__ import annotations

import base64
import json
import os
import re
import struct
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import flowborne as fb
from flowborne.base.errors import SceneError
from flowborne.characters import apart
from flowborne.characters.division import closed
from flowborne.characters.gltf_document import inside
from flowborne.characters.limits import check_frames, check_size, check_work
from flowborne.characters.rig import Surface, own_names
from flowborne.characters.source import read_source

from . import rigged

Change = Callable[[dict[str, Any], bytearray], None]


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], bytes]:
    """JSON and binary chunk of the rigged box."""
    path = tmp_path_factory.mktemp("gates") / "box.glb"
    rigged.write_glb(path)
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def write(path: Path, document: dict[str, Any] | str, blob: bytes) -> Path:
    """A .glb file of its two chunks."""
    text = document if isinstance(document, str) else json.dumps(document)
    first, second = text.encode() + b" " * (-len(text) % 4), blob + bytes(-len(blob) % 4)
    path.write_bytes(
        struct.pack("<4sII", b"glTF", 2, 28 + len(first) + len(second))
        + struct.pack("<I4s", len(first), b"JSON")
        + first
        + struct.pack("<I4s", len(second), b"BIN\0")
        + second
    )
    return path


def key(*keys: str | int, value: Any) -> Change:
    """What sets a value of the JSON."""

    def change(document: dict[str, Any], blob: bytearray) -> None:
        table: Any = document
        for name in keys[:-1]:
            table = table[name]
        table[keys[-1]] = value

    return change


def number(accessor: int, value: float) -> Change:
    """What sets the first float of an accessor."""

    def change(document: dict[str, Any], blob: bytearray) -> None:
        view = document["bufferViews"][document["accessors"][accessor]["bufferView"]]
        struct.pack_into("<f", blob, view["byteOffset"], value)

    return change


def shared_children(document: dict[str, Any], blob: bytearray) -> None:
    """2^40 ways from a root to the last node."""
    first = len(document["nodes"])
    document["nodes"] += [{"children": [first + n + 1] * 2} for n in range(40)] + [{}]


def buffer_elsewhere(uri: str) -> Change:
    return key("buffers", 0, "uri", value=uri)


POINTS, JOINTS, WEIGHTS, CORNERS, BINDS, TIMES = range(6)
"""Accessors of the box."""

REFUSED: dict[str, tuple[Change, str]] = {
    "cycle": (key("nodes", 4, "children", value=[1]), r"nodes\[1\] is a child of nodes\[0\] and"),
    "own child": (key("nodes", 5, "children", value=[5]), r"nodes\[5\] is its own descendant"),
    "shared": (shared_children, r"nodes\[7\] is a child of nodes\[6\] and of nodes\[6\]"),
    "child": (key("nodes", 4, "children", value=[99]), r"nodes\[4\]\.children is 99, but the .* 6"),
    "nodes": (key("nodes", value=[{}] * 20_000), r"has 20000 nodes; the maximum is 10000"),
    "count": (key("accessors", 0, "count", value=85), r"accessors\[0\] ends at byte 1020 of buff"),
    "huge": (key("accessors", 0, "count", value=10**12), r"needs 3,000,000,000,000 numbers; the"),
    "offset": (key("accessors", 0, "byteOffset", value=4), r"accessors\[0\] ends at byte 1012"),
    "negative": (key("accessors", 0, "byteOffset", value=-4), r"accessors\[0\]\.byteOffset: .*-4"),
    "stride": (key("bufferViews", 0, "byteStride", value=4), r"have 12 bytes, but byteStride is 4"),
    "kind": (key("accessors", 0, "componentType", value=9), r"accessors\[0\]\.componentType: .*9"),
    "type": (key("accessors", 0, "type", value="VEC2"), r"POSITION \(accessors\[0\]\) is VEC2 of"),
    "view": (key("bufferViews", 0, "byteLength", value=10**9), r"bufferViews\[0\] ends at byte 1"),
    "buffer": (
        key("bufferViews", 0, "buffer", value=3),
        r"buffer is 3, but the file has 1 buffers",
    ),
    "length": (key("buffers", 0, "byteLength", value=10**6), r"buffers\[0\] has .* is 1000000"),
    "length, huge": (
        key("buffers", 0, "byteLength", value=2**40),
        r"need 1\.02e\+03 GB; the maximum is 1 G",
    ),
    "sparse": (
        key(
            "accessors",
            0,
            "sparse",
            value={
                "count": 1,
                "indices": {"bufferView": CORNERS, "byteOffset": 6, "componentType": 5125},
                "values": {"bufferView": POINTS},
            },
        ),
        r"accessors\[0\]\.sparse has index \d+, but there are 84",
    ),
    "corner": (
        lambda document, blob: struct.pack_into(
            "<H", blob, document["bufferViews"][CORNERS]["byteOffset"], 84
        ),
        r"indices \(accessors\[3\]\) has index 84, but there are 84 points",
    ),
    "joint": (
        lambda document, blob: struct.pack_into(
            "<B", blob, document["bufferViews"][JOINTS]["byteOffset"], 4
        ),
        r"JOINTS_0 \(accessors\[1\]\) has index 4, but there are 4 joints",
    ),
    "joints": (
        key("skins", 0, "joints", value=[1, 1, 2, 3]),
        r"skins\[0\]\.joints has a joint twi",
    ),
    "no point": (key("accessors", 0, "count", value=0), r"accessors\[0\]\.count: .* not 0"),
    "nan": (number(POINTS, float("nan")), r"accessors\[0\]\): element 0 is not a finite number"),
    "far": (number(POINTS, 1e30), r"a coordinate of 1e\+28 m; the maximum is 1e\+06 m"),
    "weight": (number(WEIGHTS, -1.0), r"WEIGHTS_0 has a weight of -1, but weights must be at"),
    "bind": (
        lambda document, blob: blob.__setitem__(
            slice(s := document["bufferViews"][BINDS]["byteOffset"], s + 44), bytes(44)
        ),
        r"inverseBindMatrices: matrix 0 has no inverse",
    ),
    "times": (number(TIMES, 9.0), r"samplers\[0\]\.input: the times of its keys do not increase"),
    "sampler": (
        key("animations", 0, "channels", 0, "sampler", value=9),
        r"channels\[0\]\.sampler is 9, but the file has 3 samplers",
    ),
    "values": (
        key("animations", 0, "samplers", 1, "interpolation", value="CUBICSPLINE"),
        r"samplers\[1\]\.output has 13 values for 13 keys, not 39",
    ),
    "rotation": (key("nodes", 2, "rotation", value=[0] * 4), r"nodes\[2\]\.rotation is not a unit"),
    "missing file": (buffer_elsewhere("box.bin"), r"buffers\[0\], 'box\.bin', cannot be read \(No"),
    "data": (buffer_elsewhere("data:,x"), r"buffers\[0\] has 1 bytes, and its byteLength"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_gltf_file_that_contradicts_itself_is_refused(
    tmp_path: Path, box: tuple[dict[str, Any], bytes], case: str
) -> None:
    change, said = REFUSED[case]
    document, blob = json.loads(json.dumps(box[0])), bytearray(box[1])
    change(document, blob)
    with pytest.raises(SceneError, match=rf"box\.glb.*{said}") as refused:
        fb.import_character(write(tmp_path / "box.glb", document, blob), tmp_path / "out")
    assert re.search(r"\. (Export|Look for stray|Put it there)", str(refused.value))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "uri",
    [
        "../box.bin",
        "%2e%2e/box.bin",
        "a/..%2F..%2Fbox.bin",
        "..\\box.bin",
        "/etc/passwd",
        "%2Fetc%2Fpasswd",
        "file:///etc/passwd",
        "https://evil.example/box.bin",
        "//evil.example/box.bin",
        "C:\\box.bin",
        "link/box.bin",
        "a%00b",
    ],
)
def test_a_buffer_is_read_from_the_files_own_folder_only(tmp_path: Path, uri: str) -> None:
    (tmp_path / "box.bin").write_bytes(b"secret")
    folder = tmp_path / "given"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path)
    (folder / "own file.bin").write_bytes(b"")
    assert inside("own%20file.bin", folder, "box.gltf") == Path("own file.bin")
    document = {"buffers": [{"byteLength": 6, "uri": uri}]}
    (folder / "box.gltf").write_text(json.dumps(document))
    with pytest.raises(SceneError, match=r"box\.gltf, buffers\[0\] names .* not in the folder"):
        read_source(folder / "box.gltf")


def test_a_buffer_without_an_end_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    document = {"buffers": [{"byteLength": 6, "uri": "pipe"}]}
    (tmp_path / "box.gltf").write_text(json.dumps(document))
    with pytest.raises(SceneError, match=r"buffers\[0\], 'pipe', cannot be read \(it is a pipe"):
        read_source(tmp_path / "box.gltf")


@pytest.mark.parametrize(
    "head",
    [
        "data:application/octet-stream;base64,",
        "data:application/gltf-buffer;base64,",
        "DATA:;charset=utf-8;BASE64,",
        "data:application/octet-stream,",
    ],
)
def test_data_uris_of_any_type_are_read(
    tmp_path: Path, box: tuple[dict[str, Any], bytes], head: str
) -> None:
    document = json.loads(json.dumps(box[0]))
    coded = base64.b64encode(box[1]).decode().rstrip("=")
    broken = "\n".join(coded[n : n + 76] for n in range(0, len(coded), 76))
    document["buffers"][0]["uri"] = head + (broken if "64" in head else quote(box[1]))
    (tmp_path / "box.gltf").write_text(json.dumps(document))
    found, wanted = (read_source(path) for path in (tmp_path / "box.gltf", glb(tmp_path, box)))
    assert found.surface is not None
    assert wanted.surface is not None
    assert_array_equal(found.surface.vertices, wanted.surface.vertices)


def test_a_data_uri_that_is_none_is_refused(
    tmp_path: Path, box: tuple[dict[str, Any], bytes]
) -> None:
    document = json.loads(json.dumps(box[0]))
    for uri in ("data:application/octet-stream;base64", "data:;base64,AAA*"):
        document["buffers"][0]["uri"] = uri
        (tmp_path / "box.gltf").write_text(json.dumps(document))
        with pytest.raises(SceneError, match=r"buffers\[0\]: its data uri cannot be read"):
            read_source(tmp_path / "box.gltf")


def test_meshes_that_no_joint_carries_are_named(
    tmp_path: Path, box: tuple[dict[str, Any], bytes]
) -> None:
    document = json.loads(json.dumps(box[0]))
    document["nodes"] += [{"name": "hat", "mesh": 0}, {"mesh": 0}]
    made = fb.import_character(write(tmp_path / "box.glb", document, box[1]), tmp_path / "out")
    assert "left out, because they have no weights for joints: hat, nodes[7]" in made.notes
    pxr = pytest.importorskip("pxr.UsdGeom")
    rigged.write_usd(tmp_path / "box.usda")
    assert read_source(tmp_path / "box.usda").left_out == ()
    stage = pytest.importorskip("pxr.Usd").Stage.Open(str(tmp_path / "box.usda"))
    pxr.Mesh.Define(stage, "/Root/hat")
    stage.Save()
    assert read_source(tmp_path / "box.usda").left_out == ("hat",)


def glb(folder: Path, box: tuple[dict[str, Any], bytes]) -> Path:
    return write(folder / "box.glb", *box)


def test_deeply_nested_json_is_refused(tmp_path: Path) -> None:
    text = '{"nodes": ' + "[" * 100_000
    with pytest.raises(SceneError, match="nested hundreds deep"):
        read_source(write(tmp_path / "box.glb", text, b""))


def test_names_in_a_file_write_nothing_else_into_the_scene(
    tmp_path: Path, box: tuple[dict[str, Any], bytes]
) -> None:
    document = json.loads(json.dumps(box[0]))
    document["nodes"][1]["name"] = 'a"]\nplugins = ["x.py"]\n\0#'
    document["animations"][0]["name"] = 'b"\nplugins = ["x.py"]\n'
    path = write(tmp_path / "box.glb", document, box[1])
    scene = fb.load_scene(fb.import_character(path, tmp_path / "out").scene)
    assert scene.plugins == ()
    assert scene.clip is not None
    assert scene.clip.free == ('a"]_plugins = ["x.py"]__#',)
    long = write(tmp_path / f"{'é' * 120}.glb", *box)
    assert fb.import_character(long, tmp_path / "long").scene.is_file()


def test_names_of_joints_are_ones_that_models_and_clips_can_have() -> None:
    names = own_names(["{a}", "a b ", " ", "world", "x" * 300, "{a}"])
    assert names == ("_a_", "a b", "joint_2", "world_2", "x" * 100, "_a__2")


def usda(tmp_path: Path, pattern: str, new: str) -> Path:
    """The rigged box as USD with the first match of a pattern replaced."""
    path = tmp_path / "box.usda"
    rigged.write_usd(path)
    text = re.sub(pattern, new, path.read_text(), count=1)
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("pattern", "new", "said"),
    [
        (r"faceVertexIndices = \[0,", "faceVertexIndices = [84,", "faceVertexIndices are 0 to 84"),
        (r"faceVertexIndices = \[0,", "faceVertexIndices = [-1,", "faceVertexIndices are -1 to 83"),
        (r"faceVertexCounts = \[3,", "faceVertexCounts = [4,", "faceVertexCounts add up to 493,"),
        (r"faceVertexCounts = \[3,", "faceVertexCounts = [-3,", "a face needs 3 corners or more"),
        (r"points = \[.*\]", "points = []", "Box: it has no points"),
        (r"points = \[\([^,]*,", "points = [(nan,", r"a coordinate of nan m"),
        (r"points = \[\([^,]*,", "points = [(1e30,", r"a coordinate of 1e\+28 m"),
        (r"jointIndices = \[0,", "jointIndices = [2,", r"jointIndices are 0 to 2, but .* 2 joints"),
        (r"jointWeights = \[[^,]*,", "jointWeights = [inf,", "jointWeights are not all finite"),
        (r"bindTransforms = \[.*\]", "bindTransforms = []", "has 0 bindTransforms for 4 joints"),
        (r"metersPerUnit = 0.01", "metersPerUnit = 0", "metersPerUnit is 0"),
        (r"timeCodesPerSecond = 24", "timeCodesPerSecond = 0", "timeCodesPerSecond is 0"),
    ],
)
def test_a_usd_file_that_contradicts_itself_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], pattern: str, new: str, said: str
) -> None:
    pytest.importorskip("pxr.Usd")
    path = usda(tmp_path, pattern, new)
    with pytest.raises(SceneError, match=rf"box\.usda.*{said}"):
        fb.import_character(path, tmp_path / "out")
    assert capfd.readouterr().err == ""


def test_a_binary_usd_file_that_ends_its_reader_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usd = pytest.importorskip("pxr.Usd")
    rigged.write_usd(tmp_path / "box.usda")
    usd.Stage.Open(str(tmp_path / "box.usda")).Export(str(tmp_path / "box.usdc"))
    assert read_source(tmp_path / "box.usdc").rig.names == rigged.NAMES
    (tmp_path / "crash").write_text("#!/bin/sh\nkill -SEGV $$\n")
    (tmp_path / "crash").chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "crash"))
    with pytest.raises(SceneError, match=r"box\.usdc cannot be read as USD: reading it crashes"):
        read_source(tmp_path / "box.usdc")


def test_usd_layers_are_read_from_the_files_own_folder_only(tmp_path: Path) -> None:
    pytest.importorskip("pxr.Usd")
    rigged.write_usd(tmp_path / "box.usda")
    folder = tmp_path / "given"
    (folder / "parts").mkdir(parents=True)
    rigged.write_usd(folder / "parts" / "own.usda")
    (folder / "link.usda").symlink_to(tmp_path / "box.usda")
    path = folder / "top.usda"
    for layer, read in (
        ("./parts/own.usda", True),
        ("../box.usda", False),
        (str(tmp_path / "box.usda"), False),
        ("./link.usda", False),
        ("./gone.usda", False),
    ):
        path.write_text(f"#usda 1.0\n(\n    subLayers = [@{layer}@]\n)\n")
        if read:
            assert read_source(path).rig.names == rigged.NAMES
            continue
        with pytest.raises(SceneError, match=r"top\.usda names .* not a file in the folder"):
            read_source(path)


def test_sizes_that_cannot_finish_are_refused_with_the_limit() -> None:
    with pytest.raises(SceneError, match=r"cat has 2,000 joints; the maximum is 500"):
        check_size(2000, 10, "cat")
    with pytest.raises(SceneError, match=r"250,000,000 weights .*; the maximum is 50,000,000"):
        check_size(500, 500_000, "cat")
    with pytest.raises(SceneError, match=r"1,000,000 frames of 50 nodes; the maximum is 3,000,000"):
        check_frames(1e6, 0.01, 50, "cat, clip 'run'")
    with pytest.raises(SceneError, match=r"a key every 1e-30 s; it must be 1e-05 to 10000 s"):
        check_frames(1e30, 1e-30, 50, "cat, clip 'run'")
    with pytest.raises(SceneError, match=r"2\.5e\+11 sums; the maximum is 5e\+10"):
        check_work(10_000, 50, 500_000, "cat")


@pytest.mark.parametrize("density", [0.0, -1.0, 1e30])
def test_a_density_that_no_body_has_is_refused(tmp_path: Path, density: float) -> None:
    with pytest.raises(SceneError, match=r"density is .* kg/m\^3; it must be 0\.001 to 1e\+06"):
        fb.import_character(tmp_path / "box.glb", tmp_path / "out", density=density)


def test_a_stray_point_that_makes_all_others_one_is_refused() -> None:
    points = np.random.default_rng(0).random((2000, 3))
    points[0] = 1e9
    faces = np.arange(1998).reshape(-1, 3)
    surface = Surface(points, faces, np.ones((2000, 1)), np.zeros((666, 3)))
    with pytest.raises(SceneError, match=r"points within 100 m .*Look for stray points"):
        closed(surface, "cat.glb")


def test_what_usd_prints_through_python_is_not_shown(capsys: pytest.CaptureFixture[str]) -> None:
    from flowborne.characters.usd_gate import reading_usd

    def read() -> None:
        with reading_usd("box.usdc"):
            print("TypeError: No to_python converter", file=sys.stderr)
            raise TypeError("no converter")

    with pytest.raises(SceneError, match=r"box\.usdc cannot be read"):
        read()
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("ending", [".usda", ".usdz"])
def test_a_usd_file_that_doubles_its_prims_at_each_level_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str
) -> None:
    """2 kB of references are a billion prims. Another process reads them, for a time."""
    levels = (
        f'def "p{n}" {{ def "x" (references = </p{n + 1}>) {{}}\n'
        f'def "y" (references = </p{n + 1}>) {{}}\n}}\n'
        for n in range(30)
    )
    text = "#usda 1.0\n" + "".join(levels) + 'def "p30" {}\n'
    path = tmp_path / f"bomb{ending}"
    path.write_text(text)
    if ending == ".usdz":
        with zipfile.ZipFile(path, "w") as package:
            package.writestr("bomb.usda", text)
    monkeypatch.setattr(apart, "MAX_SECONDS", 2.0)
    with pytest.raises(SceneError, match=rf"bomb{ending} cannot be read as USD"):
        read_source(path)
