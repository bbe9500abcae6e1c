"""The table of readers in tools/README.md is the one that the program has."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lab.recordings import g2o, swust, world
from lab.recordings.readers import EDGE_FILE, READERS, playable, read
from lab.recordings.recording import BadRecording, Trail
from places import REPOSITORY

ROWS = re.findall(
    r"^\| (.+?) \| `(lab/recordings/\w+\.py)` \| ",
    (REPOSITORY / "tools" / "README.md").read_text(),
    flags=re.MULTILINE,
)


def test_every_ending_that_is_read_has_a_row_and_no_row_is_left_over() -> None:
    endings = {kind.strip("`") for kind, _ in ROWS if kind.startswith("`.")}
    assert endings == set(READERS)


def test_folders_are_in_the_table_too() -> None:
    assert any("folder" in kind or EDGE_FILE in kind for kind, _ in ROWS)


def test_every_row_names_a_reader_that_is_there() -> None:
    for _, file in ROWS:
        assert "def read(" in (REPOSITORY / "tools" / file).read_text(), file


# what can be played

SHORT = world.simulate(world.Scene(robots=2, seconds=3.0, odometry_hz=10, range_hz=10), 1)


def with_stamps(t: np.ndarray[tuple[int], np.dtype[np.float64]]) -> dict[int, Trail]:
    return {**SHORT.trails, 1: replace(SHORT.trails[1], t=t)}


def test_a_recording_that_can_be_played_comes_back_as_it_was() -> None:
    assert playable(SHORT) is SHORT


@pytest.mark.parametrize(
    ("scale", "said"),
    [
        (0.05 / 2.9, ""),
        (0.049 / 2.9, "robot 1 is there for 0.049 s; stamps are in seconds"),
        (0.0, "robot 1 has no two poses, or stamps that do not rise"),
        (-1.0, "robot 1 has no two poses, or stamps that do not rise"),
        (86_399 / 2.9, ""),
        (86_500 / 2.9, "24 hours from the first stamp to the last"),
        (1e9, "hours from the first stamp to the last; stamps are in seconds on one clock"),
    ],
)
def test_stamps_that_are_no_seconds_are_one_sentence(scale: float, said: str) -> None:
    wrong = replace(SHORT, trails=with_stamps(SHORT.trails[1].t * scale * 1.0000001))
    if not said:
        assert playable(wrong) is wrong
        return
    with pytest.raises(BadRecording, match=said):
        playable(wrong)


@pytest.mark.parametrize(("node", "fits"), [(254, True), (255, False)])
def test_more_robots_than_a_module_can_name_are_refused(node: int, fits: bool) -> None:
    ranges = SHORT.ranges.copy()
    ranges[0, 2] = node
    if fits:
        playable(replace(SHORT, ranges=ranges))
        return
    with pytest.raises(BadRecording, match="3 robots and nodes, 255 can be named"):
        playable(replace(SHORT, ranges=ranges))


# files that are damaged

PYFG = """\
VERTEX_SE2 10.0 A0 1 2 0.5
VERTEX_SE2 10.1 A1 1.1 2 0.6
VERTEX_SE2 10.0 C0 0 0 0
VERTEX_SE2 10.2 C1 1 0 0
VERTEX_XY L0 5 6
EDGE_SE2 10.1 A0 A1 1 0 1.5707963267948966 1 0 0 1 0 1
EDGE_SE2 10.2 C0 C1 0.5 0.25 0 1 0 0 1 0 1
EDGE_SE2 10.2 C1 A1 0.5 0.25 0 1 0 0 1 0 1
EDGE_RANGE 10.15 C1 A1 3.5 0.01
EDGE_RANGE 10.05 A0 L0 7.25 0.01
"""
G2O = "VERTEX_SE2 0 1 2 3\nEDGE_SE2 0 1 1.5 -0.25 0.5 1 2 3 4 5 6\nFIX 0\n"
VUB = "t,uwb_m,tb1_odo_x,tb1_odo_y,tb1_odo_yaw,tb2_odo_x,tb2_odo_y,tb2_odo_yaw\n" + "".join(
    f"{k}.5,3.{k},{k},0,0,0,{k},1\n" for k in range(9)
)


def damaged(text: str, rng: np.random.Generator) -> bytes:
    """Cut, with bytes changed, words swapped or lines doubled."""
    data = bytearray(text.encode())
    kind = int(rng.integers(4))
    if kind == 0:
        del data[int(rng.integers(len(data))) :]
    elif kind == 1:
        for _ in range(int(rng.integers(1, 6))):
            data[int(rng.integers(len(data)))] = int(rng.integers(256))
    elif kind == 2:
        words = text.split(" ")
        i, j = rng.integers(len(words), size=2)
        words[i], words[j] = words[j], words[i]
        data = bytearray(" ".join(words).encode())
    else:
        lines = text.splitlines(keepends=True)
        odd = ["-1e308 ", "nan ", "9" * 400, "A", "\x00", "EDGE_SE2 ", "\N{SUPERSCRIPT TWO}"]
        at = int(rng.integers(len(lines)))
        lines[at] = lines[at].replace(" ", " " + odd[int(rng.integers(len(odd)))], 1)
        data = bytearray("".join(rng.permutation(lines)).encode())
    return bytes(data)


def complaint(path: Path) -> str:
    """Of the reader of a file."""
    try:
        if path.suffix == ".g2o":
            g2o.read(path)
        elif path.suffix == ".txt":
            swust.read(path.parent)
        else:
            read(path)
    except BadRecording as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("some.pyfg", PYFG),
        ("some.g2o", G2O),
        ("expN_los.csv", VUB),
        ("x_base-2_targ-3_.csv", VUB.replace("uwb_m", "1_1")),
        ("drone1_odom.txt", "a 1 2 3 4\n" * 5),
        ("some.mat", PYFG),
    ],
)
def test_whatever_is_damaged_is_read_or_named_in_one_sentence(
    name: str, text: str, tmp_path: Path
) -> None:
    rng = np.random.default_rng(len(text))
    path, refused = tmp_path / name, 0
    for other in ("params_estimate_1_2.txt", "gt_1_interpolation.txt"):
        (tmp_path / other).write_text("a b 1 2 3 4\n" * 4)
    for _ in range(100):
        path.write_bytes(damaged(text, rng))
        said = complaint(path)
        refused += bool(said)
        assert "\n" not in said
        assert len(said) < 300
    assert refused > 10
