"""Stamps of other clocks as UNIX time, and how wrong they may be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drslamd.export.stamps import complaints, sentences, unix_stamps

SET = {"utc_minus_clock_us": 1_700_000_000_000_000, "uncertainty_us": 1_000}
UNSET = {**SET, "uncertainty_us": None}
OWN = {"source": "own", "readings": [[50_000_000, 0, 0]]}
UNKNOWN: dict[str, Any] = {"source": "unknown", "readings": []}


def known(utime: list[int], clock: dict[str, Any], wall: dict[str, Any]) -> tuple[Any, Any]:
    found = unix_stamps(utime, clock, wall)
    assert found is not None
    return found.unix_us, found.uncertainty_s


def test_our_own_stamps_are_as_wrong_as_the_wall_clock_however_old_they_are() -> None:
    unix, unsure = known([0, 49_000_000], OWN, SET)
    assert unix.tolist() == [1_700_000_000_000_000, 1_700_000_049_000_000]
    assert unsure.tolist() == [0.001, 0.001]


def test_a_clock_that_drifted_is_taken_as_it_was_then() -> None:
    """It was 1 s ahead at our 10 s and 1.01 s at our 110 s; 100 ppm."""
    readings = [[10_000_000, 1_000_000, 3_000], [110_000_000, 1_010_000, 5_000]]
    clock = {"source": "messages", "readings": readings}
    unix, unsure = known([11_000_000, 61_005_000, 111_010_000], clock, SET)
    seconds = (unix - SET["utc_minus_clock_us"]) / 1e6
    assert seconds == pytest.approx([10.0, 60.0, 110.0], abs=2e-6)
    assert unsure == pytest.approx([0.004, 0.005, 0.006], abs=1e-5)


def test_before_the_first_and_after_the_last_reading_it_grows_with_200_ppm() -> None:
    readings = [[10_000_000, 0, 3_000], [20_000_000, 0, 3_000]]
    clock = {"source": "messages", "readings": readings}
    unix, unsure = known([0, 120_000_000], clock, SET)
    assert (unix - SET["utc_minus_clock_us"]).tolist() == [0, 120_000_000]
    assert unsure == pytest.approx([0.004 + 0.002, 0.004 + 0.020])


def test_a_clock_that_nobody_knows_gives_no_stamps() -> None:
    assert unix_stamps([1, 2], UNKNOWN, SET) is None


def test_large_stamps_keep_their_microseconds() -> None:
    late = 214_748_364_600_001
    unix, _ = known([late], OWN, SET)
    assert unix.tolist() == [late + 1_700_000_000_000_000]


@pytest.mark.parametrize(
    ("clock", "wall", "said"),
    [
        (OWN, SET, "robot 3: UNIX time, +-0.001 s"),
        (OWN, UNSET, "robot 3: UNIX time, if that of the host is right, +-0.000 s"),
        (
            {"source": "one way", "readings": [[0, 0, 100_000]]},
            SET,
            "robot 3: UNIX time, +-0.101 s by one way",
        ),
    ],
)
def test_a_sentence_says_how_far_they_can_be_trusted(
    clock: dict[str, Any], wall: dict[str, Any], said: str
) -> None:
    stamps = unix_stamps([0], clock, wall)
    assert stamps is not None
    assert sentences("3", clock, stamps, wall) == said
    nothing = unix_stamps([], clock, wall)
    assert nothing is not None
    assert np.array_equal(nothing.unix_us, [])


def test_whoever_needs_other_clocks_is_told_what_is_missing() -> None:
    assert complaints({"wall": SET}, {"1": OWN}) == []
    unset, left_out = complaints({"wall": UNSET}, {"2": UNKNOWN, "1": OWN})
    assert "nobody sets this host's wall clock" in unset
    assert "systemd-timesyncd or chrony" in unset
    assert left_out.startswith("the clock of robot 2 is not known here, so its path is left out")
