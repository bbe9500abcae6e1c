"""Bytes a second."""

from __future__ import annotations

import pytest
from patients import Case, found

from drslamd.doctor.daemon.traffic_budget import traffic_budget


@pytest.mark.parametrize(("sent", "is_found"), [(80_000, False), (80_001, True)])
def test_a_budget_that_is_nearly_used_is_told_before_it_is(sent: int, is_found: bool) -> None:
    case = Case()
    case.stop("network", "bytes_sent")
    case.grow("network", "bytes_sent", by=sent)
    said = found(traffic_budget, case)
    assert bool(said) is is_found
    case.say("budget", "gossip.max_bytes_per_s = 50000 holds messages back")
    assert len(found(traffic_budget, case)) == 1


def test_messages_that_the_network_does_not_take() -> None:
    case = Case()
    case.grow("network", "dropped", by=3)
    (said,) = found(traffic_budget, case)
    assert "did not take 1.5 messages a second" in said
    case.now["network"]["up"] = False  # said by another check
    assert found(traffic_budget, case) == []
