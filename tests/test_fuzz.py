"""The attack of `make fuzz` with the first of its inputs, and what a stranger's scene may do."""

import os
import random
import sys
from pathlib import Path

import pytest

import flowborne as fb
import fuzz_judge
from flowborne.cli import main as cli
from flowborne.scenes.load import load_scene
from flowborne.scenes.save import scene_files
from fuzz import COUNTS, attack, run_folder
from fuzz_bases import bases
from fuzz_changes import SECRET
from fuzz_judge import WELL, command, fault, surroundings_kept

INPUTS = {"scenes": 40, "parts": 12}


@pytest.mark.parametrize("part", range(4))
@pytest.mark.parametrize("campaign", INPUTS)
def test_broken_inputs_run_or_are_refused_in_one_message(campaign, part, monkeypatch):
    monkeypatch.setattr(fuzz_judge, "PATIENCE", 1.0)
    for number in range(part, INPUTS[campaign], 4):
        kind, outcome = attack(campaign, number, "tests")
        assert outcome.verdict in WELL, (number, kind, outcome)


def test_the_same_seed_breaks_the_same():
    for makers, _ in COUNTS.values():
        for make, _ in makers.values():
            one, again, other = (make(random.Random(seed)) for seed in ("a", "a", "b"))
            assert one == again
            assert one != other or make is run_folder


def test_what_a_library_writes_on_stderr_is_no_message_of_ours(monkeypatch):
    def fail(arguments):
        os.write(2, b"error of a library\n")
        print("flowborne: nothing is there", file=sys.stderr)
        sys.exit(2)

    monkeypatch.setattr(cli, "main", fail)
    said = command("check")
    assert said.lines == ["error of a library", "flowborne: nothing is there"]
    assert fault(said, (2,)) == "no message of flowborne's"


def test_a_file_that_changes_beside_a_folder_is_noticed(tmp_path):
    folder, canary = tmp_path / "a" / "b" / "input", tmp_path / "a" / "b" / "canary"
    folder.mkdir(parents=True)
    canary.write_text("alive")
    for change in (canary.unlink, (tmp_path / "a" / "new").mkdir, lambda: canary.write_text("x")):
        with surroundings_kept(folder) as changed:
            change()
        assert len(changed) == 1
    with surroundings_kept(folder) as changed:
        (folder / "new").mkdir()
    assert changed == []


def written(folder: Path, base: str, **changed: bytes) -> Path:
    for name, content in (bases()[base] | changed).items():
        (folder / name).write_bytes(content)
    return folder / "scene.toml"


STRANGE = [(base, name) for base, files in bases().items() for name in files]


@pytest.mark.parametrize(("base", "name"), STRANGE)
def test_no_message_repeats_what_stands_in_a_file_of_another_kind(tmp_path, base, name):
    scene = written(tmp_path, base, **{name: b"root:x:0:0 " + SECRET + b"\n" + SECRET})
    said = command("check", scene)
    assert said.code == 2
    assert len(said.messages) == 1
    assert SECRET.decode() not in said.messages[0]


WIND = """
[[wind]]
kind = "python"
function = "intruder:blow"
"""


def test_check_imports_no_python_unless_told(tmp_path, capsys):
    """A stranger's module would leave a file behind."""
    left = tmp_path / "left"
    (tmp_path / "intruder.py").write_text(
        f"open({str(left)!r}, 'w').close()\ndef blow(x, time):\n    return [0.0, 0.0, 0.0]\n"
    )
    text = 'plugins = ["intruder.py"]\n' + bases()["pendulum"]["scene.toml"].decode() + WIND
    scene = written(tmp_path, "pendulum", **{"scene.toml": text.encode()})
    said = command("check", scene)
    assert said.code == 2
    assert "brings Python" in said.messages[0]
    assert "plugin intruder.py, function intruder:blow" in said.messages[0]
    assert "--trust" in said.messages[0]
    with pytest.raises(fb.SceneError, match="brings Python"):
        fb.load_scene(scene, trust=False)
    assert not left.exists()
    try:
        assert command("check", scene, "--trust").code == 0
        assert left.exists()
    finally:
        sys.path.remove(str(tmp_path))
        del sys.modules["intruder"]


def test_letters_that_steer_a_terminal_are_written_out(capsys):
    with pytest.raises(SystemExit):
        cli.main(["check", "no\x1b[2J\n\u202ething.toml"])
    said = capsys.readouterr().err
    assert said.startswith("flowborne: there is no scene file no\\x1b[2J\\n\\u202ething.toml")
    assert said.count("\n") == 1


def test_a_long_message_is_shortened_in_its_middle(capsys):
    with pytest.raises(SystemExit):
        cli.main(["check", "eel", f"--set=a..b={'x' * 9999}"])
    said = capsys.readouterr().err
    assert said.startswith("flowborne: ")
    assert " ... " in said
    assert len(said) < 1100


def test_mouths_beside_a_broken_domain_are_not_looked_for_in_its_cells(tmp_path):
    text = bases()["swim"]["scene.toml"].replace(b"resolution = 16", b"resolution = -0.5")
    said = command("check", written(tmp_path, "swim", **{"scene.toml": text}))
    assert said.code == 2
    assert len(said.messages) == 1
    assert "resolution" in said.messages[0]


@pytest.mark.parametrize(
    "name", ["summary.json", "History.csv", "walk.bvh", "scene.toml", "states"]
)
def test_a_clip_takes_the_place_of_no_file_of_the_run(tmp_path, name):
    text = bases()["walk"]["scene.toml"].decode().replace("walk.bvh", f"clips/{name}")
    (tmp_path / "clips").mkdir()
    (tmp_path / "clips" / name).write_bytes(bases()["walk"]["walk.bvh"])
    if name == "walk.bvh":
        text += '[output]\nexports = ["walk.bvh"]\n'
    scene = written(tmp_path, "walk", **{"scene.toml": text.encode()})
    files = scene_files(load_scene(scene))
    assert files[f"2-{name}"] == bases()["walk"]["walk.bvh"]
    out = tmp_path / "run"
    assert fb.run(scene, out, film=False).frames == 3
    assert fb.run(scene, out, film=False, resume=True, frames=5).frames == 5


def test_two_surfaces_of_one_name_stay_two(tmp_path):
    """In two folders, and in one run folder."""
    text = bases()["skinned"]["scene.toml"].decode()
    flesh = text[text.index("[[flesh]]") :]
    other = flesh.replace('"skin"', '"glove"').replace('"cart"', '"hand"')
    for folder, part in (("one", flesh), ("other", other)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "skin.ply").write_bytes(bases()["skinned"]["skin.ply"])
        text = text.replace(flesh, "") + part.replace("skin.ply", f"{folder}/skin.ply")
    import trimesh

    mesh = trimesh.creation.icosphere(1, 0.25)
    mesh.apply_translation([0.0, 0.0, -0.7])
    mesh.export(tmp_path / "other" / "skin.ply")
    scene = written(tmp_path, "skinned", **{"scene.toml": text.encode()})
    files = scene_files(load_scene(scene))
    assert files["skin.ply"] == (tmp_path / "one" / "skin.ply").read_bytes()
    assert files["2-skin.ply"] == (tmp_path / "other" / "skin.ply").read_bytes()


def test_a_damaged_mesh_of_flesh_is_not_made_anew(tmp_path):
    content = bases()["fish"]["fish.vtu"]
    for damaged in (b"", content[:5000], b"\0" * 100, content.replace(b"Float64", b"Float65")):
        said = command("check", written(tmp_path, "fish", **{"fish.vtu": damaged}))
        assert said.code == 2
        assert "cannot be read as a mesh of flesh" in said.messages[0]
        assert len(said.messages) == 1


def test_a_grid_that_no_memory_holds_is_told_what_it_takes(tmp_path):
    said = command("check", "ns-block-drag-max", "--set", "domain.resolution=1000000")
    assert said.code == 2
    assert "1e+12 cells take 6.52e+05 GB of memory or more" in said.messages[0]
