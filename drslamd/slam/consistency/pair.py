"""One pair of robots as its owner sees it: what module 1 found, what module 2 kept, what is said.

The owner is the robot with the lower id, or the other one when the lower one measures no ranges
(both modules measure the same path; using both would count the same bias twice).
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from drslamd.config import Config
from drslamd.conventions import Chain, Segment
from drslamd.slam import se2
from drslamd.slam.consistency.pcm import Candidate, PairConsistency
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.graph.pose_graph import ChainData
from drslamd.slam.odometry.track import OdometryNoise
from drslamd.slam.relative_pose.pair_window import RangeSampler, Request, at_keyframes
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relative_pose.solver import RelativePoseEstimate
from drslamd.slam.se2 import Array

AGREEING = 5
"""Closures that must agree before the pair counts as connected."""
OUTNUMBER = 2
"""And they must be so many times the largest set that contradicts them."""
PENDING = 8
"""Estimates that wait for module 2, which runs as often as module 1 by default."""
HISTORY = 2_000
"""Answers of module 1 that can be asked for: half an hour at one a second, 1 MB."""
TELL_EVERY = 100
"""Grid samples between closures that are sent when the graph's edges are the ranges."""
SHRINK = 1e-4
"""Of correlations, before rounding: far above a rounding of 6e-8, far below what anyone knows."""


@dataclass(frozen=True)
class WindowAnswer:
    """What module 1 said of one window, for whoever wants to know why."""

    number: int
    utime: int
    estimate: RelativePoseEstimate


@dataclass
class Checked:
    """Module 2 has run: the consistent set, and whose hypothesis each of its vertices is."""

    segments: tuple[Segment, Segment]
    consistency: PairConsistency
    items: list[ClosureMeasurement]

    def renew_sums(self, own: ChainData, peer: ChainData) -> None:
        """Keyframes that came late may lie between those of the candidates."""
        a, a_there = own.find(np.array([item.a_n for item in self.items]))
        b, b_there = peer.find(np.array([item.b_n for item in self.items]))
        both = a_there & b_there
        self.consistency.renew_sums(np.flatnonzero(both), own.sums[a[both]], peer.sums[b[both]])


class PairTracker:
    """The state of one owned pair."""

    def __init__(self, config: Config, peer: Chain, ranges: RangeBuffer) -> None:
        self._config = config
        self.peer = peer
        self.ranges = ranges
        self.range_items = RangeSampler(config.relative_pose.range_sigma_m)
        self.verdicts: Counter[str] = Counter()
        self.last_verdict = ""
        self.history: deque[WindowAnswer] = deque(maxlen=HISTORY)
        self.closures_seen = 0
        self.established = False
        self.checked: Checked | None = None
        self._busy = False
        self._segments: tuple[Segment, Segment] | None = None
        self._pending: deque[tuple[int, Request, RelativePoseEstimate]] = deque(maxlen=PENDING)
        self._said: dict[int, ClosureMeasurement] = {}
        self._kept_before: set[int] = set()
        self._number = 0

    def count(self, verdict: str) -> None:
        """Remember what became of a window."""
        self.verdicts[verdict] += 1
        self.last_verdict = verdict

    def estimated(self, request: Request, estimate: RelativePoseEstimate) -> None:
        """Module 1 has answered."""
        self.count(estimate.verdict.value)
        self.history.append(WindowAnswer(self._number, request.utime, estimate))
        if estimate.hypotheses:
            self.closures_seen += 1
            self._pending.append((self._number, request, estimate))
            self._number += 1

    def check(
        self, own: ChainData, peer: ChainData, noise: OdometryNoise
    ) -> Callable[[], Checked] | None:
        """Module 2 on what came in since; the pair's set belongs to the job until `settle`."""
        if self._busy:
            return None
        work: list[tuple[Candidate, ClosureMeasurement]] = []
        while self._pending:
            number, request, estimate = self._pending.popleft()
            segments = (
                Segment(*own.chain, request.a.segment),
                Segment(*peer.chain, request.b.segment),
            )
            if segments != self._segments:
                # odometry broke: what was kept stays in the graph, a new set begins
                self._kept_before = self.accepted() if self.established else self._kept_before
                self._segments, self.checked, self.established, work = segments, None, False, []
            work += self._candidates(number, request, estimate, own, peer)
        if not work or self._segments is None:
            return None
        checked = self.checked
        if checked is None:
            epsilon = self._config.consistency.epsilon
            checked = Checked(self._segments, PairConsistency(noise, peer.noise, epsilon), [])
        else:
            checked.renew_sums(own, peer)
        self._busy, self.checked = True, None
        return partial(extended, checked, work)

    def _candidates(
        self,
        number: int,
        request: Request,
        estimate: RelativePoseEstimate,
        own: ChainData,
        peer: ChainData,
    ) -> list[tuple[Candidate, ClosureMeasurement]]:
        """Every hypothesis of one window, at its two keyframes."""
        a, a_there = own.find(np.array([float(request.a.n)]))
        b, b_there = peer.find(np.array([float(request.b.n)]))
        if not (a_there[0] and b_there[0]):
            return []
        ends = (own.poses[a[0]], peer.poses[b[0]], own.sums[a[0]], peer.sums[b[0]])
        out = []
        for hypothesis in estimate.hypotheses:
            pose, covariance = at_keyframes(
                hypothesis.a_T_b, hypothesis.covariance, request.a, request.b
            )
            x, y, theta = pose.tolist()
            item = ClosureMeasurement(
                number, True, request.a.n, self.peer, request.b.n,
                (x, y, theta), se2.packed(sendable(covariance)),
            )  # fmt: skip
            out.append((Candidate(number, pose, covariance, *ends), item))
        return out

    def settle(self, checked: Checked) -> None:
        """Module 2 has answered: is the pair connected now?"""
        self._busy = False
        self.checked = checked
        kept = len(checked.consistency.kept_vertices())
        if self._config.relative_pose.algorithm == "paper":
            self.established = kept >= 2
        elif not self.established or kept < AGREEING:
            # the rivals are searched last: that takes a while
            self.established = kept >= AGREEING and kept >= OUTNUMBER * checked.consistency.rivals()

    def accepted(self) -> set[int]:
        """Numbers of all closures that are kept, of earlier segments too, back to `history`."""
        oldest = self.history[0].number if self.history else 0
        now = {item.number for item in self.kept()}
        return {number for number in self._kept_before | now if number >= oldest}

    def kept(self) -> list[ClosureMeasurement]:
        """Closures of the consistent set."""
        if self.checked is None:
            return []
        return [self.checked.items[v] for v in self.checked.consistency.kept_vertices()]

    def news(self, every: bool) -> list[ClosureMeasurement]:
        """What the team must hear: closures that are now kept, and those that no longer are.

        Args:
            every: closures are the graph's edges, so each one counts; otherwise one in a while
                tells where the peer is and the ranges do the rest.
        """
        if self.checked is None:
            return []
        kept = {item.number: item for item in self.kept()} if self.established else {}
        remembered = min((item.number for item in self.checked.items), default=0)
        gone = [
            replace(item, kept=False)
            for number, item in self._said.items()
            if number >= remembered and kept.get(number) != item
        ]
        recent = max((said.a_n for said in self._said.values()), default=-TELL_EVERY)
        withdrawn = {item.number for item in gone}
        self._said = {
            number: item
            for number, item in self._said.items()
            if number not in withdrawn and (number >= remembered or item.a_n == recent)
        }
        new: list[ClosureMeasurement] = []
        recent = max((said.a_n for said in self._said.values()), default=-TELL_EVERY)
        for number, item in kept.items():
            if number not in self._said and (every or item.a_n - recent >= TELL_EVERY):
                new.append(item)
                self._said[number] = item
                recent = max(recent, item.a_n)
        return gone + new


def sendable(covariance: Array) -> Array:
    """A covariance that is still one when its six numbers are rounded to 32 bits.

    Directions that a window hardly fixes beside others that it fixes well would make it singular.
    """
    return np.asarray(covariance * (1 - SHRINK) + np.diag(np.diag(covariance)) * SHRINK)


def extended(checked: Checked, work: list[tuple[Candidate, ClosureMeasurement]]) -> Checked:
    """Equation 2 for each new hypothesis."""
    for candidate, item in work:
        forgotten = checked.consistency.forgotten
        checked.consistency.add(candidate)
        del checked.items[: checked.consistency.forgotten - forgotten]
        checked.items.append(item)
    return checked
