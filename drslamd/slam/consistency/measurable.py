"""Owned pairs of which something can be measured now."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.relative_pose.pair_end import PairEnd


class Measurable(NamedTuple):
    """A pair, and both its robots, with everything at hand that a measurement needs."""

    pair: PairTracker
    a: PairEnd
    b: PairEnd


def behind_lapses(found: Iterable[Measurable], estimate: TeamEstimate | None) -> list[Measurable]:
    """Only as far as they lie behind all stretches along which wheels stood or spun, as the last
    solution has it: no window spans those."""
    if estimate is None or not estimate.lapses:
        return list(found)
    return [Measurable(pair, _behind(a, estimate), _behind(b, estimate)) for pair, a, b in found]


def _behind(end: PairEnd, estimate: TeamEstimate) -> PairEnd:
    ends = [lapse.last for lapse in estimate.lapses if lapse.robot == end.data.chain.robot]
    return end.behind(max(ends)) if ends else end
