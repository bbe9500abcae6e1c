"""The fuzzers themselves: every decoder has a target, and noise is not believed."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lab.hunt import flips, forger, fuzz, liar, volume
from lab.hunt.lies import Liar
from lab.hunt.targets import TARGETS, seeds
from places import Recorded

from drslamd.events import ChannelMessage
from drslamd.gossip.codecs import CODECS
from drslamd.gossip.seal import Seal, team_key
from drslamd.gossip.team import Team
from drslamd.slam.graph.measurements import GraphEntry


def quiet(_: float) -> None:
    """Nobody looks at a bar here."""


def test_every_kind_of_message_and_every_line_has_a_target() -> None:
    assert {kind.lower() for kind in CODECS} < set(TARGETS)
    assert {"datagram", "lc02", "uwb", "kobuki", "roboteq", "ascii", "robot"} < set(TARGETS)
    assert seeds()


@pytest.mark.row("N7")
@pytest.mark.parametrize("name", TARGETS)
def test_a_target_takes_anything(name: str) -> None:
    take, begun = TARGETS[name](), seeds()

    @settings(max_examples=60, deadline=None, derandomize=True, database=None)
    @given(st.binary(max_size=300) | st.sampled_from(begun))
    def taken(data: bytes) -> None:
        take(data)

    taken()
    draw = random.Random(1)
    for _ in range(300):
        bent = bytearray(draw.choice(begun))
        bent[8 + draw.randrange(len(bent) - 8)] ^= 1 << draw.randrange(8)
        take(bytes(bent[draw.choice([0, 0, 8, 24]) :]))


@pytest.mark.row("N7")
def test_malformed_datagrams_are_not_believed(record_property: Recorded) -> None:
    poured = volume.datagrams(8_000, told=quiet)
    assert poured.accepted == 0
    assert "8e+03 malformed datagrams: 0 accepted" in poured.line()
    record_property("measured", poured.line())


@pytest.mark.row("D2")
def test_few_frames_with_two_damaged_bits_give_a_wrong_range(record_property: Recorded) -> None:
    """The checksum alone lets one in fifteen pass."""
    found = flips.double_flips(3_000, told=quiet)
    assert found.many == 3_000
    assert found.wrong <= 25
    assert found.harmful <= 10
    assert found.lost < 5
    record_property(
        "measured", f"{found.wrong} wrong ranges of {found.many} frames with two bits turned over"
    )


@pytest.mark.row("D1")
def test_noise_on_the_lines_is_not_believed(record_property: Recorded) -> None:
    poured = volume.serial_bytes(2_000_000, told=quiet)
    assert poured.accepted == 0
    assert poured.grew_kb < 20_000
    record_property("measured", poured.line())


def test_lies_are_well_formed() -> None:
    """All that a team could refuse them for is what they say of the past."""
    teller, team = Liar(3, team_key(None)), Team(Seal(team_key(None), 1, 1, {}))
    entries_heard = []
    for k in range(800):
        utime = 1_000_000 + 10_000 * k
        channel, payload = teller.lie(utime)
        received = team.receive(ChannelMessage(utime, channel, payload))
        if received is not None and isinstance(received.message, GraphEntry):
            entries_heard.append(received.message)
    assert team.accepted > 750
    chapters = [e.chapter for e in entries_heard if e.chapter is not None]
    assert len(chapters) > 50
    assert any(chapter.parts for chapter in chapters)
    assert "content out of range" not in team.refused


@pytest.mark.slow
@pytest.mark.row("S9")
def test_a_member_that_lies_costs_the_others_a_fifth_at_most(record_property: Recorded) -> None:
    lied = liar.compared(600, scene=replace(liar.SCENE, seconds=48.0))
    assert lied.accepted > 550
    assert lied.is_kept, lied.line()
    record_property("measured", f"ATE of the others {lied.ratio:.2f} x")


@pytest.mark.slow
@pytest.mark.row("S9")
def test_a_member_that_puts_another_beside_where_it_is_costs_the_others_a_fifth_at_most(
    record_property: Recorded,
) -> None:
    """By 3 m, in all its ranges and closures with that one, which agree."""
    found = forger.compared(3.0, replace(liar.SCENE, seconds=60.0))
    assert found.many > 50
    assert found.is_kept, found
    record_property("measured", f"consistently: {found.ratio:.2f} x")


def test_an_unknown_target_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        fuzz.main(["no-such-target"])
    assert "'no-such-target' is none of" in capsys.readouterr().err
