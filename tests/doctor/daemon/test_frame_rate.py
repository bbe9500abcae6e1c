"""Ranging frames a second."""

from __future__ import annotations

import pytest
from patients import Case, found

from drslamd.doctor.daemon.frame_rate import frame_rate


@pytest.mark.parametrize(("frames", "is_found"), [(0, False), (9, True), (10, False), (200, False)])
def test_few_frames_are_a_finding_and_none_is_one_of_another_check(
    frames: int, is_found: bool
) -> None:
    case = Case()
    case.stop("uwb", "counters", "frames.accepted")
    case.grow("uwb", "counters", "frames.accepted", by=frames)
    said = found(frame_rate, case)
    assert bool(said) is is_found
    assert all("4.5 ranging frames" in s and "NAssistant" in s for s in said)
