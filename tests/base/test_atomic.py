import json
import os

import pytest

from flowborne.base.atomic import partial_name, write_atomically, write_json


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


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_or_a_link_where_the_partial_file_belongs_is_replaced(tmp_path):
    path, elsewhere = tmp_path / "summary.json", tmp_path / "elsewhere"
    elsewhere.write_text("alive")
    partial = tmp_path / partial_name(path.name)
    for left in (lambda: os.mkfifo(partial), lambda: partial.symlink_to(elsewhere)):
        left()
        write_json(path, {"frames": 3})
        assert json.loads(path.read_text()) == {"frames": 3}
        assert not os.path.lexists(partial)
    assert elsewhere.read_text() == "alive"
