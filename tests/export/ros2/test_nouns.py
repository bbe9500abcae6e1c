"""Planar poses as ROS has them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drslamd.export.ros2 import nouns


def test_a_stamp_keeps_its_microseconds() -> None:
    assert nouns.header(1_790_000_000_000_001, "odom") == {
        "stamp": {"sec": 1_790_000_000, "nanosec": 1_000},
        "frame_id": "odom",
    }


@pytest.mark.parametrize("theta", [0.0, 1.0, -2.5, math.pi])
def test_a_turn_is_one_about_the_vertical(theta: float) -> None:
    q = nouns.pose((1.0, -2.0, theta))["orientation"]
    by_scipy = Rotation.from_euler("z", theta).as_quat()
    assert abs(np.dot([q[k] for k in "xyzw"], by_scipy)) == pytest.approx(1)


def test_a_covariance_has_x_y_and_yaw_in_their_places() -> None:
    square = np.reshape(nouns.covariance((1, 2, 3, 4, 5, 6)), (6, 6))
    assert square[np.ix_([0, 1, 5], [0, 1, 5])].tolist() == [[1, 2, 3], [2, 4, 5], [3, 5, 6]]
    assert square.sum() == 1 + 4 + 6 + 2 * (2 + 3 + 5)
    assert nouns.covariance(None) == [0.0] * 36


def test_a_transform_says_where_the_child_is() -> None:
    said = nouns.transform(0, "a", "b", (1.0, 2.0, 0.0))
    assert (said["header"]["frame_id"], said["child_frame_id"]) == ("a", "b")
    assert said["transform"]["translation"] == {"x": 1.0, "y": 2.0, "z": 0.0}


def test_odometry_drives_along_x_and_turns_about_z() -> None:
    said = nouns.odometry(0, "odom", "base_link", np.array([1.0, 2.0, 3.0]), 0.5, -0.1)
    twist = said["twist"]["twist"]
    assert (twist["linear"]["x"], twist["angular"]["z"]) == (0.5, -0.1)
    assert sum(twist["linear"].values()) + sum(twist["angular"].values()) == pytest.approx(0.4)
