"""The text format of range-aided graphs: what is written is read back, and faults have a line."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from lab.recordings import pyfg, world
from lab.recordings.readers import read
from lab.recordings.recording import BadRecording, Recording

GOOD = """\
VERTEX_SE2 10.0 A0 1 2 0.5
VERTEX_SE2 10.1 A1 1.1 2 0.6
VERTEX_SE2 10.2 A2 1.2 2 0.7
VERTEX_SE2 10.0 C0 0 0 0
VERTEX_SE2 10.2 C1 1 0 0
VERTEX_XY L0 5 6
EDGE_SE2 10.1 A0 A1 1 0 1.5707963267948966 1 0 0 1 0 1
EDGE_SE2 10.2 A1 A2 1 0 0 1 0 0 1 0 1
EDGE_SE2 10.2 C0 C1 0.5 0.25 0 1 0 0 1 0 1
EDGE_RANGE 10.15 C1 A1 3.5 0.01
EDGE_RANGE 10.05 A0 L0 7.25 0.01
"""
SIGMAS = np.array([0.002, 0.001, 0.005])


def from_text(folder: Path, text: str) -> Recording:
    path = folder / "some.pyfg"
    path.write_text(text, encoding="utf-8")
    return read(path)


def with_line(number: int, text: str) -> str:
    """The good file with one line, counted from 1, replaced."""
    lines = GOOD.splitlines()
    lines[number - 1] = text
    return "\n".join(lines) + "\n"


def test_edges_are_chained_and_ranges_sorted(tmp_path: Path) -> None:
    found = from_text(tmp_path, GOOD)
    assert sorted(found.trails) == [0, 1]
    quarter = math.pi / 2
    assert found.trails[0].odometry == pytest.approx(
        np.array([[0, 0, 0], [1, 0, quarter], [1, 1, quarter]])
    )
    assert found.trails[1].odometry.tolist() == [[0, 0, 0], [0.5, 0.25, 0]]
    assert found.trails[0].truth.tolist() == [[1, 2, 0.5], [1.1, 2, 0.6], [1.2, 2, 0.7]]
    assert found.trails[0].t == pytest.approx([0.1, 0.2, 0.3])
    # robots A and C are 0 and 1, the standing node comes after them
    assert found.ranges == pytest.approx(np.array([[0.15, 0, 2, 7.25], [0.25, 1, 0, 3.5]]))
    assert found.duration == pytest.approx(0.3)


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    scene = world.Scene(robots=3, seconds=6.0, odometry_hz=10, range_hz=25)
    written = world.simulate(scene, 5)
    pyfg.write(tmp_path / "run.pyfg", written, 0.12, SIGMAS)
    found = read(tmp_path / "run.pyfg")
    later = 0.1
    assert sorted(found.trails) == sorted(written.trails)
    for robot, trail in written.trails.items():
        again = found.trails[robot]
        assert again.t == pytest.approx(trail.t + later, abs=2e-6)
        assert again.truth == pytest.approx(trail.truth, abs=1e-6)
        assert again.odometry == pytest.approx(trail.odometry, abs=1e-6)
    assert len(found.ranges) == len(written.ranges) > 400
    assert found.ranges[:, :3] == pytest.approx(written.ranges[:, :3] + [later, 0, 0], abs=2e-6)
    assert found.ranges[:, 3] == pytest.approx(written.ranges[:, 3], abs=1e-6)


def test_a_written_file_states_its_noise(tmp_path: Path) -> None:
    pyfg.write(tmp_path / "run.pyfg", from_text(tmp_path, GOOD.replace("L0", "A1")), 0.12, SIGMAS)
    lines = (tmp_path / "run.pyfg").read_text().splitlines()
    edge = next(line for line in lines if line.startswith("EDGE_SE2")).split()
    assert [float(w) for w in edge[7:]] == pytest.approx([4e-6, 0, 0, 1e-6, 0, 2.5e-5])
    assert float(lines[-1].split()[-1]) == pytest.approx(0.0144)


@pytest.mark.parametrize(
    "text",
    [
        GOOD + "\n",
        GOOD + "   \n\n",
        GOOD.rstrip(),
        GOOD.replace("\n", "\r\n"),
        GOOD.replace("L0 5 6", "L 5 6").replace("A0 L0 7", "A0 L 7"),
        GOOD.replace("VERTEX_XY L0", "VERTEX_XY 10.0 L0"),
        GOOD.replace("VERTEX_XY L0 5 6\n", ""),
        "\ufeff" + GOOD,
        GOOD.replace("EDGE_SE2 10.2 A1", "  // a comment\n% another\nEDGE_SE2 10.2 A1"),
        "# written by hand\n" + GOOD + "VERTEX_SE2:PRIOR 10.0 A0 1 2 0.5\n",
    ],
    ids=[
        "blank last line",
        "blank lines",
        "no last line feed",
        "DOS line feeds",
        "standing node without a number",
        "standing node with a stamp",
        "standing node unplaced",
        "byte order mark",
        "comments",
        "lines of other kinds",
    ],
)
def test_how_others_write_it_is_read_too(tmp_path: Path, text: str) -> None:
    found, plain = from_text(tmp_path, text), from_text(tmp_path, GOOD)
    assert found.ranges.tolist() == plain.ranges.tolist()
    assert found.trails[0].odometry.tolist() == plain.trails[0].odometry.tolist()


@pytest.mark.parametrize(
    ("number", "line", "sentence"),
    [
        (2, "VERTEX_SE2 10.1 A1 1.1 2", "VERTEX_SE2 has 4 fields; t key x y yaw belong there"),
        (2, "VERTEX_SE2 10.1 A1 1.1 2 0.6 7", "has 6 fields; t key x y yaw belong there"),
        (2, "VERTEX_SE2 10.1 A1 1.1 two 0.6", "'two' is not a number"),
        (2, "VERTEX_SE2 10.1 A1 1.1 nan 0.6", "nan is not a finite number"),
        (2, "VERTEX_SE2 1e18 A1 1.1 2 0.6", "too large: seconds, metres and radians are read"),
        (2, "VERTEX_SE3:QUAT 10.1 A1 1 2 3 0 0 0 1", "EDGE_SE2 and EDGE_RANGE are read"),
        (6, "VERTEX_XY L0 5", "VERTEX_XY has 2 fields; key x y belong there"),
        (7, "EDGE_SE2 10.1 A0 A1 1 0", "t from to dx dy dyaw and six covariances belong there"),
        (7, "EDGE_SE2 soon A0 A1 1 0 0 1 0 0 1 0 1", "'soon' is not a number"),
        (7, "EDGE_SE2 10 A1 A1 1 0 0 1 0 0 1 0 1", "EDGE_SE2 joins A1 to itself"),
        (10, "EDGE_RANGE 10.15 C1 A1 3.5", "t a b range variance belong there, or these without t"),
        (10, "EDGE_RANGE 10.15 C1 A1 inf 1", "belong there, or these without t"),
        (10, "EDGE_RANGE 10.15", "belong there, or these without t"),
    ],
)
def test_a_line_that_cannot_be_used_is_named_in_one_sentence(
    tmp_path: Path, number: int, line: str, sentence: str
) -> None:
    with pytest.raises(BadRecording) as fault:
        from_text(tmp_path, with_line(number, line))
    said = str(fault.value)
    assert said.startswith(f"some.pyfg line {number}: ")
    assert said.endswith(sentence)


@pytest.mark.parametrize("line", ["", "EDGE_SE2 10.2 A0 A2 1 0 0 1 0 0 1 0 1"])
def test_odometry_that_lacks_a_step_is_refused(tmp_path: Path, line: str) -> None:
    text = with_line(8, line) + "VERTEX_SE2 10.3 A3 1 2 3\nEDGE_SE2 10.3 A2 A3 1 0 0 1 0 0 1 0 1\n"
    with pytest.raises(BadRecording, match=r"^some.pyfg: no EDGE_SE2 from A1 to A2, so the odom"):
        from_text(tmp_path, text)


CLOSURES = """\
EDGE_SE2 10.2 A2 C1 1 0 0 1 0 0 1 0 1
EDGE_SE2 10.2 A0 A2 1 0 0 1 0 0 1 0 1
EDGE_SE2 10.1 A0 A1 5 5 5 1 0 0 1 0 1
"""


@pytest.mark.parametrize("order", [1, -1])
def test_loop_closures_are_left_out_and_counted(tmp_path: Path, order: int) -> None:
    """Also before the odometry; of two edges between the same two poses the first counts."""
    lines = (GOOD + CLOSURES).splitlines()
    if order < 0:
        lines = [*lines[:6], *CLOSURES.splitlines()[:2], *lines[6:11], CLOSURES.splitlines()[2]]
    found, plain = from_text(tmp_path, "\n".join(lines)), from_text(tmp_path, GOOD)
    assert found.notes == {"closures left out": 3}
    assert plain.notes == {"closures left out": 0}
    for robot, trail in plain.trails.items():
        assert found.trails[robot].odometry.tolist() == trail.odometry.tolist()
        assert found.trails[robot].t.tolist() == trail.t.tolist()


def test_an_edge_that_was_written_backwards_is_turned_round(tmp_path: Path) -> None:
    """A1 in A2 is half a metre ahead: A2 in A1 is half a metre behind."""
    text = with_line(9, "EDGE_SE2 10.0 C1 C0 -0.5 -0.25 0 1 0 0 1 0 1")
    assert from_text(tmp_path, text).trails[1].odometry == pytest.approx(
        np.array([[0, 0, 0], [0.5, 0.25, 0]])
    )
    assert from_text(tmp_path, text).trails[1].t == pytest.approx([0.1, 0.3])


@pytest.mark.parametrize("stamp", ["", "0 ", "0.0 "])
def test_ranges_without_a_time_have_that_of_the_pose_named_first(
    tmp_path: Path, stamp: str
) -> None:
    text = GOOD.replace("EDGE_RANGE 10.15 ", f"EDGE_RANGE {stamp}")
    text = text.replace("EDGE_RANGE 10.05 ", f"EDGE_RANGE {stamp}")
    found = from_text(tmp_path, text)
    # C1 was at 10.2 and A0 at 10.0
    assert found.ranges == pytest.approx(np.array([[0.1, 0, 2, 7.25], [0.3, 1, 0, 3.5]]))


def test_a_single_range_may_have_any_time(tmp_path: Path) -> None:
    text = GOOD.replace("EDGE_RANGE 10.05 A0 L0 7.25 0.01\n", "")
    assert from_text(tmp_path, text).ranges[0, 0] == pytest.approx(0.25)


def test_a_range_of_which_nobody_knows_when_is_named(tmp_path: Path) -> None:
    text = GOOD + "EDGE_RANGE M0 L0 1.0 0.01\n"
    with pytest.raises(BadRecording, match=r"EDGE_RANGE M0 L0 has no time, and neither has a VER"):
        from_text(tmp_path, text)


@pytest.mark.parametrize(
    ("a", "c"),
    [("robot1_", "robot2_"), ("x.", "y."), ("base", "rover/"), ("alpha:", "beta:")],
)
def test_keys_may_have_any_names(tmp_path: Path, a: str, c: str) -> None:
    text = re.sub(r"\bA(\d)", rf"{a}\1", re.sub(r"\bC(\d)", rf"{c}\1", GOOD))
    found, plain = from_text(tmp_path, text), from_text(tmp_path, GOOD)
    assert found.ranges.tolist() == plain.ranges.tolist()
    assert found.trails[1].odometry.tolist() == plain.trails[1].odometry.tolist()


def test_keys_may_be_numbers_of_gtsam(tmp_path: Path) -> None:
    def number(match: re.Match[str]) -> str:
        return str((ord(match[1]) << 56) + int(match[2]))

    text = re.sub(r"\b([AC])(\d)", number, GOOD)
    found, plain = from_text(tmp_path, text), from_text(tmp_path, GOOD)
    assert found.ranges.tolist() == plain.ranges.tolist()


def test_standing_nodes_are_one_each(tmp_path: Path) -> None:
    text = GOOD + "VERTEX_XY L1 9 9\nEDGE_RANGE 10.2 A1 L1 2.5 0.01\n"
    assert from_text(tmp_path, text).ranges[:, 1:3].tolist() == [[0, 2], [1, 0], [0, 3]]


def test_a_pose_without_a_true_vertex_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadRecording, match=r"^some.pyfg: no VERTEX_SE2 A2, so nothing to score"):
        from_text(tmp_path, GOOD.replace("10.2 A2 1.2", "10.2 A3 1.2"))


@pytest.mark.parametrize("text", ["", "\n\n", "VERTEX_SE2 1.0 A0 0 0 0\n", "hello\n"])
def test_a_file_without_odometry_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(BadRecording, match=r"^some.pyfg: no EDGE_SE2 line, so no odometry"):
        from_text(tmp_path, text)


def test_a_file_that_is_not_there_or_is_no_text_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(BadRecording, match=r"gone.pyfg: No such file or directory$"):
        read(tmp_path / "gone.pyfg")
    (tmp_path / "photo.pyfg").write_bytes(b"\x89PNG\xff\xfe\x00")
    with pytest.raises(BadRecording, match=r"photo.pyfg: not a text file$"):
        read(tmp_path / "photo.pyfg")
