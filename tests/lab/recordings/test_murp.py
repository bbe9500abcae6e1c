"""MURP: tags on two robots that drive circles, and the real recording."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from lab.recordings import murp, readers
from lab.recordings.recording import BadRecording
from recorded import DATA, range_errors


def murp_file(folder: Path, seconds: int) -> Path:
    """Two robots on circles, tag 1 at (0.3, 0.1) on both, ranges 0.12 m too short."""
    t = np.arange(seconds, dtype=float)
    cells = {"t": t}
    ends = []
    for side, (radius, rate) in (("A", (2.0, 0.2)), ("B", (1.5, -0.3))):
        yaw = rate * t
        heading = yaw + (math.pi / 2 if rate > 0 else -math.pi / 2)
        x, y = radius * np.cos(yaw), radius * np.sin(yaw)
        x = x + (4.0 if side == "B" else 0.0)
        cells |= {f"{side}_x": x, f"{side}_y": y}
        cells[f"{side}_yaw"] = np.degrees((heading + np.pi) % (2 * np.pi) - np.pi)
        cos, sin = np.cos(heading), np.sin(heading)
        ends.append(np.stack([x + cos * 0.3 - sin * 0.1, y + sin * 0.3 + cos * 0.1]))
    true = np.hypot(*(ends[1] - ends[0]))
    cells |= {"1_1": true - 0.12, "1_1_t": true}
    rows = [
        ",".join(cells),
        *(",".join(map(str, row)) for row in zip(*cells.values(), strict=True)),
    ]
    path = folder / "99_base-2_targ-3_win-1_step-1.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def test_murp_finds_where_the_tags_are_mounted(tmp_path: Path) -> None:
    found = readers.read(murp_file(tmp_path, 60))
    assert found.antennas[2] == pytest.approx((0.3, 0.1), abs=0.01)
    assert found.antennas[3] == pytest.approx((0.3, 0.1), abs=0.01)
    assert range_errors(found, 2, 3) == pytest.approx(-0.12, abs=0.01)


def test_murp_odometry_is_the_truth_made_wrong_by_its_seed(tmp_path: Path) -> None:
    path = murp_file(tmp_path, 60)
    first, again, other = (murp.read(path, seed).trails[2].odometry for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert np.abs(first - other).max() > 0.01
    truth = murp.read(path).trails[2].truth
    way, true = (np.hypot(*np.diff(p[:, :2], axis=0).T).sum() for p in (first, truth))
    assert way == pytest.approx(true, rel=0.1)


def test_a_murp_name_without_its_robots_is_refused(tmp_path: Path) -> None:
    path = murp_file(tmp_path, 10)
    other = path.rename(tmp_path / "ranges.csv")
    with pytest.raises(BadRecording, match="base-A_targ-B"):
        readers.read(other)


@pytest.mark.skipif(not (DATA / "murp_linktrack").exists(), reason="no MURP recording")
def test_the_murp_recording_has_ranges_and_poses_of_the_same_time() -> None:
    found = readers.read(DATA / "murp_linktrack" / "16_base-2_targ-3_win-1_step-1.csv")
    error = range_errors(found, 2, 3)
    assert np.median(error) == pytest.approx(-0.11, abs=0.01)
    good = np.abs(error - np.median(error)) < 0.3
    rate = np.gradient(found.ranges[:, 3] - error)[good]
    shift = np.polyfit(rate, error[good], 1)[0]
    assert abs(shift) < 0.05
