"""Ranges to localised peers as circles in the frame of the team."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drslamd.conventions import Chain, Segment
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory
from drslamd.slam.odometry.track import RESOLUTION, Track
from drslamd.slam.range_model import LINKTRACK
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relocation.sightings import Beacon, Own, path_in_team, sightings
from drslamd.slam.robot_model import UNTOLD

PEER = Chain(4, 1)


def peer(first: int = 100, last: int = 150, hole: int | None = None) -> PairEnd:
    """It drives 5 cm along its x in each sample; its clock is a second ahead of ours."""
    track = Track(1_000)
    for n in range(first, last + 1):
        if n != hole:
            track.append(n, np.round(np.array([0.05 * (n - 100), 0.0, 0.0]) / RESOLUTION))
    return PairEnd(track, ChainData(PEER), 1_000_000)


def solved(*n: int) -> TeamEstimate:
    """Turned left by a right angle, at (2, 3) in sample 100."""
    poses = np.array([[2.0, 3.0 + 0.05 * (k - 100), np.pi / 2] for k in n])
    return TeamEstimate(
        Segment(0, 1, 0),
        {4: Trajectory(PEER, np.array(n), poses)},
        bias_m={(0, 4): Learned(0.2, 0.05)},
    )


@pytest.mark.parametrize("n", [(100,), (100, 140), (100, 140, 160)])
def test_a_circle_lies_where_the_peer_was_then(n: tuple[int, ...]) -> None:
    """Keyframes may be ahead of the odometry between them."""
    ranges = RangeBuffer()
    for k in range(120, 130):
        ranges.add((k - 10) * 100_000, 5.0)
    own = Own(0, UNTOLD, 0.1, LINKTRACK)
    seen = sightings([Beacon(peer(), ranges)], solved(*n), own, 10_950_000, 11_250_000)
    assert len(seen) >= 1
    expected = 3.0 + 0.05 * (seen.utime / 1e5 + 10 - 100)
    assert seen.place[:, 0] == pytest.approx(2.0)
    assert seen.place[:, 1] == pytest.approx(expected)
    assert seen.range_m == pytest.approx(4.8)
    assert (seen.utime > 10_950_000).all()
    assert (seen.utime <= 11_250_000).all()


def test_what_strong_signals_add_goes_by_the_distance() -> None:
    """Of 1.5 m 1 m is bias and a part of 0.3 m near-range bias."""
    ranges = RangeBuffer()
    for k in range(120, 130):
        ranges.add((k - 10) * 100_000, 1.5)
    known: dict[str, Any] = {
        "bias_m": {(0, 4): Learned(1.0, 0.05)},
        "near_bias_m": Learned(0.3, 0.05),
    }
    own, beacon = Own(0, UNTOLD, 0.1, LINKTRACK), Beacon(peer(), ranges)
    seen = sightings([beacon], replace(solved(100), **known), own, 10_950_000, 11_250_000)
    distance = 0.5
    for _ in range(60):
        distance = 0.5 - 0.3 * math.exp(-distance / LINKTRACK.near_reach_m)
    assert seen.range_m == pytest.approx(distance, abs=0.003)


def test_a_peer_with_a_hole_of_its_own_since_is_none() -> None:
    assert path_in_team(peer(hole=120), solved(110)) is None
    assert path_in_team(peer(hole=120), solved(130)) is not None


def test_a_peer_that_was_not_solved_is_none() -> None:
    assert path_in_team(peer(), TeamEstimate(Segment(0, 1, 0), {})) is None
