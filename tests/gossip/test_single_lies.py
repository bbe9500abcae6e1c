"""One false message under the seal of a robot, whatever it says: soon everybody hears everybody.

It is what a stranger can send to a team without a key, and a member to one with a key.
"""

from __future__ import annotations

import pytest
from borders import BORDERS, LIAR, Lie, borders_are_complete, lies, sampled, spoken
from message_builders import SECOND, SECRET, a_seal, a_status, forged

from drslamd.conventions import Chain
from drslamd.events import ChannelMessage, Send
from drslamd.gossip.message_types import Received
from drslamd.gossip.seal import Seal
from drslamd.gossip.team import Team
from drslamd.slam.graph.measurements import GraphEntry, Keyframe
from drslamd.slam.robot_model import UNTOLD

STEP = SECOND // 5
AFTER_S = 12
"""Three seconds of patience, two to be sure, a second until the robot begins again, and as long
until it is heard."""


class Trio:
    """Three robots in conversation, each of which begins again when it is told to."""

    def __init__(self) -> None:
        self.utime = 100 * SECOND
        self.teams = {robot: Team(a_seal(robot)) for robot in range(3)}
        self.heard: set[tuple[int, Chain, int]] = set()
        """Who has which entry of whom."""
        self.said: dict[int, tuple[Chain, int]] = {}
        self.restarts = 0

    def run(self, seconds: int) -> None:
        for _ in range(seconds * SECOND // STEP):
            self.utime += STEP
            for robot, team in list(self.teams.items()):
                for send in team.repeats(self.utime):
                    self.carry(robot, send)
                if self.utime // STEP % 5 == robot:
                    self.second(robot, team)

    def second(self, robot: int, team: Team) -> None:
        """What comes round once a second."""
        status = a_status(team.next_heard(self.utime), team.logs.next_states())
        self.carry(robot, team.send(status, self.utime))
        n = self.utime // 100_000
        for entry in team.entries(UNTOLD, (Keyframe(n, 0, n, 0, 0),), (), ()):
            own, sealed = team.append(entry, self.utime)
            self.said[robot] = team.own, own.seq
            self.carry(robot, team.send_sealed(robot, sealed))
        if team.superseded_by is not None:
            self.restarts += 1
            above = team.superseded_by
            seal = Seal(team.seal._key, robot, above + 1, team.seal.epochs)
            self.teams[robot] = Team(seal)

    def carry(self, sender: int, send: Send) -> None:
        for robot, team in self.teams.items():
            if robot != sender:
                self.tell(robot, team, ChannelMessage(self.utime, send.channel, send.payload))

    def tell(self, robot: int, team: Team, event: ChannelMessage) -> None:
        received = team.receive(event)
        if isinstance(received, Received) and isinstance(received.message, GraphEntry):
            self.heard.add((robot, received.origin, received.message.seq))

    def lie(self, lie: Lie, to: tuple[int, ...]) -> None:
        for robot in to:
            self.tell(robot, self.teams[robot], ChannelMessage(self.utime, *lie[1:]))

    def is_well(self) -> bool:
        """Does everybody hear everybody, and has what everybody said last?"""
        now = self.utime
        hear = all(len(team.living(now)) == 2 for team in self.teams.values())
        return hear and all(
            (robot, *self.said[other]) in self.heard
            for robot in self.teams
            for other in self.teams
            if robot != other
        )


def everything() -> list[Lie]:
    header, like = spoken()
    return list(lies(header, SECRET, like))


def muted_by(told: list[Lie], to: tuple[int, ...]) -> list[str]:
    """Which of these lies, each told to a team of its own, keep anybody from being heard."""
    out = []
    for lie in told:
        trio = Trio()
        trio.run(4)
        trio.lie(lie, to)
        trio.run(AFTER_S)
        if not trio.is_well():
            out.append(lie[0])
    return out


def test_every_number_of_every_message_is_lied_about() -> None:
    assert borders_are_complete()
    names = [name for name, _, _ in everything()]
    assert len(names) > 700
    for number in ("STATUS heard.0.epoch", "GRAPH closures.0.b_n", "PUBLIC values.23"):
        assert sum(name.startswith(number) for name in names) == len(
            BORDERS["float" if "values" in number else "int32_t" if "b_n" in number else "int64_t"]
        )


def test_a_trio_that_nobody_lies_to_is_well_and_nobody_begins_again() -> None:
    trio = Trio()
    trio.run(4 + AFTER_S)
    assert trio.is_well()
    assert trio.restarts == 0


def test_a_robot_that_is_not_heard_is_not_well() -> None:
    """The other tests rest on it."""
    trio = Trio()
    trio.run(4)
    trio.teams[0].seal.epochs[1] = 2**62 + 1
    trio.run(AFTER_S)
    assert not trio.is_well()


@pytest.mark.row("S9")
@pytest.mark.parametrize("to", [(0, 1), (0,), (2,)], ids=["both", "one", "itself"])
def test_no_single_lie_mutes_anybody(to: tuple[int, ...]) -> None:
    header, like = spoken()
    assert muted_by(sampled(lies(header, SECRET, like), 40, seed=len(to)), to) == []


@pytest.mark.slow
@pytest.mark.parametrize("to", [(0, 1), (0,), (2,)], ids=["both", "one", "itself"])
def test_none_of_all_single_lies_mutes_anybody(to: tuple[int, ...]) -> None:
    assert muted_by(everything(), to) == []


@pytest.mark.parametrize(
    "epoch", [2, 10**15, 2**53, 2**53 + 2**32, 2**53 + 2**32 + 1, 2**62, 2**63 - 1]
)
def test_a_robot_under_whose_id_a_later_start_spoke_while_it_was_silent_is_heard_again(
    epoch: int,
) -> None:
    """The lie is believed; then the robot begins again above it."""
    trio = Trio()
    trio.run(4)
    silent = trio.teams.pop(LIAR)
    trio.run(4)
    _, like = spoken()
    told = forged(like["POSE"], robot=LIAR, epoch=epoch, counter=2**31 - 1, utime=SECOND)
    trio.lie(("a later start", *told), (0,))
    trio.teams[LIAR] = silent
    trio.run(AFTER_S)
    assert trio.is_well()
    assert trio.restarts == (epoch <= 2**53 + 2**32)
