"""The reader of planar pose graphs, and the traps that other readers fell into."""

from pathlib import Path

import numpy as np
import pytest
from lab.recordings import g2o
from lab.recordings.recording import BadRecording

EDGE = "EDGE_SE2 7 9 1.5 -0.25 0.5 1 2 3 4 5 6\n"


def graph(tmp_path: Path, text: str) -> g2o.G2o:
    path = tmp_path / "some.g2o"
    path.write_text(text)
    return g2o.read(path)


def test_an_edge_becomes_its_ends_its_pose_and_a_symmetric_information(tmp_path: Path) -> None:
    read = graph(tmp_path, EDGE)
    assert read.ids.tolist() == [7, 9]
    assert (read.i.tolist(), read.j.tolist()) == ([0], [1])
    assert read.measured.tolist() == [[1.5, -0.25, 0.5]]
    assert read.information.tolist() == [[[1, 2, 3], [2, 4, 5], [3, 5, 6]]]


def test_two_closures_between_the_same_poses_both_count(tmp_path: Path) -> None:
    assert len(graph(tmp_path, EDGE + EDGE).i) == 2


@pytest.mark.parametrize("end", ["\n", "\n\n", "   \n", ""])
def test_a_blank_last_line_changes_nothing(tmp_path: Path, end: str) -> None:
    read = graph(tmp_path, EDGE.rstrip("\n") + end)
    assert len(read.i) == 1


def test_vertices_are_kept_and_missing_ones_are_nan(tmp_path: Path) -> None:
    read = graph(tmp_path, "FIX 9\nVERTEX_SE2 9 1 2 3\n" + EDGE)
    assert np.isnan(read.vertices[0]).all()
    assert read.vertices[1].tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", "no EDGE_SE2 line"),
        ("EDGE_SE2 0 1 1 2 3\n", "line 1: 3 numbers stand there, 9 belong there: dx dy dyaw I11"),
        ("EDGE_SE2 0\n", "line 1: nothing is no id: a whole number below 2"),
        ("VERTEX_SE2\n", "line 1: .* x y yaw"),
        ("VERTEX_SE2 9223372036854775808 0 0 0\n", "line 1: 9223372036854775808 is no id"),
        (
            EDGE + "EDGE_SE3:QUAT 0 1\n",
            "line 2: EDGE_SE3:QUAT is not .*VERTEX_SE2, EDGE_SE2 and FIX",
        ),
        (EDGE.replace("1.5", "nan"), "line 1: nan is not a finite number"),
        (EDGE.replace("7", "x"), "line 1: x is no id"),
    ],
)
def test_what_cannot_be_read_is_said_with_its_line(tmp_path: Path, text: str, what: str) -> None:
    with pytest.raises(BadRecording, match=what):
        graph(tmp_path, text)


def test_comments_and_a_byte_order_mark_change_nothing(tmp_path: Path) -> None:
    read = graph(tmp_path, "\ufeff# by hand\n" + EDGE + "  # 7 9\n// end\n")
    assert (read.ids.tolist(), len(read.i)) == ([7, 9], 1)


def test_the_largest_id_is_read(tmp_path: Path) -> None:
    read = graph(tmp_path, EDGE.replace("7", str((1 << 63) - 1), 1))
    assert read.ids.tolist() == [9, (1 << 63) - 1]
    assert (read.i.tolist(), read.j.tolist()) == ([1], [0])
