"""Public poses: what one message says, and what is remembered of earlier ones."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.slam.graph import public_poses
from drslamd.slam.graph.public_poses import PublicPoses

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


def test_a_part_has_the_anchor_too() -> None:
    values = np.arange(20).reshape(5, 4) * 1j
    part = PublicPoses(3, 7, RANK, (40, 50, 60, 70), values).part(1, 3)
    assert (part.frame, part.frame_epoch, part.rank, part.keyframes) == (3, 7, RANK, (50, 60))
    assert np.array_equal(part.values, values[[0, 2, 3]])


def test_what_a_later_message_does_not_name_stays_and_the_anchor_is_the_latest() -> None:
    whole = said((50, 60), 2.0).after(said((40, 50), 1.0))
    assert firsts(whole) == {40: 1.0, 50: 2.0, 60: 2.0}
    assert whole.values[0, 0] == -2.0


def test_without_an_earlier_message_there_is_what_was_said() -> None:
    assert firsts(said((40,), 1.0).after(None)) == {40: 1.0}


@pytest.mark.parametrize("other", [{"frame": 1}, {"epoch": 2}])
def test_poses_of_another_frame_are_not_mixed_in(other: dict[str, int]) -> None:
    assert firsts(said((50,), 2.0).after(said((40,), 1.0, **other))) == {50: 2.0}


def test_poses_of_another_rank_are_not_mixed_in() -> None:
    before = PublicPoses(0, 1, RANK + 1, (40,), np.zeros((2, 2 * (RANK + 1)), dtype=complex))
    assert firsts(said((50,), 2.0).after(before)) == {50: 2.0}


@pytest.mark.parametrize(
    ("most", "kept"), [(3, {40: 1.0, 50: 2.0, 60: 2.0}), (2, {50: 2.0, 60: 2.0})]
)
def test_the_oldest_keyframes_are_forgotten(
    most: int, kept: dict[int, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(public_poses, "MAX_PUBLIC", most)
    assert firsts(said((50, 60), 2.0).after(said((40, 50), 1.0))) == kept
