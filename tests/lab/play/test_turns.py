"""Robots that take turns over an air that loses, delays and reorders."""

from __future__ import annotations

import numpy as np
import pytest
from lab.play.turns import TICK_US, TICKS, Air, Turns

from drslamd.conventions import Chain, Segment
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.optimizer.contract import Job
from drslamd.slam.optimizer.rbcd.pose_exchange import PoseExchange


class Speaker:
    """Moves each time that it is asked to, says its number, and notes when it heard what."""

    def __init__(self, robot: int, moves: int) -> None:
        self.exchange = PoseExchange(Chain(robot, 1))
        self.begun: list[int] = []
        self.ended: list[int] = []
        self.heard: list[tuple[int, int]] = []
        self._left = moves

    def begin(self, utime: int) -> Job | None:
        if not self._left:
            return None
        self._left -= 1
        self.begun.append(utime)
        return lambda: TeamEstimate(Segment(0, 1, 0), {})

    def on_solution(self, result: TeamEstimate, utime: int) -> list[PublicPoses]:
        self.ended.append(utime)
        values = np.ones((2, 2), dtype=complex)
        return [PublicPoses(0, 1, 1, (10,), values, round=len(self.ended))]

    def hear(self, origin: Chain, message: PublicPoses) -> None:
        self.heard.append((origin.robot, message.round))


def played(rounds: int, air: Air, moves: int = 100) -> tuple[dict[int, Speaker], Turns]:
    team = {robot: Speaker(robot, moves) for robot in range(3)}
    turns = Turns(team, air, seed=1)
    for _ in range(rounds):
        turns.round()
    return team, turns


def test_in_a_round_each_robot_moves_once_at_its_own_time() -> None:
    team, turns = played(4, Air())
    assert turns.moves == 12
    for speaker in team.values():
        assert np.diff(speaker.begun).tolist() == [TICKS * TICK_US] * 3
        assert speaker.begun == speaker.ended
    assert len({speaker.begun[0] for speaker in team.values()}) == 3


def test_all_others_hear_what_is_said_and_it_is_counted_once() -> None:
    team, turns = played(4, Air())
    for robot, speaker in team.items():
        others = sorted(team.keys() - {robot})
        assert sorted(speaker.heard) == [(other, k) for other in others for k in range(1, 5)]
    # each message: LCM's 8 bytes and its channel, 80 of frame, the anchor's 16 and a pose's 20
    assert turns.bytes_sent == 12 * (8 + len("DRSLAM_PUBLIC_000") + 1 + 80 + 16 + 20)


@pytest.mark.parametrize("loss", [0.3, 0.7])
def test_each_receiver_misses_its_share_by_itself(loss: float) -> None:
    team, _ = played(300, Air(loss=loss), moves=300)
    for speaker in team.values():
        assert len(speaker.heard) == pytest.approx(600 * (1 - loss), abs=60)


def test_what_is_late_may_come_in_another_order() -> None:
    team, turns = played(300, Air(latest=3 * TICKS), moves=300)
    while turns.round():
        pass
    for speaker in team.values():
        assert len(speaker.heard) == 600
        moves = [move for robot, move in speaker.heard if robot == min(r for r, _ in speaker.heard)]
        assert moves != sorted(moves)


def test_a_move_takes_its_time_and_no_other_one_begins_meanwhile() -> None:
    team, _ = played(6, Air(takes=TICKS + 10))
    for speaker in team.values():
        assert len(speaker.begun) == 3
        took = np.array(speaker.ended) - speaker.begun[: len(speaker.ended)]
        assert (took == (TICKS + 10) * TICK_US).all()


def test_it_goes_on_until_nobody_moves_and_nothing_is_on_its_way() -> None:
    team, turns = played(0, Air(latest=4 * TICKS), moves=2)
    rounds = 0
    while turns.round():
        rounds += 1
    assert 2 <= rounds <= 7
    assert all(len(speaker.heard) == 4 for speaker in team.values())
