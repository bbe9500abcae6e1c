"""The radio does to datagrams what its troubles say, as long as they last."""

from __future__ import annotations

import numpy as np
import pytest
from lab.soak import radio
from lab.soak.radio import Change, Radio, Trouble

MAIL = [(0, b"12345678" + bytes(40))]


def delivered(change: Change, way: tuple[int, int] = (0, 1), count: int = 4_000) -> list[int]:
    """How many copies of each of so many datagrams, a tenth of a second apart, arrive."""
    rng = np.random.default_rng(1)
    return [len(change(rng, way, 100_000 * k, MAIL)) for k in range(count)]


@pytest.mark.parametrize("share", [0.1, 0.3, 0.7])
def test_loss_comes_alone_or_in_bursts_and_as_often_as_was_said(share: float) -> None:
    alone, bursty = delivered(radio.lossy(share)), delivered(radio.bursty(share), count=40_000)
    assert 1 - np.mean(alone) == pytest.approx(share, abs=0.04)
    assert 1 - np.mean(bursty) == pytest.approx(share, abs=0.06)
    changes = [np.abs(np.diff(lost)).mean() for lost in (alone, bursty)]
    assert changes[1] < 0.5 * changes[0]


def test_links_that_are_dead_for_a_while_are_so_again_and_again() -> None:
    heard = delivered(radio.dark(10.0, 5.0), count=200)
    assert heard == ([0] * 50 + [1] * 50) * 2


def test_copies_come_as_often_as_was_said_and_late_ones_within_their_time() -> None:
    assert set(delivered(radio.copied(10), count=10)) == {10}
    rng = np.random.default_rng(1)
    times = [radio.late(5.0)(rng, (0, 1), 0, MAIL)[0][0] for _ in range(500)]
    assert min(times) < 100_000
    assert 4_900_000 < max(times) <= 5_000_000


def test_a_dead_way_is_dead_one_way_only() -> None:
    change = radio.one_way([(0, 1)])
    assert delivered(change, (0, 1), 3) == [0, 0, 0]
    assert delivered(change, (1, 0), 3) == [1, 1, 1]


def test_a_team_falls_in_two_and_flaps() -> None:
    assert delivered(radio.parted({2}), (0, 2), 2) == [0, 0]
    assert delivered(radio.parted({2}), (0, 1), 2) == [1, 1]
    assert delivered(radio.parted({2}, 0.2), (2, 0), 6) == [0, 0, 1, 1, 0, 0]


@pytest.mark.parametrize(("apart_m", "heard"), [(4.99, 1), (5.01, 0)])
def test_who_is_too_far_away_is_not_heard(apart_m: float, heard: int) -> None:
    assert delivered(radio.short(5.0, lambda a, b, t: apart_m), count=1) == [heard]


def test_a_damaged_datagram_is_another_one_behind_its_header_and_known_as_such() -> None:
    air, rng = Radio(), np.random.default_rng(1)
    change = air.corrupting(1.0)
    for _ in range(300):
        ((_, data),) = change(rng, (0, 1), 0, MAIL)
        assert data[:8] == MAIL[0][1][:8]
        assert data in air.damaged or data == MAIL[0][1]
    assert len(air.damaged) > 50


def test_a_trouble_begins_and_ends() -> None:
    air, rng = Radio(delay_us=0, jitter_us=0), np.random.default_rng(1)
    air.troubles.append(Trouble(1_000, 2_000, radio.lossy(1.0)))
    heard = [len(air.deliveries(rng, (0, 1), t, b"x")) for t in (999, 1_000, 1_999, 2_000)]
    assert heard == [1, 0, 0, 1]
