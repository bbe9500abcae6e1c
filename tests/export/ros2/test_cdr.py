"""Bytes of messages: as worked out by hand, and as rosbags writes the same messages."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from drslamd.export.ros2.cdr import serialised
from drslamd.export.ros2.definitions import TYPES, schema_name

THEIRS = get_typestore(Stores.ROS2_HUMBLE)


def test_a_header_is_these_bytes() -> None:
    said = {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "ab"}
    assert serialised("std_msgs/Header", said) == bytes.fromhex(
        "00010000 01000000 02000000 03000000 616200".replace(" ", "")
    )


def test_numbers_stand_at_multiples_of_their_size() -> None:
    """A string of two bytes and its zero end at 15, the doubles begin at 16."""
    vector = {"x": 1.0, "y": 0.0, "z": 0.0}
    turn = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    said = {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "ab"},
        "pose": {"position": vector, "orientation": turn},
    }
    data = serialised("geometry_msgs/PoseStamped", said)
    assert data[4:][15] == 0
    assert data[4:][16:24] == bytes.fromhex("000000000000f03f")
    assert len(data) == 4 + 16 + 7 * 8


def example(name: str, rng: np.random.Generator) -> dict[str, Any]:
    """A message with something in every field."""
    return {field: _example(kind, rng) for kind, field in TYPES[name]}


def _example(kind: str, rng: np.random.Generator) -> Any:
    inner, is_list, length = kind.partition("[")
    if is_list:
        count = int(rng.integers(0, 4)) if length == "]" else int(length[:-1])
        return [_example(inner, rng) for _ in range(count)]
    if inner == "string":
        return "ä" * int(rng.integers(0, 6))
    if inner == "float64":
        return float(rng.normal())
    if inner in ("byte", "int32", "uint32"):
        return int(rng.integers(0, 100))
    return example(inner, rng)


def theirs(name: str, said: dict[str, Any]) -> Any:
    """The same message as rosbags has it."""
    values = {}
    for kind, field in TYPES[name]:
        inner, is_list, _ = kind.partition("[")
        value = said[field]
        if inner in TYPES:
            value = [theirs(inner, v) for v in value] if is_list else theirs(inner, value)
        elif is_list:
            value = np.array(value, dtype=np.float64)
        values[field] = value
    return SimpleNamespace(**values)


@pytest.mark.parametrize("name", list(TYPES))
@pytest.mark.parametrize("seed", range(5))
def test_rosbags_writes_the_same_bytes(name: str, seed: int) -> None:
    said = example(name, np.random.default_rng(seed))
    other = bytes(THEIRS.serialize_cdr(theirs(name, said), schema_name(name)))
    ours = serialised(name, said)
    # the other one may fill up to a whole word
    assert other.rstrip(b"\x00") == ours.rstrip(b"\x00")
    assert 0 <= len(other) - len(ours) < 8


def test_an_array_of_another_length_is_a_bug() -> None:
    pose = {
        "position": {"x": 0.0, "y": 0.0, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    }
    for count, fits in ((36, True), (35, False), (37, False)):
        said = {"pose": pose, "covariance": [0.0] * count}
        if fits:
            assert len(serialised("geometry_msgs/PoseWithCovariance", said)) == 4 + 8 * 43
        else:
            with pytest.raises(ValueError, match=f"covariance has {count} elements, not 36"):
                serialised("geometry_msgs/PoseWithCovariance", said)
