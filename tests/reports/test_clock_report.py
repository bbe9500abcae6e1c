"""Whose clock is known, from whom, and how well."""

from __future__ import annotations

import pytest
from message_builders import a_status
from robot_scenes import RobotScene

from drslamd.conventions import GRID_US, Chain
from drslamd.gossip.message_types import Heard
from drslamd.gossip.peer_clock import ONE_WAY_UNCERTAINTY_US
from drslamd.reports.clock_report import MEASURED_US, clock
from drslamd.slam.graph.measurements import GraphEntry, Keyframe, RangeMeasurement

PEER = Chain(1, 1)


def test_our_own_clock_is_ours() -> None:
    scene = RobotScene()
    assert clock(scene.robot, scene.robot.own, 77) == {"source": "own", "readings": [[77, 0, 0]]}


def test_a_peer_that_hears_us_is_known_by_messages_over_all_the_time() -> None:
    scene = RobotScene()
    for _ in range(3):
        scene.later(10)
        scene.hear(1, a_status((Heard(0, 1, 4_000),), uwb_id=1))
    found = clock(scene.robot, PEER, scene.utime)
    assert found["source"] == "messages"
    # it sees our messages 4 ms later than they are sent, and we see its at once
    assert [row[1] for row in found["readings"]] == [2_000] * 3
    assert [
        b[0] - a[0] for a, b in zip(found["readings"], found["readings"][1:], strict=False)
    ] == [
        10_000_000,
        10_000_000,
    ]


def test_a_peer_that_does_not_hear_us_is_known_one_way() -> None:
    scene = RobotScene()
    scene.hear(1, a_status())
    found = clock(scene.robot, PEER, scene.utime)
    assert found["source"] == "one way"
    assert found["readings"] == [[scene.utime, 0, ONE_WAY_UNCERTAINTY_US]]


def told(scene: RobotScene, peer: Chain, shift: int) -> None:
    """Both say keyframes, and we a range between them; its clock is ahead by so many samples."""
    back, own = scene.robot.back, scene.robot.own
    keyframes = tuple(Keyframe(n, 0, 0, 0, 0) for n in (1_000, 1_010))
    theirs = tuple(Keyframe(k.n + shift, 0, 0, 0, 0) for k in keyframes)
    back.insert(peer, GraphEntry(0, keyframes=theirs))
    at = (0.0, 0.0)
    ranges = tuple(RangeMeasurement(k.n, peer, k.n + shift, at, at, 5.0, 0.1) for k in keyframes)
    back.insert(own, GraphEntry(0, keyframes=keyframes, ranges=ranges))
    back.looked_at = back.graph.view


def test_a_robot_that_is_no_longer_heard_is_known_by_what_was_measured() -> None:
    scene = RobotScene()
    told(scene, PEER, 5_000)
    assert clock(scene.robot, PEER, 9) == {
        "source": "measurements",
        "readings": [[9, 5_000 * GRID_US, MEASURED_US]],
    }


@pytest.mark.parametrize("chain", [Chain(1, 7), Chain(4, 1)])
def test_of_another_start_and_of_strangers_nothing_is_known(chain: Chain) -> None:
    scene = RobotScene()
    told(scene, PEER, 5_000)
    assert clock(scene.robot, chain, 9) == {"source": "unknown", "readings": []}


def test_a_later_start_of_a_peer_says_nothing_of_its_earlier_clock() -> None:
    scene = RobotScene()
    scene.meet(1)
    assert clock(scene.robot, Chain(1, 2), 9)["source"] == "unknown"
