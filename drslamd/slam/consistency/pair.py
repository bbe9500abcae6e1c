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

from drslamd.conventions import Chain, Segment
from drslamd.slam.consistency.candidates import candidates, decided
from drslamd.slam.consistency.checked import Checked, extended
from drslamd.slam.consistency.pcm import Candidate, PairConsistency
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.relative_pose.estimate import RelativePoseEstimate
from drslamd.slam.relative_pose.mistakes.mounting_search import MOVED_M, MountingSearch
from drslamd.slam.relative_pose.mistakes.what_if import MIRROR, Case, is_corrected, is_curve
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relative_pose.range_sampler import RangeSampler
from drslamd.slam.relative_pose.window_request import WindowRequest
from drslamd.slam.se2 import Array

FEWEST_KEPT = 2
"""Closures that agree before it is asked whether the pair is mounted as configured."""
PENDING = 8
"""Estimates that wait for module 2, which runs as often as module 1 by default."""
HISTORY = 2_000
"""Answers of module 1 that can be asked for: half an hour at one a second, 1 MB."""
TELL_EVERY = 100
"""Grid samples between closures that are sent when the graph's edges are the ranges."""
UNCORRECTED = (Correction(), Correction())
ANOTHER_WAY, OVER_A_WAY = 0.03, np.array(Correction(scale=1.0, yaw=10.0, turn=1.0))
"""Corrections that differ by more lead to ways that do not agree; yaw rates act over ten metres."""


@dataclass(frozen=True)
class Agreement:
    """When a pair counts as connected.

    Attributes:
        least: so many closures must agree.
        outnumber: and be so many times the largest set that contradicts them; 0 asks for nothing.
        confirms: and must windows exclude that wheels run backwards?
        decides: evidence with which a window decides for its best pose, see `Checked.rivals`.
    """

    least: int
    outnumber: int
    confirms: bool
    decides: float = np.inf


@dataclass(frozen=True)
class WindowAnswer:
    """What module 1 said of one window, for whoever wants to know why."""

    number: int
    utime: int
    estimate: RelativePoseEstimate


class PairTracker:
    """The state of one owned pair.

    Attributes:
        verdicts: how many windows came to which verdict; last_verdict: of the latest.
        history: answers of module 1, oldest first.
        kept: closures of the consistent set, as module 2 last left it.
        agreement: when they are believed.
        connected: are they?
        search: for mistakes in the mountings, where windows disagree.
    """

    def __init__(
        self,
        peer: Chain,
        ranges: RangeBuffer,
        sampler: RangeSampler,
        epsilon: float,
        agreement: Agreement,
    ) -> None:
        """
        Args:
            epsilon: significance of equation (3).
        """
        self.peer, self.ranges, self.sampler = peer, ranges, sampler
        self._epsilon, self.agreement = epsilon, agreement
        self.verdicts: Counter[str] = Counter()
        self.last_verdict = ""
        self.history: deque[WindowAnswer] = deque(maxlen=HISTORY)
        self.closures_seen, self.connected = 0, False
        self.kept: tuple[ClosureMeasurement, ...] = ()
        self.search = MountingSearch()
        self._checked: Checked | None = None
        self._is_busy = False
        self._is_obsolete = False
        self._corrections = UNCORRECTED
        self._segments: tuple[Segment, Segment] | None = None
        self._pending: deque[tuple[int, WindowRequest, RelativePoseEstimate]]
        self._pending = deque(maxlen=PENDING)
        self._told: dict[int, ClosureMeasurement] = {}
        self._withdrawn: list[ClosureMeasurement] = []
        self._kept_before: set[int] = set()
        self._number = 0

    # module 1

    def count(self, verdict: str) -> None:
        """Remember what became of a window."""
        self.verdicts[verdict] += 1
        self.last_verdict = verdict

    def on_estimate(self, request: WindowRequest, estimate: RelativePoseEstimate) -> None:
        """Module 1 has answered."""
        self.count(estimate.verdict.value)
        self.search.on_verdict(estimate.verdict)
        self.history.append(WindowAnswer(self._number, request.utime, estimate))
        if estimate.hypotheses:
            self.closures_seen += 1
            self._pending.append((self._number, request, estimate))
            self._number += 1

    @property
    def is_told(self) -> bool:
        """Does the team know of the pair?"""
        return bool(self._told)

    @property
    def is_refused(self) -> bool:
        """Is a robot of the pair wired so that nothing of the pair can be believed?"""
        found = self.search.found
        return found is not None and not is_corrected(found)

    @property
    def is_mirrored(self) -> bool:
        """Does one of both robots turn the other way?"""
        return self.search.found == MIRROR

    @property
    def awaits_confirmation(self) -> bool:
        """Would it be connected if it was known to be mounted as configured?"""
        return len(self.kept) >= FEWEST_KEPT and not self.connected

    def on_costs(self, request: WindowRequest, costs: Array, way_m: float) -> None:
        """A search for mistakes has answered.

        Args:
            way_m: how far the robot drove that drove less.
        """
        before, asked = self.search.found, self.search.cases
        if self.search.on_costs(costs, len(request.window), way_m > MOVED_M):
            now = self.search.found
            is_another = before is None or now is None or now.kind != before.kind
            if is_another and not self._is_learned_curve(now or asked[int(np.argmin(costs))]):
                # what was told with another mounting is worth nothing
                self._withdrawn += [replace(m, kept=False) for m in self._told.values()]
                self._told.clear()
            self._pending.clear()
            self._checked, self.connected, self.kept = None, False, ()
            self._is_obsolete = self._is_busy
        self._judge()

    def _is_learned_curve(self, likeliest: Case) -> bool:
        """Does a curve explain windows that module 3 has learned from what was told?"""
        return is_curve(likeliest) and any(one.yaw for one in self._corrections)

    # module 2

    def begin_check(
        self,
        own: ChainData,
        peer: ChainData,
        noise: OdometryNoise,
        known: tuple[Correction, Correction] | None = None,
    ) -> Callable[[], Checked] | None:
        """Module 2 on what came in since; the pair's set belongs to the job until `on_check`.

        Args:
            known: of our odometry and the peer's; what was known before where nothing is said.
        """
        if self._is_busy:
            return None
        if known is not None and _differ(known, self._corrections):
            self._corrections = known
            self._begin_anew()
        work: list[tuple[Candidate, ClosureMeasurement]] = []
        sure: dict[int, float] = {}
        while self._pending:
            number, request, estimate = self._pending.popleft()
            segments = (
                Segment(*own.chain, request.a.segment),
                Segment(*peer.chain, request.b.segment),
            )
            if segments != self._segments:
                # odometry broke: what was kept stays in the graph, a new set begins
                self._segments, work = segments, []
                sure.clear()
                self._begin_anew()
            work += candidates(number, request, estimate, own, peer, self._corrections)
            sure[number] = decided(estimate, len(request.window) - 3)
        if not work or self._segments is None:
            return None
        checked = self._checked
        if checked is None:
            consistency = PairConsistency(noise, peer.model.noise, self._epsilon)
            checked = Checked(self._segments, consistency, [], {})
        else:
            checked.renew_sums(own, peer, self._corrections)
        self._is_busy, self._checked = True, None
        return partial(extended, checked, work, sure)

    def _begin_anew(self) -> None:
        """What is kept now stays in the graph, a new set begins."""
        self._kept_before = self.accepted() if self.connected else self._kept_before
        self._checked, self.connected, self.kept = None, False, ()

    def on_check(self, checked: Checked) -> None:
        """Module 2 has answered: is the pair connected now?"""
        self._is_busy = False
        if self._is_obsolete:
            self._is_obsolete = False
            return
        self._checked, self.kept = checked, checked.kept()
        self._judge()

    def _judge(self) -> None:
        """Is the pair connected now?"""
        checked = self._checked
        if checked is None:
            return
        enough = len(self.kept) >= self.agreement.least
        if self.connected and enough:
            return
        # the rivals are searched last: that takes a while
        agreement = self.agreement
        rivals = agreement.outnumber and checked.rivals(agreement.decides)
        outnumbers = len(self.kept) >= agreement.outnumber * rivals
        is_sure = self.search.is_confirmed or not agreement.confirms
        self.connected = enough and outnumbers and is_sure and not self.search.disagrees

    def accepted(self) -> set[int]:
        """Numbers of all closures that are kept, of earlier segments too, back to `history`."""
        oldest = self.history[0].number if self.history else 0
        now = {m.number for m in self.kept}
        return {number for number in self._kept_before | now if number >= oldest}

    # what the team hears

    def tell(self, every: bool) -> list[ClosureMeasurement]:
        """Take what the team must hear: closures that are now kept, those that no longer are.

        Args:
            every: closures are the graph's edges, so each one counts; otherwise one in a while
                tells where the peer is and the ranges do the rest.
        """
        gone, self._withdrawn = self._withdrawn, []
        if self._checked is None:
            return gone
        believed = self.connected and not self.is_refused
        if every and self.is_mirrored:
            # module 3 has no ranges, and knows no way but the one that odometry tells
            believed = False
        kept = {m.number: m for m in self.kept} if believed else {}
        remembered = min((m.number for m in self._checked.measurements), default=0)
        answered = self.history[0].number if self.history else 0
        gone += [
            replace(m, kept=False)
            for number, m in self._told.items()
            if number >= remembered and kept.get(number) != m
        ]
        recent = max((told.a_n for told in self._told.values()), default=-TELL_EVERY)
        withdrawn = {m.number for m in gone}
        self._told = {
            number: m
            for number, m in self._told.items()
            if number not in withdrawn and (number >= min(remembered, answered) or m.a_n == recent)
        }
        new: list[ClosureMeasurement] = []
        recent = max((told.a_n for told in self._told.values()), default=-TELL_EVERY)
        if kept and not (self._told or every):
            # module 3 begins there: the newest window holds what earlier ones held, and more
            kept = dict([max(kept.items())])
        for number, m in kept.items():
            if number not in self._told and (every or m.a_n - recent >= TELL_EVERY):
                new.append(m)
                self._told[number] = m
                recent = max(recent, m.a_n)
        return gone + new


def _differ(one: tuple[Correction, Correction], other: tuple[Correction, Correction]) -> bool:
    apart = (np.array(one) - np.array(other)) * OVER_A_WAY
    return bool(np.abs(apart).max() > ANOTHER_WAY)
