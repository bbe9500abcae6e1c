"""What was turned away is counted, and spoken of while it lasts."""

from __future__ import annotations

from drslamd.gossip.membership.refusals import Refusals
from drslamd.gossip.seal import SealFault

SECOND = 1_000_000


def test_each_refusal_counts_under_its_reason() -> None:
    refusals = Refusals()
    for fault in (SealFault.SEEN, SealFault.SEEN, SealFault.WRONG_TAG):
        refusals.add(fault, 0, "10.0.0.7")
    assert refusals.counts == {"already seen": 2, "tag does not fit the team key": 1}


def test_what_somebody_must_mend_is_said_for_ten_seconds_with_its_sender() -> None:
    refusals = Refusals()
    refusals.add(SealFault.WRONG_TAG, SECOND, "10.0.0.7")
    said = dict(refusals.conditions(11 * SECOND - 1))["team.wrong_tag"]
    assert said is not None
    assert "10.0.0.7" in said
    assert dict(refusals.conditions(11 * SECOND))["team.wrong_tag"] is None
    assert not refusals.is_of_late(SealFault.SEEN, SECOND)
