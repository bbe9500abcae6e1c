"""A member that says a hundred times too much costs itself its voice, and nobody else anything."""

from __future__ import annotations

import pytest
from acquainted import introduce
from message_builders import SECOND, a_seal, an_entry, kinds, sealed
from places import Recorded

from drslamd.conventions import Chain
from drslamd.events import ChannelMessage
from drslamd.gossip.membership.flood import AT_ONCE_S, BUDGET, BUDGETS, LEAST_COST, Flood
from drslamd.gossip.team import Team

T0 = 100 * SECOND
REASON = "more than the share of one robot"


@pytest.mark.row("N8")
def test_of_a_member_at_a_hundred_times_its_share_the_others_notice_nothing(
    record_property: Recorded,
) -> None:
    team = introduce(Team(a_seal(1)), Chain(3, 1), Chain(4, 1), utime=T0)
    loud, honest, pose = a_seal(3), a_seal(4), kinds()["POSE"]
    size = len(sealed(a_seal(3), pose)[1])
    each_s = BUDGETS * BUDGET // max(size, LEAST_COST)
    heard = 0
    for second in range(3):
        for k in range(5 * each_s):
            utime = T0 + second * SECOND + k * SECOND // (5 * each_s)
            heard += team.receive(ChannelMessage(utime, *sealed(loud, pose, utime))) is not None
        utime = T0 + (second + 1) * SECOND - 1
        assert team.receive(ChannelMessage(utime, *sealed(honest, pose, utime))) is not None
    assert heard == pytest.approx((AT_ONCE_S + 3) * each_s, rel=0.01)
    assert team.refused[REASON] == 15 * each_s - heard
    record_property(
        "measured", f"of {15 * each_s} messages of one member {heard} are heard, of the others all"
    )
    said = dict(team.conditions(T0 + 3 * SECOND))["team.flood"]
    assert said is not None
    assert said.startswith("robot 3 says more")


def test_log_entries_of_the_past_come_through_others_and_cost_their_owner_nothing() -> None:
    team = introduce(Team(a_seal(1), budget=LEAST_COST // BUDGETS), Chain(3, 1))
    seal = a_seal(3)
    entries = [sealed(seal, an_entry(seq, seq)) for seq in range(20)]
    assert team.receive(ChannelMessage(T0, *entries[-1])) is not None
    assert all(team.receive(ChannelMessage(T0, *entry)) is not None for entry in entries[:-1])
    assert [team.receive(ChannelMessage(T0, *entries[0])) for _ in range(50)] == [None] * 50
    assert team.refused[REASON] == 0
    more = [sealed(seal, an_entry(seq, seq)) for seq in range(20, 60)]
    came = sum(team.receive(ChannelMessage(T0, *entry)) is not None for entry in more)
    assert came == AT_ONCE_S - 1


def test_short_messages_cost_as_much_as_longer_ones() -> None:
    flood = Flood(budget=LEAST_COST // BUDGETS)
    assert [flood.leaves_room(3, 1, T0) for _ in range(5)] == [True] * 4 + [False]
    assert not flood.leaves_room(4, AT_ONCE_S * LEAST_COST + 1, T0)
    assert flood.leaves_room(5, AT_ONCE_S * LEAST_COST, T0)
    said = flood.sentence(T0)
    assert said is not None
    assert said.startswith("robot 3 and 4 ")
