"""Two TurtleBots of the VUB: a tiny file that the test writes, and the real one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab.recordings import readers
from recorded import DATA, range_errors

OF_A_ROBOT = ("gt_x", "gt_y", "gt_z", "gt_yaw", "odo_x", "odo_y", "odo_yaw", "odo_tilt_deg")
VUB_HEADER = ",".join(["t", "uwb_m", *(f"tb{n}_{c}" for n in (2, 3) for c in OF_A_ROBOT)])


def vub_file(folder: Path, metres: list[str]) -> Path:
    rows = [
        f"{1000 + 0.1 * k},{m}," + ",".join(f"{robot}.{k}" for robot in (1, 2) for _ in range(8))
        for k, m in enumerate(metres)
    ]
    path = folder / "exp9_los.csv"
    path.write_text("\n".join([VUB_HEADER, *rows]) + "\n")
    return path


def test_vub_rows_become_trails_of_both_robots_and_ranges_without_repeats(tmp_path: Path) -> None:
    found = readers.read(vub_file(tmp_path, ["4.0", "4.0", "4.1", "4.0"]))
    assert sorted(found.trails) == [2, 3]
    assert found.trails[3].truth[2] == pytest.approx([2.2, 2.2, 2.2], abs=0.1)
    assert found.trails[2].odometry[1] == pytest.approx([1.1, 1.1, 1.1], abs=0.1)
    assert found.ranges[:, 3].tolist() == [4.0, 4.1, 4.0]
    assert found.ranges[:, 1:3].tolist() == [[2, 3]] * 3
    assert np.diff(found.ranges[:, 0]) == pytest.approx([0.2, 0.1])


@pytest.mark.skipif(not (DATA / "vub_two_turtlebots").exists(), reason="no VUB recording")
def test_the_vub_recording_has_the_bias_that_others_measured() -> None:
    found = readers.read(DATA / "vub_two_turtlebots" / "exp4_los.csv")
    assert np.median(range_errors(found, 2, 3)) == pytest.approx(-0.09, abs=0.01)
