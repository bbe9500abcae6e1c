"""The places that are left of a peer, out of what module 1 answered last for the pair.

The newest window holds what earlier ones held, and more, so its hypotheses are what is left. They
are carried on by the peer's odometry into the frame of our own, which does not move. Two that are
the same within what is known of them are one place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drslamd.conventions import GRID_US, SECOND_US
from drslamd.slam import se2
from drslamd.slam.chi_squared import quantile3
from drslamd.slam.consistency.pair import PairTracker, WindowAnswer
from drslamd.slam.hypotheses.deciding_motion import DecidingMotion, deciding_motion
from drslamd.slam.pose_now import carried
from drslamd.slam.relative_pose.estimate import Hypothesis
from drslamd.slam.relative_pose.pair_end import PairEnd
from drslamd.slam.se2 import Array

HELD_US = 10 * SECOND_US
"""An older answer is none of now; windows that say nothing may come between."""
SAME = quantile3(0.99)
"""Squared distance of two poses, in units of their covariances: nearer they are one."""


@dataclass(frozen=True)
class PossiblePlace:
    """Where a peer may be.

    Attributes:
        peer: its robot.
        utime: when it was there, us on our clock.
        share: how likely, against the other places of that peer; they add up to 1.
        pose: o_T_b, x, y, theta in the frame of our odometry, m and rad.
        covariance: xx xy xt yy yt tt in its axes, as seen from where we were.
    """

    peer: int
    utime: int
    share: float
    pose: tuple[float, float, float]
    covariance: tuple[float, ...]


@dataclass(frozen=True)
class PlacesLeft:
    """Of one peer: its places, the likeliest first, and what would decide between several."""

    places: tuple[PossiblePlace, ...]
    motion: DecidingMotion | None


def places_left(pair: PairTracker, a: PairEnd, b: PairEnd, sigma: float) -> PlacesLeft | None:
    """None where the pair is connected, or one of it is wired wrongly, or module 1 has not named
    any place of late.

    Args:
        a, b: our end of the pair, and the peer's; sigma: of a range, m.
    """
    if pair.connected or pair.is_mirrored or pair.is_refused:
        return None
    answer = next((w for w in reversed(pair.history) if w.estimate.hypotheses), None)
    if answer is None:
        return None
    now = min(a.last_us, b.last_us)
    since = max(a.first_us, b.first_us)
    if not since <= answer.utime <= now <= answer.utime + HELD_US:
        return None
    places = _apart(_carried(pair.peer.robot, answer, a, b, now))
    return PlacesLeft(tuple(places), _decision(places, a, sigma) if len(places) > 1 else None)


def _carried(
    robot: int, answer: WindowAnswer, a: PairEnd, b: PairEnd, now: int
) -> list[PossiblePlace]:
    """Every hypothesis of a window, the likeliest first, at a later time of our clock."""
    hypotheses, o_T_a = answer.estimate.hypotheses, a.poses(answer.utime)[0]
    chi2 = np.array([h.chi2 for h in hypotheses])
    likely = np.exp((chi2.min() - chi2) / 2)
    way = b.poses(np.append(np.arange(answer.utime, now, GRID_US, dtype=float), now))
    step, noise = se2.between(way[:1], way), b.data.model.noise
    found = []
    for hypothesis, share in zip(hypotheses, (likely / likely.sum()).tolist(), strict=True):
        start = se2.compose(o_T_a, hypothesis.a_T_b)
        x, y, theta = se2.compose(start, step[-1]).tolist()
        known = se2.turned(_positive(hypothesis), o_T_a[2])
        covariance = carried(known, float(start[2]), step, noise, level=1.0)
        pose = (x, y, float(se2.wrap(theta)))
        found.append(PossiblePlace(robot, now, share, pose, se2.packed(covariance)))
    return found


def _positive(hypothesis: Hypothesis) -> Array:
    return np.asarray(hypothesis.covariance + hypothesis.covariance.T) / 2


def _apart(places: list[PossiblePlace]) -> list[PossiblePlace]:
    """Those that differ from all likelier ones; the others count as these."""
    kept: list[PossiblePlace] = []
    for place in places:
        same = next((k for k, other in enumerate(kept) if _is_same(place, other)), None)
        if same is None:
            kept.append(place)
        else:
            kept[same] = replace(kept[same], share=kept[same].share + place.share)
    return kept


def _is_same(one: PossiblePlace, other: PossiblePlace) -> bool:
    off = np.array(one.pose) - np.array(other.pose)
    off[2] = se2.wrap(off[2])
    both = se2.unpacked(one.covariance) + se2.unpacked(other.covariance)
    return bool(off @ np.linalg.solve(both, off) < SAME)


def _decision(places: list[PossiblePlace], a: PairEnd, sigma: float) -> DecidingMotion | None:
    """What we can do, or the peer, if that leaves fewer places."""
    o_T_b = np.array([place.pose for place in places])
    known = se2.unpacked(np.array([place.covariance for place in places]))
    peer, own, o_T_a = places[0].peer, a.data.chain.robot, a.track.at(a.track.end - 1)
    a_T_b = se2.between(o_T_a[None], o_T_b)
    known = se2.turned(known, -o_T_a[2])
    b_T_a = se2.inverse(a_T_b)
    seen = np.array([_from_there(*each) for each in zip(a_T_b, b_T_a, known, strict=True)])
    found = (
        deciding_motion(peer, own, a_T_b[:, :2], known[:, :2, :2], sigma),
        deciding_motion(peer, peer, b_T_a[:, :2], seen, sigma),
    )
    return min((m for m in found if m is not None), key=lambda m: m.leaves, default=None)


def _from_there(a_T_b: Array, b_T_a: Array, covariance: Array) -> Array:
    """(2, 2) covariance of the place of a in frame b, of that (3, 3) of b's pose in frame a."""
    cos, sin = np.cos(a_T_b[2]), np.sin(a_T_b[2])
    by_pose = np.array([[-cos, -sin, b_T_a[1]], [sin, -cos, -b_T_a[0]]])
    return np.asarray(by_pose @ covariance @ by_pose.T)
