"""Public poses: what one message says, and what is remembered of earlier ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drslamd.slam.graph import public_poses
from drslamd.slam.graph.public_poses import HeardPoses, PublicPoses

RANK = 2


def said(numbers: tuple[int, ...], value: float, frame: int = 0, epoch: int = 1) -> PublicPoses:
    """All lifted numbers are `value`, those of the anchor its opposite."""
    values = np.full((len(numbers) + 1, 2 * RANK), value, dtype=complex)
    values[0] = -value
    return PublicPoses(frame, epoch, RANK, numbers, values)


def firsts(public: PublicPoses) -> dict[int, float]:
    return {n: float(row[0].real) for n, row in public.table().items()}


def test_each_keyframe_has_the_row_behind_that_of_the_anchor() -> None:
    values = np.arange(12).reshape(3, 4) * 1j
    table = PublicPoses(0, 1, RANK, (40, 50), values).table()
    assert table[40].tolist() == [4j, 5j, 6j, 7j]
    assert table[50].tolist() == [8j, 9j, 10j, 11j]


def test_parts_are_numbered_and_each_has_the_anchor_too() -> None:
    values = np.arange(20).reshape(5, 4) * 1j
    whole = PublicPoses(3, 7, RANK, (40, 50, 60, 70), values, round=9, since=5)
    parts = list(whole.split(3))
    assert [part.keyframes for part in parts] == [(40, 50, 60), (70,)]
    assert [(part.part, part.parts, part.round, part.since) for part in parts] == [
        (0, 2, 9, 5),
        (1, 2, 9, 5),
    ]
    assert np.array_equal(parts[0].values, values[:4])
    assert np.array_equal(parts[1].values, values[[0, 4]])


def test_of_no_poses_there_is_one_part() -> None:
    (part,) = PublicPoses(3, 7, RANK, (), np.ones((1, 4), dtype=complex)).split(3)
    assert (part.keyframes, part.part, part.parts, len(part.values)) == ((), 0, 1, 1)


def test_chosen_poses_keep_the_anchor() -> None:
    values = np.arange(16).reshape(4, 4) * 1j
    some = PublicPoses(3, 7, RANK, (40, 50, 60), values).chosen([60, 40, 99])
    assert some.keyframes == (40, 60)
    assert np.array_equal(some.values, values[[0, 1, 3]])


def test_a_rank_grows_by_zeros_and_shrinks_by_what_lies_beyond() -> None:
    values = np.array([[1, 2, 3, 4], [5, 6, 7, 8]], dtype=complex)
    public = PublicPoses(3, 7, 2, (40,), values)
    more, fewer = public.of_rank(3), public.of_rank(1)
    assert more.values.tolist() == [[1, 2, 0, 3, 4, 0], [5, 6, 0, 7, 8, 0]]
    assert fewer.values.tolist() == [[1, 3], [5, 7]]


@pytest.mark.parametrize(("place", "rank"), [(0, 1), (1, 2), (2, 3), (3, 1), (4, 2), (5, 3)])
def test_directions_that_nobody_uses_are_left_out(place: int, rank: int) -> None:
    """Rotation or translation, of the anchor or of any pose."""
    values = np.zeros((3, 6), dtype=complex)
    values[:, 0] = 1.0
    values[2, place] = 1e-9j
    assert PublicPoses(3, 7, 3, (40, 50), values).occupied().rank == rank


def test_what_a_later_message_does_not_name_stays_and_the_anchor_is_the_latest() -> None:
    whole = said((50, 60), 2.0).after(said((40, 50), 1.0))
    assert firsts(whole) == {40: 1.0, 50: 2.0, 60: 2.0}
    assert whole.values[0, 0] == -2.0


def test_without_an_earlier_message_there_is_what_was_said() -> None:
    assert firsts(said((40,), 1.0).after(None)) == {40: 1.0}


@pytest.mark.parametrize("other", [{"frame": 1}, {"epoch": 2}])
def test_poses_of_another_frame_are_not_mixed_in(other: dict[str, int]) -> None:
    assert firsts(said((50,), 2.0).after(said((40,), 1.0, **other))) == {50: 2.0}


def test_poses_of_different_ranks_are_those_of_the_higher_one() -> None:
    low = PublicPoses(0, 1, 1, (40,), np.array([[9, 9], [1, 2]], dtype=complex))
    whole = said((50,), 3.0).after(low)
    assert whole.rank == RANK
    assert whole.table()[40].tolist() == [1, 0, 2, 0]
    again = low.after(said((50,), 3.0))
    assert again.table()[50].tolist() == [3, 3, 3, 3]
    assert again.values[0].tolist() == [9, 0, 9, 0]


@pytest.mark.parametrize(
    ("most", "kept"), [(3, {40: 1.0, 50: 2.0, 60: 2.0}), (2, {50: 2.0, 60: 2.0})]
)
def test_the_oldest_keyframes_are_forgotten(
    most: int, kept: dict[int, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(public_poses, "MAX_PUBLIC", most)
    assert firsts(said((50, 60), 2.0).after(said((40, 50), 1.0))) == kept


# what a peer has said


def test_a_move_counts_when_all_of_its_parts_are_there_in_any_order() -> None:
    heard = HeardPoses()
    parts = list(replace(said((40, 50, 60), 1.0), round=4).split(1))
    assert not heard.take(parts[2])
    assert not heard.take(parts[0])
    assert (heard.round, heard.newest, heard.lacks, heard.poses) == (0, 4, True, None)
    assert not heard.take(parts[0])
    assert heard.take(parts[1])
    assert (heard.round, heard.lacks) == (4, False)
    assert heard.poses is not None
    assert firsts(heard.poses) == {40: 1.0, 50: 1.0, 60: 1.0}


def test_a_move_that_builds_on_one_that_is_missing_waits_for_one_that_does_not() -> None:
    heard = HeardPoses()
    assert heard.take(replace(said((40, 50), 1.0), round=2))
    assert not heard.take(replace(said((50,), 3.0), round=6, since=4))
    assert (heard.round, heard.lacks) == (2, True)
    assert heard.take(replace(said((40, 50), 3.0), round=6, since=2))
    assert heard.poses is not None
    assert firsts(heard.poses) == {40: 3.0, 50: 3.0}


def test_what_comes_late_changes_nothing() -> None:
    heard = HeardPoses()
    assert heard.take(replace(said((40,), 5.0), round=5))
    assert not heard.take(replace(said((40,), 2.0), round=2))
    assert heard.newest == 5
    assert not heard.take(replace(said((40,), 4.0), round=5))
    assert heard.poses is not None
    assert firsts(heard.poses) == {40: 5.0}


def test_parts_of_two_ways_to_say_one_move_are_not_mixed() -> None:
    heard = HeardPoses()
    assert heard.take(replace(said((40,), 1.0), round=1))
    one = list(replace(said((40, 50), 2.0), round=3, since=1).split(1))
    other = list(replace(said((40, 50), 2.0), round=3, since=0).split(1))
    assert not heard.take(one[0])
    assert not heard.take(other[1])
    assert heard.round == 1
    assert heard.take(other[0])


def test_parts_of_an_older_move_do_not_push_out_those_of_a_newer_one() -> None:
    heard = HeardPoses()
    newer = list(replace(said((40, 50), 2.0), round=3).split(1))
    older = list(replace(said((40, 50), 1.0), round=2).split(1))
    for part in (newer[0], *older):
        assert not heard.take(part)
    assert heard.take(newer[1])


def test_a_question_tells_of_a_move_and_of_no_pose() -> None:
    heard = HeardPoses()
    assert not heard.take(replace(said((), 0.0), round=7, since=7, asks=True))
    assert (heard.newest, heard.round, heard.lacks) == (7, 0, True)


def test_a_move_without_poses_is_no_news_unless_the_frame_is_another() -> None:
    heard = HeardPoses()
    assert heard.take(replace(said((40,), 1.0), round=1))
    assert not heard.take(replace(said((), 1.0), round=2, since=1))
    assert heard.round == 2
    assert heard.take(replace(said((), 1.0, frame=3), round=3, since=2))
    assert heard.poses is not None
    assert heard.poses.keyframes == ()


def test_parts_that_never_end_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(public_poses, "MAX_PUBLIC", 5)
    heard = HeardPoses()
    for part in range(100):
        message = said((2 * part, 2 * part + 1), 1.0)
        heard.take(replace(message, round=3, part=part, parts=200))
        assert len(heard._parts) <= 2
