"""Where a robot was, as peers have it, and as a file keeps it."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from drslamd.conventions import Chain, Segment
from drslamd.slam.graph.estimate import PoseNow, TeamEstimate, Trajectory
from drslamd.slam.odometry.track import Track
from drslamd.slam.peer_in_range import PeerInRange
from drslamd.slam.relocation.last_place import (
    MOST_PEERS,
    LastPlace,
    SeenFrom,
    is_kept_place,
    last_place,
)

PLACE = LastPlace(0.5, (SeenFrom(Chain(4, 9), 120, 12_300_000, 1.5, -2.0, 0.2),))
ROW = [4, 9, 120, 12_300_000, 1.5, -2.0, 0.2]
NOW = PoseNow(10_000_000, np.array([2.0, 3.0, 0.7]), np.diag([0.01, 0.04, 0.5]))


def peer(robot: int, ahead_us: int | None = 1_000) -> PeerInRange:
    return PeerInRange(Chain(robot, 9), robot, True, Track(10), ahead_us)


def solved(*robots: int, points: frozenset[int] = frozenset()) -> TeamEstimate:
    """All of them stand at (2, 1) and look along y, each a little less sure than the one before."""
    ends = {r: Trajectory(Chain(r, 9), np.array([80, 90]), np.zeros((2, 3))) for r in robots}
    for end in ends.values():
        end.poses[-1] = 2.0, 1.0, np.pi / 2
    variances = [v for k in range(len(robots)) for v in (0.05 + 0.01 * k, 0.01, 0.0)]
    return TeamEstimate(Segment(0, 9, 0), ends, np.diag(variances), points=points)


def test_a_peer_has_us_two_metres_ahead_of_its_last_keyframe() -> None:
    found = last_place(solved(4), NOW, [peer(4)], 0.6)
    assert found is not None
    assert found.speed_mps == 0.6
    (row,) = found.seen
    assert row[:3] == (Chain(4, 9), 90, 10_001_000)
    assert row[3:5] == pytest.approx((2.0, 0.0))
    # the longer axes of both: 0.2^2 of ours, 0.05 of the peer's
    assert row.sigma_m == pytest.approx(0.3)


def test_how_well_a_peer_knows_its_heading_counts_by_how_far_we_are() -> None:
    estimate = solved(4)
    estimate.joint[2, 2] = 0.1**2
    found = last_place(estimate, NOW, [peer(4)], 0.6)
    assert found is not None
    assert found.seen[0].sigma_m == pytest.approx(np.sqrt(0.09 + 0.2**2))


def test_the_surest_peers_are_named_and_no_more_than_four() -> None:
    robots = range(1, MOST_PEERS + 2)
    found = last_place(solved(*robots), NOW, [peer(r) for r in reversed(robots)], 0.6)
    assert found is not None
    assert [row.peer.robot for row in found.seen] == list(robots)[:MOST_PEERS]


@pytest.mark.parametrize(
    ("estimate", "ahead_us"),
    [(solved(5), 0), (solved(4), None), (solved(4, points=frozenset([4])), 0)],
)
def test_who_is_not_solved_or_whose_clock_or_heading_is_unknown_tells_nothing(
    estimate: TeamEstimate, ahead_us: int | None
) -> None:
    assert last_place(estimate, NOW, [peer(4, ahead_us)], 0.6) is None


@pytest.mark.parametrize(("sigma_m", "is_kept"), [(4.9, True), (5.1, False)])
def test_what_is_vague_is_not_kept(sigma_m: float, is_kept: bool) -> None:
    vague = NOW._replace(covariance=np.diag([sigma_m**2 - 0.05, 0.01, 0.1]))
    assert (last_place(solved(4), vague, [peer(4)], 0.6) is not None) is is_kept


def test_a_file_keeps_it_as_it_was() -> None:
    state = json.loads(json.dumps(PLACE.state()))
    assert state == {"speed_mps": 0.5, "seen": [ROW]}
    assert is_kept_place(state)
    assert LastPlace.of_state(state) == PLACE


def test_nothing_kept_is_nothing_known() -> None:
    assert is_kept_place({})
    assert LastPlace.of_state({}) is None


def with_row(at: int, value: Any) -> dict[str, Any]:
    return {"speed_mps": 0.5, "seen": [[*ROW[:at], value, *ROW[at + 1 :]]]}


@pytest.mark.parametrize(
    "state",
    [
        None,
        [],
        {"speed_mps": 0.5},
        {"speed_mps": 0.0, "seen": [ROW]},
        {"speed_mps": 31.0, "seen": [ROW]},
        {"speed_mps": "fast", "seen": [ROW]},
        {"speed_mps": 0.5, "seen": []},
        {"speed_mps": 0.5, "seen": [ROW] * (MOST_PEERS + 1)},
        {"speed_mps": 0.5, "seen": [ROW[:-1]]},
        {"speed_mps": 0.5, "seen": ["4, 9"]},
        with_row(0, 255),
        with_row(0, -1),
        with_row(1, 1.5),
        with_row(2, True),
        with_row(3, 10**400),
        with_row(4, float("nan")),
        with_row(5, 1_000.1),
        with_row(6, 0.0),
        with_row(6, 5.1),
    ],
)
def test_what_nobody_wrote_is_not_read(state: object) -> None:
    assert not is_kept_place(state)


@pytest.mark.parametrize(("at", "value"), [(0, 254), (3, 2**62), (5, -1_000.0), (6, 5.0)])
def test_what_is_just_within_its_bounds_is_read(at: int, value: float) -> None:
    assert is_kept_place(with_row(at, value))
