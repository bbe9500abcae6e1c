"""What module 2 keeps of a pair between two checks."""

from __future__ import annotations

import numpy as np
import pytest
from pair_scenes import BESIDE, asked_at, estimate_of
from slam_scenes import NOISE, keyframes, wander

from drslamd.conventions import Chain, Segment
from drslamd.slam.consistency.candidates import candidates
from drslamd.slam.consistency.checked import Checked, extended
from drslamd.slam.consistency.pcm import PairConsistency
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.odometry.noise import growth

PATH = wander(np.random.default_rng(3), 20, 0.4)


def chain(robot: int, missing: int | None = None) -> ChainData:
    """A keyframe a second, one of which comes late."""
    data = ChainData(Chain(robot, 1))
    start = PATH - PATH[0]
    for k, (keyframe,) in enumerate(zip(keyframes(range(0, 200, 10), start), strict=True)):
        if k != missing:
            data.add(keyframe)
    return data


@pytest.mark.parametrize("turn", [0.0, -2.0])
def test_sums_are_those_of_the_way_that_was_driven_also_when_a_keyframe_came_late(
    turn: float,
) -> None:
    """Of the mirror image, where the peer turns the other way."""
    corrections = Correction(), Correction(turn=turn)
    own, peer = chain(0, missing=7), chain(1, missing=7)
    work = candidates(0, asked_at(150), estimate_of(BESIDE), own, peer, corrections)
    segments = Segment(0, 1, 0), Segment(1, 1, 0)
    checked = Checked(segments, PairConsistency(NOISE, NOISE, 0.1), [], {})
    checked = extended(checked, work, {0: 9.0})
    own, peer = chain(0), chain(1)
    checked.renew_sums(own, peer, corrections)
    way = corrections[1].path(peer.keyframes.poses)
    assert checked.consistency._columns.b_sums[:, 0] == pytest.approx(growth(way)[15])
    assert checked.consistency._columns.a_sums[:, 0] == pytest.approx(own.sums[15])
