import json

import pytest

from flowborne.io.atomic import write_atomically, write_json


def test_a_file_that_cannot_be_finished_leaves_the_earlier_one(tmp_path):
    path = tmp_path / "checkpoint.npz"
    path.write_bytes(b"earlier")

    def fail_half_way(file):
        file.write(b"lat")
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        write_atomically(path, fail_half_way)
    assert [entry.name for entry in tmp_path.iterdir()] == ["checkpoint.npz"]
    assert path.read_bytes() == b"earlier"


def test_json_refuses_what_is_no_json(tmp_path):
    path = tmp_path / "summary.json"
    write_json(path, {"scene": "block", "angle": 0.25})
    assert json.loads(path.read_text()) == {"scene": "block", "angle": 0.25}
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json(path, {"angle": float("nan")})
    assert json.loads(path.read_text())["angle"] == 0.25
