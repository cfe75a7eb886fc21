import errno
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flowborne.runs.history import History, history_columns, history_rows

COLUMNS = ("frame", "angle_hinge_rad", "seconds_total")


def rows_of(path):
    return list(history_rows(path, COLUMNS))


def write_rows(path, count):
    history = History.create(path, COLUMNS)
    for frame in range(1, count + 1):
        history.append({"frame": frame, "angle_hinge_rad": frame / 3, "seconds_total": 0.1})
    return history


@given(st.lists(st.floats(allow_nan=True), max_size=5))
def test_numbers_are_read_back_bit_for_bit(tmp_path_factory, numbers):
    path = tmp_path_factory.mktemp("history") / "history.csv"
    history = History.create(path, ("x",))
    for x in numbers:
        history.append({"x": x})
    history.close()
    for (read,), x in zip(history_rows(path, ("x",)), numbers, strict=True):
        assert read == x or (math.isnan(read) and math.isnan(x))


def test_reopening_cuts_rows_and_a_torn_last_line(tmp_path):
    path = tmp_path / "history.csv"
    write_rows(path, 5).close()
    whole = path.read_bytes()
    path.write_bytes(whole[:-4])
    history = History.reopen(path, COLUMNS, 3)
    history.append({"frame": 4, "angle_hinge_rad": 4 / 3, "seconds_total": 0.1})
    history.append({"frame": 5, "angle_hinge_rad": 5 / 3, "seconds_total": 0.1})
    history.close()
    assert path.read_bytes() == whole


def test_a_torn_last_line_is_not_read(tmp_path):
    path = tmp_path / "history.csv"
    write_rows(path, 3).close()
    path.write_bytes(path.read_bytes()[:-2])
    assert [row[0] for row in rows_of(path)] == [1, 2]


def test_reopening_refuses_what_it_cannot_go_on_with(tmp_path):
    path = tmp_path / "history.csv"
    write_rows(path, 2).close()
    with pytest.raises(ValueError, match="has 2 rows where the checkpoint has 3"):
        History.reopen(path, COLUMNS, 3)
    with pytest.raises(ValueError, match="other columns"):
        History.reopen(path, COLUMNS[:2], 1)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("1,", "frame,angle_hinge_rad,seconds_total\n1,", "row 1: not a number for each column"),
        ("0.1\n2", "0.1x\n2", "row 1: not a number for each column"),
        (",0.1\n2", "\n2", "row 1: not a number for each column"),
        ("2,", "3,", "row 2 is of frame 3"),
        ("0.1\n2", "inf\n2", "row 1: a number is not finite"),
        ("0.1\n2", "nan\n2", "row 2: a number is not finite"),
    ],
)
def test_rows_that_are_none_are_not_gone_on_with(tmp_path, before, after, said):
    path = tmp_path / "history.csv"
    write_rows(path, 2).close()
    header, rows = path.read_text().split("\n", 1)
    path.write_text(header + "\n" + rows.replace(before, after, 1))
    with pytest.raises(ValueError, match=said):
        History.reopen(path, COLUMNS, 2)


def test_a_row_that_does_not_fit_on_the_disc_is_not_there(tmp_path, monkeypatch):
    path = tmp_path / "history.csv"
    history = write_rows(path, 2)
    whole = path.read_bytes()

    class FullDisc:
        """Takes five bytes, then has no more room."""

        def __init__(self, file):
            self.file, self.room = file, 5

        def write(self, data):
            if not self.room:
                raise OSError(errno.ENOSPC, "No space left on device")
            self.room -= 5
            return self.file.write(data[:5])

        def __getattr__(self, name):
            return getattr(self.file, name)

    monkeypatch.setattr(history, "_file", FullDisc(history._file))
    with pytest.raises(OSError, match="No space"):
        history.append({"frame": 3, "angle_hinge_rad": 1.0, "seconds_total": 0.1})
    assert path.read_bytes() == whole
    assert history.rows == 2
    assert history_columns(path) == COLUMNS


def test_the_last_row_can_be_taken_back(tmp_path):
    path = tmp_path / "history.csv"
    history = write_rows(path, 2)
    whole, length = path.read_bytes(), history.length
    history.append({"frame": 3, "angle_hinge_rad": 1.0, "seconds_total": 0.1})
    history.drop_last(length)
    assert (path.read_bytes(), history.rows) == (whole, 2)


def test_names_with_commas_quotes_and_line_breaks_are_columns(tmp_path):
    columns = ("time", 'angle_a,b "left"\nor right')
    history = History.create(tmp_path / "history.csv", columns)
    history.append({columns[0]: 0.5, columns[1]: 2.0})
    history.close()
    assert history_columns(tmp_path / "history.csv") == columns
    assert list(history_rows(tmp_path / "history.csv", columns)) == [(0.5, 2.0)]
    History.reopen(tmp_path / "history.csv", columns, 1).close()
