"""Which layer of a chapter says what."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drslamd.conventions import Chain
from drslamd.slam.graph.chapters import Sorter, counts
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.robot_model import UNTOLD

A, B = Chain(4, 1), Chain(5, 1)
SEEN = ClosureMeasurement(0, True, 0, A, 0, (1.0, 0.0, 0.0), (0.25, 0.0, 0.0, 0.25, 0.0, 0.25))


def ranged(seq: int, peer: Chain, sigma: float = 0.125) -> RangeMeasurement:
    return RangeMeasurement(10 * seq, peer, 10 * seq, (0.0, 0.0), (0.0, 0.0), 5.0, sigma)


def driven(*ranges: Chain) -> list[GraphEntry]:
    return [
        GraphEntry(k, None, (Keyframe(10 * k, 0, k, 0, 0),), tuple(ranged(k, p) for p in ranges))
        for k in range(64)
    ]


@pytest.mark.parametrize(
    ("layer", "age", "does"),
    [(2, 703, True), (2, 704, False), (1, 2_687, True), (1, 2_688, False), (0, 1_000_000, True)],
)
def test_how_long_a_layer_counts(layer: int, age: int, does: bool) -> None:
    assert counts(layer, 10_000_000, 10_000_000 + age) is does


def test_of_each_pair_one_range_lasts_and_four_of_each_quarter_count_for_long() -> None:
    lasting, longer, rest = Sorter().layers(driven(A, B))
    for peer in (A, B):
        assert sum(item.peer == peer for _, item in lasting.ranges) == 1
        quarters = [place // 4096 // 16 for place, item in longer.ranges if item.peer == peer]
        assert sorted(quarters) == [k for k in range(4) for _ in range(4)]
        assert sum(item.peer == peer for _, item in rest.ranges) == 64 - 1 - 16
    assert len(lasting.keyframes) == 64
    assert not longer.keyframes
    assert not rest.keyframes


def test_what_is_doubted_less_lasts() -> None:
    entries = driven()
    for k, sigma in ((3, 0.5), (20, 0.0625), (50, 0.125)):
        entries[k] = replace(entries[k], ranges=(ranged(k, A, sigma),))
    lasting, _, _ = Sorter().layers(entries)
    assert [place for place, _ in lasting.ranges] == [20 * 4096]


def test_every_word_about_a_closure_but_its_first_lasts() -> None:
    words = [
        (1, SEEN),
        (2, replace(SEEN, number=1, a_n=20)),
        (3, replace(SEEN, number=2, a_n=30)),
        (9, replace(SEEN, number=1, a_n=20, kept=False)),
        (12, replace(SEEN, number=1, a_n=20, b_n=7)),
    ]
    entries = driven()
    for seq, word in words:
        entries[seq] = replace(entries[seq], closures=(word,))
    sorter = Sorter()
    lasting, longer, rest = sorter.layers(entries)
    changed = {9 * 4096, 12 * 4096}
    assert {place for place, _ in lasting.closures} > changed
    assert len(lasting.closures) == 3
    assert len(longer.closures) == 2
    assert not rest.closures
    again = [replace(entry, seq=64 + entry.seq) for entry in driven()]
    again[5] = replace(again[5], closures=(replace(SEEN, kept=False), replace(SEEN, number=2)))
    assert len(sorter.layers(again)[0].closures) == 2


def test_the_latest_model_lasts() -> None:
    entries = driven()
    for k in (0, 40):
        entries[k] = replace(entries[k], model=UNTOLD)
    lasting, _, _ = Sorter().layers(entries)
    assert lasting.models == [(40, UNTOLD)]
