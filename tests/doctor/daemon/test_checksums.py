"""Damaged frames, and bytes of none."""

from __future__ import annotations

import pytest
from patients import Case, found

from drslamd.doctor.daemon.checksums import checksums


@pytest.mark.parametrize(("bad", "is_found"), [(1, False), (2, True), (50, True)])
def test_more_than_one_damaged_frame_in_a_hundred_is_a_finding(bad: int, is_found: bool) -> None:
    case = Case()
    case.grow("uwb", "counters", "bad_checksums", by=bad)
    assert bool(found(checksums, case)) is is_found


@pytest.mark.parametrize(("garbage", "is_found"), [(100, False), (101, True)])
def test_so_are_bytes_that_belong_to_no_frame(garbage: int, is_found: bool) -> None:
    case = Case()
    case.grow("uwb", "counters", "garbage_bytes", by=garbage)
    assert bool(found(checksums, case)) is is_found


def test_a_module_that_is_silent_has_no_share_of_anything() -> None:
    case = Case()
    case.stop("uwb", "counters", "bytes")
    case.stop("uwb", "counters", "frames.accepted")
    assert found(checksums, case) == []
