"""Clocks out of messages, and who could hear whom."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lab.play.simulator import Clock
from lab.replay.mail import DELAY_US, HEARD_WITHIN_US, Mail, Reach, clocks, line, travelled
from lab.replay.runs import Run

from drslamd.conventions import SECOND_US
from drslamd.recording.records import Beginning, Opening

HOUR = 3600 * SECOND_US
A, B = Clock(2 * HOUR, 10.0), Clock(7 * HOUR, -40.0)


def messages(a: Clock, b: Clock, seed: int = 0, seconds: int = 600) -> Any:
    """Times of messages from a to b, each one to forty milliseconds on its way."""
    rng = np.random.default_rng(seed)
    world = np.sort(rng.integers(0, seconds * SECOND_US, 3 * seconds))
    took = rng.integers(1_000, 40_000, len(world))
    rows = [(a.local(int(t)), b.local(int(t + d))) for t, d in zip(world, took, strict=True)]
    return np.array(rows)


def test_offset_and_rate_come_out_of_messages_both_ways() -> None:
    found = line(messages(A, B), messages(B, A, 1))
    assert found is not None
    at, ahead, ppm = found
    world = A.world(at)
    assert ahead == pytest.approx(B.local(world) - A.local(world), abs=1_000)
    assert ppm == pytest.approx(-50.0, abs=15.0)


@pytest.mark.parametrize("way", ["there", "back"])
def test_one_way_alone_is_off_by_the_delay_that_is_not_known(way: str) -> None:
    none = np.zeros((0, 2), dtype=np.int64)
    there, back = (messages(A, B), none) if way == "there" else (none, messages(B, A))
    found = line(there, back)
    assert found is not None
    world = A.world(found[0])
    assert found[1] == pytest.approx(B.local(world) - A.local(world), abs=DELAY_US + 1_000)
    assert line(none, none) is None


def run(clock: Clock, wall_us: int = 0, world_us: int = 0) -> Run:
    utime = clock.local(world_us)
    said = {"clocks": {"utime": utime, "wall_us": wall_us + world_us, "within_us": 1}}
    return Run([Path("x")], Opening(utime, Beginning(1), 0, said), 0)


def mails(*clocks_: Clock) -> list[Mail]:
    """Everybody hears everybody except that the first does not reach the last directly."""
    out = [Mail() for _ in clocks_]
    for i, a in enumerate(clocks_):
        for k, (at, _) in enumerate(messages(a, a, i)):
            out[i].sent["STATUS", b"%d %d" % (i, k)] = int(at)
        for j, b in enumerate(clocks_):
            if abs(i - j) == 1:
                for k, (_, at) in enumerate(messages(a, b, i)):
                    out[j].heard["STATUS", b"%d %d" % (i, k)] = int(at)
    return out


def test_clocks_are_found_along_a_chain_of_robots() -> None:
    true = [A, B, Clock(HOUR, 30.0)]
    found = clocks([run(clock) for clock in true], mails(*true))
    for clock, other in zip(found, true, strict=True):
        for world in (0, 300 * SECOND_US, 600 * SECOND_US):
            # the first robot's clock is the measure, so its own rate is not seen
            shown = other.local(A.world(A.offset_us + world))
            assert clock.local(world) == pytest.approx(shown, abs=3_000)


def test_without_messages_wall_clocks_have_to_do() -> None:
    runs = [run(A, 10**15), run(B, 10**15, 7 * SECOND_US)]
    found = clocks(runs, [Mail(), Mail()])
    assert found[1].local(7 * SECOND_US) == pytest.approx(B.local(7 * SECOND_US), abs=500)


def test_a_message_that_was_repeated_counts_by_its_first_time() -> None:
    sender, receiver = Mail({("A", b"x"): 5}), Mail({}, {("A", b"x"): 9, ("A", b"y"): 1})
    assert travelled(sender, receiver).tolist() == [[5, 9]]
    assert travelled(receiver, sender).shape == (0, 2)


@pytest.mark.parametrize(
    ("after_us", "can"), [(0, True), (HEARD_WITHIN_US - 1, True), (HEARD_WITHIN_US, False)]
)
def test_who_was_not_heard_for_a_while_cannot_be_heard(after_us: int, can: bool) -> None:
    reach = Reach()
    reach.add(0, Clock(), 1, np.array([[SECOND_US, 0], [9 * SECOND_US, 0]]))
    assert reach.connects(0, 1, 9 * SECOND_US + after_us) is can
    assert reach.connects(0, 1, max(SECOND_US - after_us, 0)) is (can or after_us > SECOND_US)
    assert not reach.connects(1, 0, SECOND_US)
