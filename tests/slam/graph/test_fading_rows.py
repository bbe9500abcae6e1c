"""Rows of a pair that go when no layer of a chapter says them any more."""

from __future__ import annotations

import random

import numpy as np
import pytest

from drslamd.slam.graph.fading_rows import FadingRows


def a_table() -> FadingRows:
    return FadingRows(3, identity=2, most=10_000, places=lambda rows: np.asarray(rows[:, 1]))


def say(table: FadingRows, seq: int, layer: int = 2) -> None:
    """A row at ten samples an entry."""
    table.say([10.0 * seq, 4096.0 * seq, 1.0], 4096 * seq, layer)


def left(table: FadingRows) -> list[int]:
    return [int(row[0]) // 10 for row in table.rows]


@pytest.mark.parametrize(
    ("latest", "stay"),
    [(703, [0, 1, 2]), (704, [0, 1]), (2_688, [0, 1]), (2_689, [0])],
)
def test_each_layer_goes_in_its_time(latest: int, stay: list[int]) -> None:
    table = a_table()
    for seq, layer in ((0, 0), (1, 1), (0, 2)):
        say(table, seq, layer)
    table.say([20.0, 2.0, 1.0], 2, 2)
    table.fade(latest)
    assert left(table) == stay


def test_what_came_late_and_counts_no_more_is_not_taken() -> None:
    table = a_table()
    table.fade(1_000)
    say(table, 296)
    say(table, 297)
    say(table, 5, 1)
    say(table, 6, 0)
    assert left(table) == [5, 6, 297]


@pytest.mark.parametrize("seed", range(10))
def test_what_is_left_follows_from_what_was_said_in_any_order(seed: int) -> None:
    """Whoever heard entries and chapters holds what somebody holds who heard the chapters only."""
    chance = random.Random(seed)
    layers = [chance.choice([0, 1, 2, 2, 2]) for _ in range(4_000)]
    words = [(seq, 2) for seq in range(4_000)] + list(enumerate(layers))
    latest = 3_900
    one, other = a_table(), a_table()
    chance.shuffle(words)
    for k, (seq, layer) in enumerate(words):
        say(one, seq, layer)
        if k % 1_000 == 0:
            one.fade(min(latest, k // 2))
    one.fade(latest)
    for seq, layer in words:
        if layer == layers[seq]:
            say(other, seq, layer)
    other.fade(latest)
    wanted = [s for s, layer in enumerate(layers) if latest - s < (10**9, 2_688, 704)[layer]]
    assert left(other) == wanted
    # what an entry said that was gone before its chapter came is said by the chapter
    assert left(one) == wanted
    assert one.rows.tobytes() == other.rows.tobytes()
