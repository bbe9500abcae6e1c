"""A robot's card is copied into another while the team drives: nobody is led astray by the two."""

from __future__ import annotations

from dataclasses import replace

import pytest
from teams import EASY, VirtualTeam

from drslamd.gossip import messages
from drslamd.gossip.message_types import PoseState, Status

BEGINS_S, ENDS_S = 30.0, 38.5
SCENE = replace(EASY, seconds=ENDS_S)
KNOWN_BY_S = BEGINS_S + 5.0


def poses_said(sent: list[tuple[int, str, bytes]], since_s: float) -> int:
    kinds = [messages.kind_of_channel(channel) for at, channel, _ in sent if at > since_s * 1e6]
    return kinds.count("POSE")


def states_said(sent: list[tuple[int, str, bytes]], since_s: float) -> set[PoseState]:
    said = [
        messages.decode("STATUS", p) for at, c, p in sent if at > since_s * 1e6 and "STATUS" in c
    ]
    return {status.state for status in said if isinstance(status, Status)}


def closures_with(team: VirtualTeam, at: int, robot: int) -> int:
    """That a robot holds of measurements with another one, of whatever time."""
    graph = team.member(at).robot.back.graph
    return sum(len(data.closures.rows) for pair, data in graph.pairs.items() if robot in pair)


@pytest.mark.slow
@pytest.mark.row("S8")
def test_both_keep_silent_about_their_poses_and_nothing_of_them_comes_into_any_graph() -> None:
    team = VirtualTeam(SCENE)
    team.run(BEGINS_S)
    first = team.member(1)
    assert poses_said(first.traces.sent, BEGINS_S - 5) > 0
    copy = team.start(1, epoch=7)
    team.run(KNOWN_BY_S)
    for twin in (first, copy):
        assert "another robot uses id 1, at robot 1" in "".join(
            twin.robot.health.sentences().values()
        )
    for other in (0, 2):
        assert "two robots use id 1" in team.problems(other)
    held = {other: closures_with(team, other, 1) for other in (0, 2)}
    team.run(ENDS_S)
    for twin in (first, copy):
        assert poses_said(twin.traces.sent, KNOWN_BY_S) == 0
        assert states_said(twin.traces.sent, KNOWN_BY_S) == {PoseState.NOT_LOCALISED}
    assert held == {other: closures_with(team, other, 1) for other in (0, 2)}
    assert poses_said(team.member(0).traces.sent, KNOWN_BY_S) > 0
