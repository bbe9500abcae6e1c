"""range_only_CL: two robots and standing nodes, made up and real."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab.recordings import readers
from lab.recordings.recording import BadRecording
from recorded import DATA, range_errors
from scipy.io import savemat


def mat_file(folder: Path) -> Path:
    robots = []
    for number in (1, 4):
        t = np.arange(0, 10, 0.05)
        slam = np.arange(0, 10, 0.5)
        wheels = {"t_m": t, "v_m": np.full(len(t), 0.2), "omega_m": np.zeros(len(t))}
        place = {"x": 0.2 * slam, "y": np.full(len(slam), number), "phi": np.zeros(len(slam))}
        robots.append({"id": number, **wheels, "t": slam, **place})
    ranges = [
        {"pair": pair, "t": np.array([1.0, 2.0]), "range": np.array([2.4, 2.5])}
        for pair in ([1, 4], [0, 4], [0, 2])
    ]
    path = folder / "data.mat"
    savemat(path, {"robot": robots, "range_m": ranges})
    return path


def test_range_only_speeds_become_odometry_and_standing_nodes_measure_nothing(
    tmp_path: Path,
) -> None:
    found = readers.read(mat_file(tmp_path))
    trail = found.trails[4]
    assert trail.t[-1] - trail.t[0] == pytest.approx(9.5)
    way = trail.odometry[-1] - trail.odometry[0]
    assert way == pytest.approx([1.9, 0.0, 0.0])
    assert trail.truth[-1] == pytest.approx([1.9, 4.0, 0.0])
    assert sorted(map(tuple, found.ranges[:, 1:3].tolist())) == [(1, 4), (1, 4), (4, 0), (4, 0)]


def test_a_mat_file_of_something_else_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "data.mat"
    savemat(path, {"speed": [1.0]})
    with pytest.raises(BadRecording, match=r"data\.mat"):
        readers.read(path)


@pytest.mark.skipif(not (DATA / "range_only_cl").exists(), reason="no range_only_CL recording")
def test_the_range_only_recording_has_the_bias_that_others_measured() -> None:
    found = readers.read(DATA / "range_only_cl" / "data190313.mat")
    assert -0.65 < np.median(range_errors(found, 1, 4)) < -0.54
