"""Teams that fell apart, lost robots or got new ones: how soon all hold the same, and how quietly.

The conversations and figures are those of `lab.healing`, which plays longer cases too.
"""

from __future__ import annotations

import pytest
from lab.healing import Case, Conversation, heal, joined, parted, restarted
from places import Recorded

from drslamd.conventions import Chain
from drslamd.slam.graph.chapters.books import LEVELS

SPAN = LEVELS[0].entries


@pytest.mark.row("N6")
@pytest.mark.parametrize(
    ("fault", "seconds"), [(parted(1, 2), 15), (joined(1), 15), (restarted(1), 15)]
)
def test_a_small_team_heals_soon_and_quietly(
    fault: object, seconds: int, record_property: Recorded
) -> None:
    found = heal(Conversation(4, seed=2), fault, 60)  # type: ignore[arg-type]
    assert found.seconds is not None
    assert found.seconds <= seconds
    assert found.peak < 2.05
    assert found.graphs == 1
    record_property("measured", f"healed in {found.seconds} s, busiest second {found.peak:.2f} x")


def test_a_newcomer_gets_chapters_and_not_the_whole_log() -> None:
    talk = Conversation(2, seed=1)
    talk.seconds(2 * SPAN)
    said = sum(talk.bytes)
    talk.join(2)
    before = sum(talk.bytes)
    while not talk.is_healed():
        talk.seconds(1)
        assert sum(talk.bytes) - before < said / 4
    log = talk.mates[2].team.logs._logs[0]
    assert len(log.sealed) < SPAN < 2 * SPAN < log.end
    talk.settle()
    assert len(talk.digests()) == 1


@pytest.mark.slow
@pytest.mark.row("N6")
def test_a_newcomer_to_a_team_with_twenty_minutes_behind_it_has_its_graph_within_half_a_minute(
    record_property: Recorded,
) -> None:
    found = Case("newcomer", 5, 0.0, joined(0), 30, remembered=20).play(seed=1, limit=60)
    assert found.seconds is not None
    assert found.seconds <= 30
    assert found.peak < 2.1
    assert found.graphs == 1
    record_property("measured", f"healed in {found.seconds} s, busiest second {found.peak:.2f} x")


def test_what_a_team_remembers_was_never_on_the_air_and_nobody_lacks_any_of_it() -> None:
    talk = Conversation(3, seed=1)
    talk.remember(1)
    assert sum(talk.bytes) == 0
    for mate in talk.mates.values():
        ends = [mate.team.logs.known_below(Chain(robot, 1)) for robot in talk.mates]
        assert ends == [60, 60, 60]
    # and a radio goes on from there
    talk.seconds(10)
    assert talk.is_healed()
    assert len(talk.digests()) == 1


@pytest.mark.slow
def test_a_team_that_loses_a_third_of_its_messages_comes_to_one_graph() -> None:
    talk = Conversation(4, loss=0.3, seed=3)
    talk.seconds(SPAN + 40)
    talk.settle()
    assert len(talk.digests()) == 1
    assert not any(mate.team.logs.lacks_any() for mate in talk.mates.values())
