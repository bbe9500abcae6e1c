"""From the answer of one window to candidates of module 2, at the keyframes that stand for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drslamd.slam import se2
from drslamd.slam.chi_squared import evidence
from drslamd.slam.consistency.pcm import Candidate
from drslamd.slam.graph.chain_data import ChainData
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.odometry.noise import MIRRORED_SUMS
from drslamd.slam.relative_pose.estimate import RelativePoseEstimate
from drslamd.slam.relative_pose.pair_end import Anchor, at_keyframes
from drslamd.slam.relative_pose.window_request import WindowRequest
from drslamd.slam.se2 import Array

SHRINK = 1e-4
"""Of correlations, before rounding: far above a rounding of 6e-8, far below what anyone knows."""


def candidates(
    number: int,
    request: WindowRequest,
    estimate: RelativePoseEstimate,
    own: ChainData,
    peer: ChainData,
    corrections: tuple[Correction, Correction],
) -> list[tuple[Candidate, ClosureMeasurement]]:
    """Every hypothesis of one window, best first; none while a keyframe of it is not held.

    Args:
        number: of the window.
        corrections: of our odometry and the peer's.
    """
    a, a_there = own.keyframes.find(np.array([float(request.a.n)]))
    b, b_there = peer.keyframes.find(np.array([float(request.b.n)]))
    if not (a_there[0] and b_there[0]):
        return []
    a_pose, b_pose = (
        correction.path(data.keyframes.poses[: row[0] + 1])[-1]
        for correction, data, row in zip(corrections, (own, peer), (a, b), strict=True)
    )
    sums = (own.sums[a[0]], peer.sums[b[0]])
    a_sums, b_sums = map(corrected_sums, corrections, sums)
    a_end, b_end = map(_corrected_anchor, corrections, (request.a, request.b))
    scales, turns = zip(*((c.scale, c.turn) for c in corrections), strict=True)
    out = []
    for hypothesis in estimate.hypotheses:
        pose, covariance = at_keyframes(hypothesis.a_T_b, hypothesis.covariance, a_end, b_end)
        x, y, theta = pose.tolist()
        measurement = ClosureMeasurement(
            number=number,
            kept=True,
            a_n=request.a.n,
            peer=peer.chain,
            b_n=request.b.n,
            a_T_b=(x, y, theta),
            covariance=se2.packed(sendable(covariance)),
            corrected=(scales[0], turns[0], scales[1], turns[1]),
        )
        candidate = Candidate(
            closure=number,
            a_T_b=pose,
            covariance=covariance,
            a_pose=a_pose,
            b_pose=b_pose,
            a_sums=a_sums,
            b_sums=b_sums,
        )
        out.append((candidate, measurement))
    return out


def corrected_sums(correction: Correction, sums: Array) -> Array:
    """(..., 13) `noise.growth` along a chain, of its mirror image if that is the way."""
    return sums * MIRRORED_SUMS if correction.is_mirrored else sums


def _corrected_anchor(correction: Correction, known: Anchor) -> Anchor:
    """Where a body was, seen from its keyframe."""
    way = np.stack([np.zeros(3), known.keyframe_T_body])
    return replace(known, keyframe_T_body=correction.path(way)[-1])


def decided(estimate: RelativePoseEstimate, freedom: int) -> float:
    """The evidence of one window for its best hypothesis against each of its others; infinite where
    there are none.

    Args:
        freedom: degrees of its chi-squared.
    """
    best, others = estimate.hypotheses[0].chi2, estimate.hypotheses[1:]
    return min((evidence(h.chi2 - best, best, freedom) for h in others), default=np.inf)


def sendable(covariance: Array) -> Array:
    """A covariance that is still one when its six numbers are rounded to 32 bits.

    Directions that a window hardly fixes beside others that it fixes well would make it singular.
    """
    return np.asarray(covariance * (1 - SHRINK) + np.diag(np.diag(covariance)) * SHRINK)
