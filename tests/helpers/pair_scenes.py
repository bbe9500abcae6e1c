"""Two robots side by side: what windows are cut from, and what module 1 answers about them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drslamd.conventions import GRID_US, Chain
from drslamd.slam.consistency.pair import Agreement, PairTracker
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import ClosureMeasurement, Keyframe
from drslamd.slam.odometry.track import Track
from drslamd.slam.relative_pose.estimate import Hypothesis, RelativePoseEstimate, Verdict
from drslamd.slam.relative_pose.pair_end import Anchor, PairEnd
from drslamd.slam.relative_pose.range_buffer import RangeBuffer
from drslamd.slam.relative_pose.range_sampler import RangeSampler
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.relative_pose.window_request import WindowRequest
from drslamd.slam.se2 import Array

LAST = 200
BESIDE = (0.0, 3.0, 0.0)
"""Where b is in the frame of a all the time; closures that say so agree."""
MIRRORED = (0.0, -3.0, 0.0)
"""What else the ranges allow; closures that say so agree with each other alone."""

FIT = 5.0
"""Chi-squared of windows at their best."""

_NOTHING = np.zeros((0, 3))
EMPTY_WINDOW = Window(
    _NOTHING[:, 0], _NOTHING[:, 0], _NOTHING, _NOTHING, _NOTHING[0:0, :2], _NOTHING[0:0, :2]
)
"""For answers that are made up."""


def moving_end(robot: int) -> PairEnd:
    """A robot that drives along x at 0.1 m a sample, with a keyframe a second."""
    track, data = Track(1000), ChainData(Chain(robot, 1))
    for n in range(LAST + 1):
        track.append(n, np.array([1000.0 * n, 0.0, 0.0]))
        if n % 10 == 0:
            data.add(Keyframe(n, 0, 1000 * n, 0, 0))
    return PairEnd(track, data)


def weak_paths(gap_db: float, blocked_share: float) -> RangeBuffer:
    """5 m in sight; every so often a range that is 1 m too long and has this power gap."""
    ranges = RangeBuffer(nlos_db=10.0)
    period = 10
    for n in range(LAST + 1):
        wrong = n % period < blocked_share * period
        ranges.add(n * GRID_US, 6.0 if wrong else 5.0, gap_db if wrong else 3.0)
    return ranges


def asked_at(
    n: int,
    segments: tuple[int, int] = (0, 0),
    bodies: tuple[Sequence[float], Sequence[float]] = ((0, 0, 0), (0, 0, 0)),
) -> WindowRequest:
    """A window that asks for the pose at keyframe n of both robots.

    Args:
        bodies: where the robots were, seen from these keyframes.
    """
    a, b = (Anchor(n, s, np.array(at, float)) for s, at in zip(segments, bodies, strict=True))
    return WindowRequest(EMPTY_WINDOW, n * GRID_US, a, b)


def estimate_of(
    *poses: Sequence[float] | Array, covariance: Array | None = None, worse: float = 0.0
) -> RelativePoseEstimate:
    """Module 1 cannot exclude these poses, which it knows to 5 cm and 0.05 rad.

    Args:
        worse: chi-squared of all but the first, less that of the first.
    """
    spread = 0.05**2 * np.eye(3) if covariance is None else covariance
    verdict = (Verdict.UNOBSERVABLE, Verdict.UNIQUE, Verdict.AMBIGUOUS)[min(len(poses), 2)]
    return RelativePoseEstimate(
        verdict,
        tuple(
            Hypothesis(np.array(pose, float), spread, FIT + worse * (place > 0))
            for place, pose in enumerate(poses)
        ),
    )


def tracker(peer: Chain, agreement: Agreement, epsilon: float = 0.1) -> PairTracker:
    return PairTracker(peer, RangeBuffer(), RangeSampler(0.1), epsilon, agreement)


class OwnedPair:
    """Robot 0 owns the pair with robot 1; both drive as `moving_end` has it."""

    def __init__(self, agreement: Agreement, epsilon: float = 0.1) -> None:
        self.own, self.peer = moving_end(0).data, moving_end(1).data
        self.tracker = tracker(self.peer.chain, agreement, epsilon)

    def answer(
        self,
        n: int,
        *poses: Sequence[float],
        segments: tuple[int, int] = (0, 0),
        worse: float = 0.0,
    ) -> WindowRequest:
        """Module 1 on one window: its poses at keyframe n; without any the window said nothing."""
        request = asked_at(n, segments)
        self.tracker.on_estimate(request, estimate_of(*poses, worse=worse))
        return request

    def confirm(self) -> None:
        """Windows have excluded that wheels run backwards."""
        self.tracker.search.is_confirmed = True

    def check(self) -> None:
        """Module 2 on all that waits for it."""
        run = self.tracker.begin_check(self.own, self.peer, self.own.model.noise)
        assert run is not None
        self.tracker.on_check(run())

    def see(self, pose: Sequence[float], count: int, first: int = 10) -> None:
        """So many windows in a row that found this pose, one at each keyframe."""
        for n in range(first, first + 10 * count, 10):
            self.answer(n, pose)
            self.check()

    def kept(self) -> list[int]:
        return [m.number for m in self.tracker.kept]

    def told(self, every: bool = True) -> list[tuple[int, bool]]:
        """Numbers of what the team hears now, and whether each is kept."""
        return [(m.number, m.kept) for m in self.measurements(every)]

    def measurements(self, every: bool = True) -> list[ClosureMeasurement]:
        return self.tracker.tell(every)
