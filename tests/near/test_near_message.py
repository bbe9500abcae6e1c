"""What is told, there and back, and what no robot can have said."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from near_scenes import NEAR, PEERS

from drslamd import lcmtypes
from drslamd.gossip import lc02, messages
from drslamd.gossip.seal import VERSION, Header
from drslamd.near import near_message
from drslamd.near.near_message import MOST_ON_AIR, NOBODY, Near, Neighbours, near_channel
from drslamd.slam import se2

HEADER = Header(VERSION, 3, 7, 0, 5_000_001)


def crowd(count: int) -> Neighbours:
    """The farthest first."""
    away = np.array([[float(count - k), 0.0, 0.0] for k in range(count)])
    rows = tuple(range(count))
    known = np.ones((6, count))
    states = (PEERS.states[0],) * count
    return Neighbours(rows, states, rows, rows, away, known, (0.0,) * count, (0.0,) * count)


def back(near: Near) -> Near:
    found = near_message.decode(near_message.encode(HEADER, near))
    assert isinstance(found, Near), found
    return found


def test_what_is_read_is_what_was_told() -> None:
    found = back(NEAR)
    assert replace(found, peers=NOBODY) == replace(NEAR, peers=NOBODY)
    assert found.peers.robots == PEERS.robots
    assert found.peers.states == PEERS.states
    assert found.peers.utimes == PEERS.utimes
    assert found.peers.uncertainties == PEERS.uncertainties
    assert np.array_equal(found.peers.a_T_b, PEERS.a_T_b)
    assert np.array_equal(found.peers.covariance, PEERS.covariance)
    assert (found.peers.speeds, found.peers.turn_rates) == (PEERS.speeds, PEERS.turn_rates)
    assert len(back(replace(NEAR, peers=NOBODY)).peers) == 0


def test_the_pose_in_the_team_is_the_product_of_both_frames() -> None:
    expected = se2.compose(np.array(NEAR.correction), np.array(NEAR.odom))
    assert np.allclose(NEAR.pose, expected)


def test_on_lcm_the_nearest_have_room_in_one_datagram() -> None:
    near = replace(NEAR, peers=crowd(254)).on_air()
    assert near.peers.robots == tuple(range(254 - MOST_ON_AIR, 254))
    assert len(near_message.encode(HEADER, near)) == 1_340 <= lc02.MAX_PAYLOAD
    assert replace(NEAR, peers=crowd(MOST_ON_AIR)).on_air().peers.robots == tuple(range(20))


@pytest.mark.parametrize(
    "wrong",
    [
        {"odom": (math.nan, 0.0, 0.0)},
        {"correction": (1e9, 0.0, 0.0)},
        {"speed_mps": math.inf},
        {"covariance": (-1.0, 0.0, 0.0, 1.0, 0.0, 1.0)},
        {"covariance": (math.nan, 0.0, 0.0, 1.0, 0.0, 1.0)},
        {"state": 5},
        {"frame": 255},
        {"utime": -1},
        {"resets": -1},
        {"utc_minus_clock_us": 2**60},
        {"utc_uncertainty_us": -2},
        {"peers": replace(PEERS, robots=(1, 255))},
        {"peers": replace(PEERS, covariance=-PEERS.covariance)},
        {"peers": replace(PEERS, a_T_b=np.full((2, 3), math.nan))},
    ],
    ids=str,
)
def test_what_no_robot_can_have_said_is_one_phrase(wrong: dict[str, Any]) -> None:
    assert isinstance(near_message.decode(near_message.encode(HEADER, replace(NEAR, **wrong))), str)


def test_bytes_that_are_none_of_ours_are_one_phrase() -> None:
    payload = near_message.encode(HEADER, NEAR)
    assert near_message.decode(payload + b"\0") == "bytes left over"
    for end in (0, 8, 60, len(payload) - 1):
        assert isinstance(near_message.decode(payload[:end]), str)


def test_robots_do_not_listen_to_it() -> None:
    assert near_channel(3) == "DRSLAM_NEAR_003"
    assert messages.kind_of_channel(near_channel(3)) is None


@pytest.mark.parametrize("peers", [0, 1, 30])
def test_the_bytes_are_those_that_lcm_itself_makes(peers: int) -> None:
    """Who is told fifty times a second packs them at once; LCM goes field by field."""
    told = replace(NEAR, peers=crowd(peers) if peers else NOBODY)
    payload = near_message.encode(HEADER, told)
    decoded = lcmtypes.near_t.decode(payload)
    assert decoded.n == len(told.peers)
    assert decoded.encode() == payload
