"""What a robot says of others: how long it holds, and its own way meanwhile."""

from __future__ import annotations

import numpy as np

from drslamd.gossip.message_types import Hypotheses
from drslamd.view.scene.possible_seen import HELD_S, LATE, PossibleSeen


def said(utime: int) -> Hypotheses:
    return Hypotheses(utime, (utime / 1e6, 0.0, 0.5), ())


def test_the_latest_holds_for_three_seconds() -> None:
    seen = PossibleSeen()
    assert seen.latest(10.0) is None
    seen.add(said(1_000_000), 9.0)
    seen.add(said(2_000_000), 10.0)
    held = seen.latest(10.0 + HELD_S - 0.01)
    assert held is not None
    assert held.odom_utime == 2_000_000
    assert seen.latest(10.0 + HELD_S) is None


def test_its_own_poses_come_the_latest_first_and_only_a_few_are_kept() -> None:
    seen = PossibleSeen()
    for k in range(LATE + 2):
        seen.add(said(k * 1_000_000), float(k))
    frames = seen.frames()
    assert [t for t, _ in frames] == [5.0, 4.0, 3.0, 2.0]
    assert np.array_equal(frames[0][1], [5.0, 0.0, 0.5])
