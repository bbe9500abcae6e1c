"""Where peers may be is told until one answer stands: to who asks, on the air only if wanted."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from message_builders import COVARIANCE
from slam_scenes import config
from teams import EASY, VirtualTeam

from drslamd import report
from drslamd.broadcast import Broadcast
from drslamd.conventions import SECOND_US, Chain
from drslamd.gossip import messages
from drslamd.gossip.message_types import MAX_MOTIONS, MAX_PLACES, Hypotheses
from drslamd.gossip.seal import Seal, team_key
from drslamd.gossip.team import Team
from drslamd.slam.hypotheses.deciding_motion import NO_TURN, DecidingMotion
from drslamd.slam.hypotheses.places_left import PlacesLeft, PossiblePlace
from drslamd.slam.odometry.track import Track

ASKED = "[near]\nhypotheses = true\n"


def left_of(peer: int, away_m: float, count: int = 2) -> PlacesLeft:
    places = tuple(
        PossiblePlace(peer, 0, 1 / count, (100.0 + away_m, float(k), 0.0), COVARIANCE)
        for k in range(count)
    )
    return PlacesLeft(places, DecidingMotion(peer, 0, 1.0, (0.5, 1.0), NO_TURN, 1))


class Scene:
    """Robot 0, 100 m ahead of where its odometry began; `left` is what module 1 leaves.

    Attributes:
        solved: robots that module 3 has placed; asked: peers that module 1 was asked about.
    """

    def __init__(self, left: list[PlacesLeft], extra: str = ASKED, solved: tuple[int, ...] = ()):
        self.left, self.asked, track = left, list[int](), Track(100)
        track.append(7, np.array([1e6, 0.0, 0.0]))
        front: Any = SimpleNamespace(
            reckoning=SimpleNamespace(track=track), places_left=self._places_left
        )
        estimate = SimpleNamespace(trajectories=dict.fromkeys(solved)) if solved else None
        back: Any = SimpleNamespace(estimate=estimate, graph=None)
        team = Team(Seal(team_key(None), 0, 1, {}))
        self.broadcast = Broadcast(config(0, extra), team, front, back)

    def _places_left(self, neighbours: list[Any], graph: Any, utime: int) -> list[PlacesLeft]:
        self.asked = [peer.chain.robot for peer in neighbours]
        return [left for left in self.left if left.places[0].peer in self.asked]

    def make(self) -> Hypotheses | None:
        return self.broadcast.make_hypotheses(self.neighbours, SECOND_US)

    @property
    def neighbours(self) -> list[Any]:
        peers = [left.places[0].peer for left in self.left]
        return [SimpleNamespace(chain=Chain(peer, 1)) for peer in peers]


def test_nothing_is_said_unless_it_is_asked_for() -> None:
    quiet, asked = Scene([left_of(1, 3.0)], extra=""), Scene([left_of(1, 3.0)])
    assert quiet.make() == asked.make() is not None
    assert quiet.broadcast.hypotheses(quiet.neighbours, SECOND_US) == []
    (send,) = cast(Any, asked.broadcast.hypotheses(asked.neighbours, SECOND_US))
    assert send.channel == "DRSLAM_HYPOTHESES_000"
    said = messages.decode("HYPOTHESES", send.payload)
    assert isinstance(said, Hypotheses)
    assert said.odom_utime == 700_000
    assert said.odom == (100.0, 0.0, 0.0)
    assert [place.pose for place in said.places] == [(103.0, 0.0, 0.0), (103.0, 1.0, 0.0)]


def test_where_no_places_are_left_nothing_is_said() -> None:
    scene = Scene([])
    assert scene.make() is None
    assert scene.broadcast.hypotheses([], SECOND_US) == []


def test_of_many_peers_the_nearest_have_room() -> None:
    """Four places of each; of the nearest five all are said, of farther ones none."""
    said = Scene([left_of(peer, 10.0 - peer, count=4) for peer in range(1, 9)]).make()
    assert said is not None
    assert len(said.places) == MAX_PLACES
    assert [place.peer for place in said.places[::4]] == [8, 7, 6, 5, 4]
    assert [motion.peer for motion in said.motions] == [8, 7, 6, 5, 4]
    two = Scene([left_of(peer, float(peer), count=2) for peer in range(1, 11)]).make()
    assert two is not None
    assert len(two.motions) == MAX_MOTIONS
    assert [place.peer for place in two.places[::2]] == [motion.peer for motion in two.motions]


@pytest.mark.parametrize(
    ("solved", "asked"), [((), [1, 2]), ((0, 1), [2]), ((1,), [1, 2]), ((0, 1, 2), [])]
)
def test_who_is_placed_by_way_of_others_is_nowhere_else(
    solved: tuple[int, ...], asked: list[int]
) -> None:
    scene = Scene([left_of(1, 3.0), left_of(2, 3.0)], solved=solved)
    scene.make()
    assert scene.asked == asked


def said_by(team: VirtualTeam, robot: int) -> list[tuple[float, Hypotheses]]:
    name = messages.channel("HYPOTHESES", robot)
    sent = team.member(robot).traces.sent
    out = [(t / 1e6, messages.decode("HYPOTHESES", p)) for t, name_, p in sent if name_ == name]
    assert all(isinstance(message, Hypotheses) for _, message in out)
    return cast("list[tuple[float, Hypotheses]]", out)


@pytest.mark.slow
def test_a_team_says_where_peers_may_be_until_it_knows() -> None:
    """Once a second at most, of pairs that are not settled, and status has the same."""
    team, in_status = VirtualTeam(EASY, extra=ASKED), 0
    for second in range(5, 27):
        team.run(float(second))
        robot = team.member(0).robot
        status = report.status(robot, robot.timers.next)
        in_status += bool(status["hypotheses"])
        if robot.back.estimate is not None and len(robot.back.estimate.trajectories) == 3:
            assert status["hypotheses"] == []
    said = said_by(team, 0)
    times = np.array([t for t, _ in said])
    assert len(said) >= 3
    assert in_status >= 3
    assert np.diff(times).min() > 0.9
    assert times.max() < 25
    assert {place.peer for _, message in said for place in message.places} <= {1, 2}
    for _, message in said:
        shares = [place.share for place in message.places if place.peer == 1]
        assert not shares or sum(shares) == pytest.approx(1.0, abs=1e-5)
    # the highest id owns no pair
    assert said_by(team, 2) == []
