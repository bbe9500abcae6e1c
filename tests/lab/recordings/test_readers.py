"""Every reader on a tiny file that the test writes, and on the real one where it exists."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from lab.recordings import murp, readers, recording, swust
from lab.recordings.recording import BadRecording, Recording
from lab.score import metrics
from places import SHARED
from scipy.io import savemat

DATA = SHARED / "data"


def range_errors(found: Recording, a: int, b: int) -> recording.Array:
    """Measured minus true distance of one pair, antenna to antenna."""
    rows = found.ranges[(found.ranges[:, 1] == a) & (found.ranges[:, 2] == b)]
    ends = []
    for robot in (a, b):
        trail = found.trails[robot]
        pose = metrics.at_times(trail.t, trail.truth, rows[:, 0])
        antenna = np.array([*found.antennas.get(robot, (0.0, 0.0)), 0.0])
        ends.append(metrics.compose(pose, antenna))
    return np.asarray(rows[:, 3] - np.hypot(*(ends[1] - ends[0])[:, :2].T))


# ---- VUB ----

VUB_HEADER = "t,uwb_m," + ",".join(
    f"tb{n}_{c}" for n in (2, 3)
    for c in ("gt_x", "gt_y", "gt_z", "gt_yaw", "odo_x", "odo_y", "odo_yaw", "odo_tilt_deg")
)  # fmt: skip


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


def test_a_csv_cell_that_is_no_number_is_named_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(BadRecording, match="line 3"):
        readers.read(vub_file(tmp_path, ["4.0", "four", "4.1"]))


def test_a_csv_row_that_is_too_short_is_named_with_its_line(tmp_path: Path) -> None:
    path = vub_file(tmp_path, ["4.0", "4.1"])
    path.write_text(path.read_text() + "1,2\n")
    with pytest.raises(BadRecording, match="line 4: 2 cells"):
        readers.read(path)


@pytest.mark.skipif(not (DATA / "vub_two_turtlebots").exists(), reason="no VUB recording")
def test_the_vub_recording_has_the_bias_that_others_measured() -> None:
    found = readers.read(DATA / "vub_two_turtlebots" / "exp4_los.csv")
    assert np.median(range_errors(found, 2, 3)) == pytest.approx(-0.09, abs=0.01)


# ---- MURP ----


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


# ---- range_only_CL ----


def mat_file(folder: Path) -> Path:
    robots = []
    for number in (1, 4):
        t = np.arange(0, 10, 0.05)
        slam = np.arange(0, 10, 0.5)
        robots.append({
            "id": number, "t_m": t, "v_m": np.full(len(t), 0.2), "omega_m": np.zeros(len(t)),
            "t": slam, "x": 0.2 * slam, "y": np.full(len(slam), number), "phi": np.zeros(len(slam)),
        })  # fmt: skip
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


# ---- SWUST ----


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
    poses = [
        np.array([
            metrics.at_times(trail.t, trail.truth, np.array([edge[0]]))[0]
            for edge in found.edges
            for trail in [found.trails[int(edge[end])]]
        ])
        for end in (1, 2)
    ]  # fmt: skip
    error = found.edges[:, 3:] - metrics.relative(*poses)
    metres, radians = swust.SIGMAS
    assert 0.5 * metres < np.sqrt(np.mean(error[:, :2] ** 2)) < metres
    assert 0.5 * radians < np.sqrt(np.mean(metrics.wrapped(error[:, 2]) ** 2)) < radians
