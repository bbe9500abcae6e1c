"""The track: where its samples are, what it forgets, what lies between."""

from __future__ import annotations

import numpy as np
import pytest

from drslamd.slam.odometry.track import RESOLUTION, Track


def track_of(*samples: int, capacity: int = 100) -> Track:
    """Sample n stands at x = n steps, y = 2 n, theta = -n."""
    track = Track(capacity)
    for n in samples:
        track.append(n, np.array([n, 2 * n, -n], dtype=float))
    return track


def expected(n: float) -> np.ndarray:
    return np.asarray(np.array([n, 2 * n, -n]) * RESOLUTION)


def test_an_empty_track_has_no_length() -> None:
    track = Track(10)
    assert len(track) == 0
    assert track.end == 0
    assert track.poses.shape == (0, 3)


def test_samples_are_found_by_their_number() -> None:
    track = track_of(*range(500, 520))
    assert (track.n0, track.end, len(track), track.segment_start) == (500, 520, 20, 500)
    assert np.allclose(track.at(507), expected(507))
    assert np.array_equal(track.steps(510, 2), [[510, 1020, -510], [511, 1022, -511]])


def test_a_hole_holds_nothing_and_begins_a_segment() -> None:
    track = track_of(10, 11, 14, 15)
    assert np.isnan(track.poses[2:4]).all()
    assert np.isfinite(track.poses[[0, 1, 4, 5]]).all()
    assert track.segment_start == 14


def test_neighbouring_samples_begin_none() -> None:
    assert track_of(10, 11, 12).segment_start == 10


def test_a_sample_before_the_end_is_a_bug() -> None:
    track = track_of(10, 11)
    with pytest.raises(ValueError, match="11 is before the end 12"):
        track.append(11, np.zeros(3))


@pytest.mark.parametrize(
    ("first", "last", "covered"),
    [(14, 15, True), (14, 16, False), (13, 15, False), (10, 11, False), (15, 15, True)],
)
def test_only_samples_after_the_last_hole_are_covered(first: int, last: int, covered: bool) -> None:
    assert track_of(10, 11, 14, 15).covers(first, last) is covered


def test_between_samples_it_is_linear_and_at_samples_exact() -> None:
    track = track_of(10, 11, 12)
    n = np.array([10.0, 10.25, 11.0, 11.999, 12.0])
    assert np.allclose(track.at_time(n), [expected(v) for v in n], atol=1e-12)


def test_beyond_its_ends_a_track_stands_still() -> None:
    track = track_of(10, 11, 12)
    assert np.allclose(track.at_time(np.array([9.0, 12.5])), [expected(10), expected(12)])
    assert np.allclose(track_of(7).at_time(np.array([6.0, 7.0, 8.0])), [expected(7)] * 3)


def test_the_last_sample_before_a_hole_is_no_hole() -> None:
    track = track_of(10, 11, 14, 15)
    assert np.isnan(track.at_time(np.array([11.5, 13.9]))).all()
    assert np.allclose(track.at_time(np.array([14.0, 14.5])), [expected(14), expected(14.5)])


def test_the_oldest_samples_go_first_and_the_capacity_always_stays() -> None:
    track = Track(100)
    for n in range(1000, 1700):
        track.append(n, np.array([n, 2 * n, -n], dtype=float))
        assert track.end == n + 1
        assert len(track) >= min(100, n - 999)
        assert len(track) <= 130
    for n in range(1600, 1700):
        assert np.allclose(track.at(n), expected(n))


@pytest.mark.parametrize(("hole", "n0"), [(50, 0), (98, 9), (99, 10), (100, 110), (101, 111)])
def test_a_hole_as_long_as_the_track_empties_it(hole: int, n0: int) -> None:
    track = track_of(*range(10))
    n = 10 + hole
    track.append(n, np.array([n, 2 * n, -n], dtype=float))
    assert (track.n0, track.end) == (n0, n + 1)
    assert track.segment_start == n
    assert np.allclose(track.at(n), expected(n))


def test_a_sample_far_in_the_future_takes_no_memory() -> None:
    track = track_of(*range(10))
    track.append(2**31 - 1, np.zeros(3))
    assert len(track) == 1
    assert track.n0 == track.segment_start == 2**31 - 1


def test_segments_that_are_trimmed_leave_a_consistent_track() -> None:
    rng = np.random.default_rng(3)
    track, n, last_start = Track(50), 0, 0
    for _ in range(2000):
        gap = int(rng.choice([0, 0, 0, 0, 0, 0, 1, 7, 49, 60], p=[0.15] * 6 + [0.025] * 4))
        n += 1 + gap
        last_start = n if gap or not len(track) else last_start
        track.append(n, np.array([n, 2 * n, -n], dtype=float))
        assert track.segment_start == last_start
        held = np.isfinite(track.poses[:, 0])
        numbers = np.arange(track.n0, track.end)[held]
        assert np.allclose(track.poses[held], numbers[:, None] * [1, 2, -1] * RESOLUTION)
