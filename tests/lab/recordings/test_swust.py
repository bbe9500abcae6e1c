"""SWUST: odometry and relative poses, made up and real."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lab.recordings import readers, swust
from lab.recordings.recording import Array, BadRecording
from lab.score import metrics
from recorded import DATA


def swust_folder(folder: Path) -> Path:
    for n in (1, 2):
        odometry = [f"drone{n}\t{100 + k / 50}\t{5 + k / 100}\t{n}\t3.1" for k in range(300)]
        truth = [f"drone{n}\t{20 + 80 * (k > 0) + k}\t{5 + k / 2}\t{n}\t0" for k in range(6)]
        (folder / f"drone{n}_odom.txt").write_text("\n".join(odometry) + "\n")
        (folder / f"gt_{n}_interpolation.txt").write_text("\n".join(truth) + "\n")
    edges = [f"drone1\tdrone2\t{t}\t0.0\t1.0\t0.1" for t in (50.0, 102.0, 103.0, 190.0)]
    (folder / "params_estimate_1_2.txt").write_text("\n".join(edges) + "\n")
    return folder


def test_swust_odometry_starts_at_zero_and_edges_lie_inside_of_it(tmp_path: Path) -> None:
    found = readers.read_edges(swust_folder(tmp_path))
    trail = found.trails[1]
    assert trail.odometry[0] == pytest.approx([0, 0, 0])
    # the robot's odometry said yaw 3.1 all the way, so in its own frame it goes backwards
    assert trail.odometry[-1, 0] < 0
    assert np.diff(found.edges[:, 0]) == pytest.approx([1.0])
    assert found.edges[:, 1:].tolist() == [[1.0, 2.0, 0.0, 1.0, 0.1]] * 2


def test_a_folder_without_edges_is_no_recording_of_edges(tmp_path: Path) -> None:
    assert not readers.has_edges(tmp_path)
    with pytest.raises(BadRecording, match="params_estimate"):
        readers.read_edges(tmp_path)
    assert readers.has_edges(swust_folder(tmp_path))


@pytest.mark.skipif(not (DATA / "swust_three_robots").exists(), reason="no SWUST recording")
def test_the_swust_edges_are_as_good_as_their_sigmas_say() -> None:
    found = readers.read_edges(DATA / "swust_three_robots")

    def true_poses(end: int) -> Array:
        trails = [found.trails[robot] for robot in found.edges[:, end].astype(int).tolist()]
        at = zip(trails, found.edges[:, :1], strict=True)
        return np.concatenate([metrics.at_times(x.t, x.truth, t) for x, t in at])

    poses = true_poses(1), true_poses(2)
    error = found.edges[:, 3:] - metrics.relative(*poses)
    metres, radians = swust.SIGMAS
    assert 0.5 * metres < np.sqrt(np.mean(error[:, :2] ** 2)) < metres
    assert 0.5 * radians < np.sqrt(np.mean(metrics.wrapped(error[:, 2]) ** 2)) < radians
