"""Truth out of files that people have: TUM and CSV, in UNIX time."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from lab.recordings.recording import BadRecording
from lab.replay import truth

TUM = "# t x y z qx qy qz qw\n1795745746.5 1 2 0 0 0 0.7071067811865476 0.7071067811865476\n"
TUM += "1795745745.5 0 2 0 0 0 0 1\n"
CSV = "x,Y,Time,yaw,note\n1,2,10.5,3.1,a\n1,3,11.5,-3.1,b\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "robot_3.tum").write_text(TUM)
    (tmp_path / "2.csv").write_text("\ufeff" + CSV)
    (tmp_path / "notes.md").write_text("nothing")
    return tmp_path


def test_each_file_is_the_truth_of_the_robot_in_its_name(folder: Path) -> None:
    found = truth.read(folder)
    assert sorted(found) == [2, 3]
    assert found[3].tolist() == [
        [1795745745.5, 0, 2, 0],
        [1795745746.5, 1, 2, pytest.approx(math.pi / 2)],
    ]
    # the angle counts on past half a turn
    assert found[2].tolist() == [[10.5, 1, 2, 3.1], [11.5, 1, 3, pytest.approx(2 * math.pi - 3.1)]]
    assert np.array_equal(truth.read(folder / "2.csv")[2], found[2])


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("robot.tum", TUM, "its name has no number of a robot"),
        ("3.tum", TUM.splitlines()[1], "fewer than 2 poses"),
        ("3.tum", TUM + "1 2 3\n", "3.tum, line 4: 3 numbers, not 8"),
        ("3.tum", TUM + "1 2 3 0 0 0 0 one\n", "line 4: could not convert string to float: 'one'"),
        ("3.tum", TUM + "1 nan 3 0 0 0 0 1\n", "a number that is not finite"),
        ("3.csv", "t,x,y\n1,2,3\n", "no column theta in its header (t, x, y)"),
        ("3.csv", CSV + "1,2\n", "line 4: 0 numbers, not 4"),
        ("3.csv", "\xff\xfe", "not a text file"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(
    tmp_path: Path, name: str, text: str, words: str
) -> None:
    (tmp_path / name).write_text(text, encoding="latin-1" if "\xff" in text else "utf-8")
    with pytest.raises(BadRecording) as raised:
        truth.read(tmp_path)
    assert words in str(raised.value)
    assert str(tmp_path) in str(raised.value)


def test_two_files_of_one_robot_or_none_are_refused(folder: Path, tmp_path: Path) -> None:
    (folder / "other-3.tum").write_text(TUM)
    with pytest.raises(BadRecording, match="another file is the truth of robot 3 already"):
        truth.read(folder)
    (tmp_path / "empty").mkdir()
    with pytest.raises(BadRecording, match="no truth in it"):
        truth.read(tmp_path / "empty")
    with pytest.raises(BadRecording, match="No such file"):
        truth.read(tmp_path / "3.tum")
