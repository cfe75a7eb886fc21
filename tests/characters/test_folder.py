"""A character in, run, and out again."""

from __future__ import annotations

import ast
import sys
import tomllib
from dataclasses import replace
from importlib.metadata import packages_distributions
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

import flowborne as fb
from flowborne.base.colours import to_linear
from flowborne.characters.division import divided, is_sound
from flowborne.characters.gltf import GltfSource
from flowborne.characters.model import as_cycle, posed
from flowborne.characters.rig import Z_UP, Action, Rig, Surface, heaviest, one_tree
from flowborne.characters.source import read_source
from flowborne.cli import main as cli
from flowborne.formats.creature import Creature
from flowborne.motion.clip import Clip
from flowborne.scenes.bodies import load_model
from flowborne.scenes.build import build
from flowborne.scenes.load import check_scene
from flowborne.scenes.warn_speed import fast_bodies, steps_for_bodies
from flowborne.shapes.mesh import ShapeMesh
from flowborne.solids.dynamics import kinematics
from flowborne.solids.skins import skins_of
from flowborne.view.run import Run

from ..read_bvh import read_bvh
from . import hands, rigged

CREATURES = Path(__file__).parents[3] / "shared" / "creatures"
needs_creatures = pytest.mark.skipif(
    not CREATURES.is_dir(), reason="the creatures are beside the project"
)

TURNED = 1e-3
"""Angle from the clip's file that is accepted, degrees."""

FAR = 1e-5
"""Distance that is accepted, in sizes of the character."""

DRY = {"fluid.coupling": '"none"'}
COARSE = {"domain.resolution": "16"}
DRIVEN = {**DRY, "clip.free": "[]", "clip.loop": "false"}
"""The root follows the clip, too, and once: what is in the file comes out again."""


def skinned(rig: Rig, surface: Surface, action: Action) -> np.ndarray:
    """(frames, k, 3) m the surface on its joints, by linear blend skinning."""
    turn = action.rotation @ np.swapaxes(rig.rotation, 1, 2)
    local = surface.vertices[None, :, None] - rig.position
    carried = np.einsum(
        "fnij,fknj->fkni", turn, np.broadcast_to(local, (len(turn), *local.shape[1:]))
    )
    return np.einsum("kn,fkni->fki", surface.weights, carried + action.position[:, None])


def angles(found: np.ndarray, wanted: np.ndarray) -> float:
    """Largest angle between rotations, degrees."""
    turn = np.swapaxes(found, -1, -2) @ wanted
    return float(np.degrees(Rotation.from_matrix(turn.reshape(-1, 3, 3)).magnitude()).max())


@pytest.fixture(scope="module", params=["glb", "usda"])
def box(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scene of the rigged box, imported from either format."""
    folder = tmp_path_factory.mktemp("box")
    path = folder / f"box.{request.param}"
    (rigged.write_glb if request.param == "glb" else rigged.write_usd)(path)
    made = fb.import_character(path, folder / "scene", density=900.0)
    assert "2 bodies of 4 joints, 0.24 m^3, 216 kg" in made.notes
    assert "rigid with their parent joint: trunk, tail_tip" in made.notes
    return made.scene


def test_no_body_crosses_more_than_a_cell_in_a_step(box: Path) -> None:
    """The tail's tip goes at some 7 m/s, 0.3 m a frame, through cells of 0.06 m."""
    scene = fb.load_scene(box)
    setup = build(scene).world.setup
    assert scene.time.steps_per_frame > 3
    assert not list(fast_bodies(scene, setup))
    coarse = fb.load_scene(box, {"time.steps_per_frame": "1"})
    assert steps_for_bodies(coarse, setup) == scene.time.steps_per_frame


def test_a_character_of_another_unit_is_told_and_scaled(tmp_path: Path) -> None:
    """The remedy that the note has leads to a character without one."""
    rigged.write_glb(tmp_path / "box.glb")
    made = fb.import_character(tmp_path / "box.glb", tmp_path / "huge", scale=100.0)
    (said,) = (note for note in made.notes if "whale" in note)
    assert said.startswith("it is 200 m long and 2.4e+08 kg, longer than a whale")
    assert said.endswith("with a scale of 1 it is 2 m long and 240 kg")
    mended = fb.import_character(tmp_path / "box.glb", tmp_path / "own", scale=100.0 * 0.01)
    assert not [note for note in mended.notes if "whale" in note]
    said = r"0\.0008 m long and 1\.54e-08 kg, .* a scale of 0\.4 it is 0\.8 m long and 15\.4 kg"
    with pytest.raises(fb.SceneError, match=said):
        fb.import_character(tmp_path / "box.glb", tmp_path / "tiny", scale=4e-4)
    fb.import_character(tmp_path / "box.glb", tmp_path / "tiny", scale=4e-4 * 1000.0)
    large, own = (read_bvh(one.scene.with_suffix(".bvh")) for one in (made, mended))
    assert_allclose(large.offsets, 100.0 * own.offsets, atol=1e-5)
    assert_allclose(large.translation, 100.0 * own.translation, atol=1e-5)
    with pytest.raises(fb.SceneError, match=r"scale is -1\. Give a number above 0"):
        fb.import_character(tmp_path / "box.glb", tmp_path / "none", scale=-1.0)


def test_model_has_the_masses_of_the_pieces(box: Path) -> None:
    solid = load_model(fb.load_scene(box))
    assert solid.body_names == ("world", *rigged.NAMES)
    assert solid.joint_names == ("handle", "tail")
    (skin,) = skins_of(solid.mj)
    assert_allclose(to_linear(skin.rgba[:3]), rigged.COLOUR, atol=0.005)
    section = rigged.WIDTH * rigged.HEIGHT
    lengths = np.array([0.0, rigged.JOINT, 0.0, rigged.LENGTH - rigged.JOINT, 0.0])
    assert_allclose(solid.body_mass[[1, 3]], 900.0 * section * lengths[[1, 3]], rtol=1e-4)
    assert_allclose(solid.volume[[1, 3]], section * lengths[[1, 3]], rtol=1e-4)
    assert solid.body_mass.sum() == pytest.approx(900.0 * section * rigged.LENGTH, rel=1e-6)


def test_clip_has_the_angles_of_the_file(box: Path) -> None:
    times, turns, _ = rigged.clip()
    clip = read_bvh(box.with_suffix(".bvh"))
    assert clip.names == ("handle", "tail")
    assert clip.frame_time == pytest.approx(1.0 / rigged.RATE, rel=1e-6)
    _, world = clip.poses()
    tail, trunk = (Rotation.from_quat(world[:, joint], scalar_first=True) for joint in (1, 0))
    still = rigged.TURNS[1].inv() * rigged.TURNS[2]
    own = turns["tail"] * still.inv()
    up = Rotation.from_matrix(Z_UP)
    frame = up * rigged.TURNS[1]
    wanted = frame * own * frame.inv()
    assert len(times) == clip.frames
    assert np.degrees(((trunk.inv() * tail).inv() * wanted).magnitude()).max() < TURNED


def test_box_comes_back_as_its_file_moves_it(box: Path, tmp_path: Path) -> None:
    """Joints of the same names at the same angles, and every vertex of the surface."""
    frames = rigged.FRAMES - 1
    fb.run(fb.load_scene(box, DRIVEN), tmp_path / "run", frames=frames, film=False)
    found = GltfSource(tmp_path / "run" / "box.glb")
    file = next(box.parent.parent.glob("box.*"))
    given = read_source(file)
    assert found.rig.names == given.rig.names
    assert found.rig.parents.tolist() == given.rig.parents.tolist()
    assert_allclose(found.rig.position, given.rig.position, atol=FAR * rigged.LENGTH)
    ours, theirs = found.action(0), given.action(0)
    moving = [1, 2]  # the handle goes with the trunk, and the tip keeps its angle
    assert angles(ours.rotation[:, moving], theirs.rotation[:, moving]) < TURNED
    assert found.surface is not None
    assert given.surface is not None
    assert_allclose(found.surface.weights, given.surface.weights, atol=1e-6)
    assert_allclose(
        skinned(found.rig, found.surface, ours),
        skinned(given.rig, given.surface, theirs),
        atol=FAR * rigged.LENGTH,
    )


def test_box_swims(box: Path, tmp_path: Path) -> None:
    """In water on a coarse grid: the tail follows the clip, and takes the root along."""
    fb.run(fb.load_scene(box, COARSE), tmp_path / "run", frames=3, film=False)
    run = fb.open_run(tmp_path / "run")
    for name in ("q", "v", "fluid_force", "pressure"):
        assert np.isfinite(run.every(name)).all()
    away = np.linalg.norm(
        run.every("body_position")[:, 1] - run.every("body_position")[0, 1], axis=1
    )
    assert 1e-4 < away[-1] < 0.2 * rigged.LENGTH
    (bound,) = Creature(run).bound
    assert bound.name == "box"
    assert not Creature(run).seen


def test_pictures_show_the_surface_in_place_of_its_pieces(box: Path, tmp_path: Path) -> None:
    """The drawn skin is the surface of the file, where the file's clip has it."""
    frames = rigged.FRAMES - 1
    fb.run(fb.load_scene(box, DRIVEN), tmp_path / "run", frames=frames, film=False)
    run = Run(tmp_path / "run")
    assert all(geom.covered for geom in run.geoms)
    (skin,) = run.skins
    exported = GltfSource(tmp_path / "run" / "box.glb")
    assert exported.surface is not None
    drawn = np.array([skin.vertices(run.state(n)) for n in range(len(run))])
    wanted = skinned(exported.rig, exported.surface, exported.action(0))
    apart, _ = KDTree(drawn[-1]).query(wanted[-1])
    assert apart.max() < FAR * rigged.LENGTH
    assert np.ptp(drawn, axis=0).max() > 0.1 * rigged.LENGTH


def test_tail_is_free_as_the_scene_offers_it(box: Path, tmp_path: Path) -> None:
    """The lines that the scene has as a remark make the last joint seek least effort."""
    text = box.read_text()
    for line in ("[[control]]", "joints", "strength", "[[objectives]]", "kind"):
        assert f"\n# {line}" in text
        text = text.replace(f"\n# {line}", f"\n{line}")
    path = box.with_name("free.toml")
    path.write_text(text)
    scene = fb.load_scene(path, {**COARSE, "clip.free": "[]"})
    assert scene.controlled_joints() == ("tail",)
    fb.run(scene, tmp_path / "run", frames=2, film=False)
    run = fb.open_run(tmp_path / "run")
    q = run.every("q")
    assert np.isfinite(q).all()
    assert np.abs(q[-1, 7:] - q[0, 7:]).max() > 1e-3, "the controller moves it"
    assert np.abs(run.every("fluid_force")[-1]).max() > 0.0


def test_mistakes_in_a_scene_of_a_character_are_told(box: Path) -> None:
    (problem,) = check_scene(box, {"clip.free": '["hand"]'})
    assert "joint 'hand' is not in model box.xml; did you mean 'handle'?" in problem
    (problem,) = check_scene(box, {"clip.joints": '["handle"]'})
    assert "[clip] joints: joint 'handle' is free as well. Take it out of one" in problem


def test_command_says_what_it_made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rigged.write_glb(tmp_path / "box.glb", clips=2)
    words = ["import", str(tmp_path / "box.glb"), "--out", str(tmp_path / "out")]

    def said(*more: str) -> tuple[object, str]:
        with pytest.raises(SystemExit) as left:
            cli.main([*words, *more])
        out, err = capsys.readouterr()
        return left.value.code, out + err

    code, text = said()
    assert (code, text.count("\n")) == (2, 1)
    assert "box.glb has 2 clips. Name one as the clip: Swim 0, Swim 1." in text
    code, text = said("--density", "0")
    assert (code, text) == (2, "flowborne: --density is 0; give kg/m^3 above 0\n")
    code, text = said("--clip", "Swim 1")
    assert code == 0
    assert "2 bodies of 4 joints, 0.24 m^3, 240 kg" in text
    assert "clip 'Swim 1': 13 frames in 0.5 s; its joints are at most" in text
    code, text = said("--clip", "Swim 1")
    assert code == 2
    assert "box.toml already exists and may have been edited. Name another folder" in text


def test_mistakes_in_an_import_are_told(tmp_path: Path) -> None:
    rigged.write_glb(tmp_path / "bare.glb", skin=False)
    with pytest.raises(fb.SceneError, match=r"bare\.glb has no skin: no mesh is bound"):
        fb.import_character(tmp_path / "bare.glb", tmp_path / "out")
    rigged.write_glb(tmp_path / "open.glb", closed=False)
    with pytest.raises(fb.SceneError, match=r"open\.glb: the surface is not watertight"):
        fb.import_character(tmp_path / "open.glb", tmp_path / "out")
    assert not (tmp_path / "out").exists()
    made = fb.import_character(tmp_path / "open.glb", tmp_path / "out", fill=True)
    assert "1 hole closed, the widest 0.316 m across" in made.notes


@needs_creatures
@pytest.mark.parametrize(
    ("file", "animations", "clip", "free"),
    [
        ("fish-whale.glb", "shark-animations.glb", "Swim Horizontal", "tail_8"),
        ("bird-eagle.glb", "bird-animations.glb", "Flap", "tail_2"),
    ],
)
def test_creature_comes_back(
    file: str, animations: str, clip: str, free: str, tmp_path: Path
) -> None:
    """Driven by its own clip but for one joint, every other as the file has it."""
    made = fb.import_character(
        CREATURES / file, tmp_path / "scene", clip=clip, animations=CREATURES / animations
    )
    settings = {**DRIVEN, "clip.free": f'["{free}"]'}
    fb.run(fb.load_scene(made.scene, settings), tmp_path / "run", frames=6, film=False)
    given, moves = GltfSource(CREATURES / file), GltfSource(CREATURES / animations)
    found = GltfSource(tmp_path / "run" / file)
    assert found.rig.names == given.rig.names
    assert given.surface is not None
    assert found.surface is not None
    size = float(np.ptp(given.surface.vertices, axis=0).max())
    assert_allclose(found.rig.position, given.rig.position, atol=FAR * size)
    # a skin for each colour: vertices on a border between two are there twice
    far, same = KDTree(found.surface.vertices).query(given.surface.vertices)
    assert far.max() < FAR * size
    assert_allclose(found.surface.weights[same], given.surface.weights, atol=1e-6)
    assert len(found.surface.faces) == len(given.surface.faces)
    whole = found.surface.colours.mean(axis=0)
    assert_allclose(whole, given.surface.colours.mean(axis=0), atol=0.02)
    wanted = posed(given.rig, moves.rig, moves.action(moves.clips.index(clip)))
    ours = found.action(0)
    creature = Creature(fb.open_run(tmp_path / "run"))
    jointed = {name for name in creature.model.joint_names} - {free, given.rig.names[0]}
    chosen = [n for n, name in enumerate(given.rig.names) if name in jointed]
    kept = sorted(set(chosen) - beyond(given.rig, free))
    assert len(kept) > 10
    count = len(ours.rotation)
    assert angles(ours.rotation[:, kept], wanted.rotation[:count, kept]) < TURNED


def test_clip_that_nearly_closes_is_a_cycle() -> None:
    """Its first pose comes once more; one that ends elsewhere is no cycle, a closed one stays."""

    def turning(degrees: list[float]) -> Clip:
        turns = Rotation.from_euler("z", np.array(degrees)[:, None], degrees=True)
        quaternions = turns.as_quat(scalar_first=True)[:, None]
        still = np.zeros((len(degrees), 3))
        return Clip(("a",), np.array([-1]), np.zeros((1, 3)), {}, 0.1, quaternions, still)

    nearly = turning([0.0, 10.0, 20.0, 10.0, 2.0])
    found = as_cycle(nearly)
    assert found is not None
    assert found.frames == 6
    assert_allclose(found.rotations[:5], nearly.rotations)
    assert_allclose(found.rotations[5], nearly.rotations[0])
    closed = turning([0.0, 10.0, 20.0, 10.0, 0.0])
    assert as_cycle(closed) is closed
    assert as_cycle(turning([0.0, 10.0, 20.0, 30.0])) is None


def beyond(rig: Rig, name: str) -> set[int]:
    """A joint and all below it."""
    found = {rig.names.index(name)}
    for joint, parent in enumerate(rig.parents.tolist()):
        if parent in found:
            found.add(joint)
    return found


@pytest.fixture(scope="module")
def hand(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, tuple[str, ...]]:
    """The scene of a hand whose 25 joints lie side by side, and the notes of its import."""
    folder = tmp_path_factory.mktemp("hand")
    hands.write_hand(folder / "hand.vrm")
    made = fb.import_character(folder / "hand.vrm", folder / "scene")
    return made.scene, made.notes


def test_joints_side_by_side_hang_on_the_one_with_the_most_weight(
    hand: tuple[Path, tuple[str, ...]],
) -> None:
    """A .vrm file is a .glb by its content; its first joint is a fingertip."""
    scene, notes = hand
    assert notes[0].startswith(
        "its joints have no common root: 24 of 25 without a parent hang on 'wrist', which has the "
        "most weight; "
    )
    solid = load_model(fb.load_scene(scene))
    names, places = hands.joints()
    assert names[0] == "pinky-tip"
    wrist = solid.body("wrist")
    assert solid.mj.body_parentid[wrist] == 0
    others = [solid.body(name) for name in names if name != "wrist"]
    assert (solid.mj.body_parentid[others] == wrist).all()
    pose = kinematics(solid, solid.rest().q)
    found = pose.body_position[[solid.body(name) for name in names]]
    assert_allclose(found, places @ Z_UP.T, atol=1e-7)


def test_fingers_of_a_hand_without_chains_curl_as_in_the_file(
    hand: tuple[Path, tuple[str, ...]],
) -> None:
    clip = read_bvh(hand[0].with_suffix(".bvh"))
    assert clip.names[0] == "wrist"
    turned = [name for name in clip.names if name.endswith(hands.CURLED)]
    assert turned
    _, world = clip.poses()
    for joint, name in enumerate(clip.names):
        angle = np.degrees(Rotation.from_quat(world[:, joint], scalar_first=True).magnitude())
        assert_allclose(np.ptp(angle), hands.CURL if name in turned else 0.0, atol=TURNED)


def test_bodies_of_a_hand_have_inertias_that_bodies_can_have(
    hand: tuple[Path, tuple[str, ...]],
) -> None:
    """Where three regions meet, a piece of its own would be no body: it joins its neighbour, and
    the notes say so. The bodies still have the mass of the whole."""
    scene, notes = hand
    mj = load_model(fb.load_scene(scene)).mj
    heavy = mj.body_mass > 0.0
    inertia = np.sort(mj.body_inertia[heavy], axis=1)
    assert (inertia[:, 0] > 0.0).all()
    assert (inertia[:, 2] < inertia[:, 0] + inertia[:, 1]).all()
    (said,) = [note for note in notes if note.startswith("joined to their neighbour")]
    vertices, faces = hands.surface()
    assert mj.body_mass.sum() == pytest.approx(1000.0 * ShapeMesh(vertices, faces).volume, rel=1e-5)
    rig, surface = one_hand()
    joined = said.rpartition(": ")[2].split(", ")
    division = divided(rig, surface, "hand.vrm")
    assert [rig.names[joint] for joint in division.unsound] == joined
    assert all(is_sound(mesh) for mesh in (*division.pieces.values(), *division.shapes.values()))


def one_hand() -> tuple[Rig, Surface]:
    """The skeleton as one tree on the wrist, and the surface, z up."""
    names, places = hands.joints()
    vertices, faces = hands.surface()
    flat = Rig(tuple(names), np.full(25, -1), places @ Z_UP.T, np.tile(Z_UP, (25, 1, 1)))
    weights = hands.weights(vertices)
    first = np.argsort(-weights, axis=1)[:, 4:]
    np.put_along_axis(weights, first, 0.0, axis=1)
    weights /= weights.sum(axis=1, keepdims=True)
    grey = np.full((len(faces), 3), 0.5)
    surface = Surface(vertices @ Z_UP.T, faces, weights, grey)
    rig, order = one_tree(flat, heaviest(surface))
    return rig, replace(surface, weights=weights[:, order])


def test_the_base_has_every_library_of_an_import() -> None:
    """Pillow came with the extra film alone, and an import failed without it."""
    root = Path(__file__).parents[2]
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    base = {canonicalize_name(Requirement(line).name) for line in project["dependencies"]}
    used = set[str]()
    for path in (root / "src" / "flowborne" / "characters").glob("[!u]*.py"):  # USD is an extra
        for line in ast.parse(path.read_text()).body:
            named = line.names if isinstance(line, ast.Import) else []
            modules = [line.module] if isinstance(line, ast.ImportFrom) else [n.name for n in named]
            used |= {module.partition(".")[0] for module in modules if module}
    owners = packages_distributions()
    outside = used - sys.stdlib_module_names - {"flowborne"}
    needed = {canonicalize_name(owners[name][0]) for name in outside}
    assert {"numpy", "pillow", "pydantic", "scipy"} <= needed <= base
