"""Clocks of the others."""

from __future__ import annotations

import pytest
from patients import Case, found

from drslamd.doctor.daemon.peer_clocks import peer_clocks


@pytest.mark.parametrize(("unsure", "word"), [(50.0, ""), (50.1, "50 ms"), (None, "not known")])
def test_a_clock_that_is_hardly_known_is_a_finding(unsure: float | None, word: str) -> None:
    case = Case()
    case.now["peers"]["1"]["clock_uncertainty_ms"] = unsure
    said = found(peer_clocks, case)
    assert bool(said) is bool(word)
    assert all(word in sentence for sentence in said)


@pytest.mark.parametrize("key", ["alive", "hears_us"])
def test_of_a_peer_to_whom_nobody_talks_no_clock_is_missed(key: str) -> None:
    case = Case()
    case.now["peers"]["1"] |= {"clock_uncertainty_ms": None, key: False}
    assert found(peer_clocks, case) == []
