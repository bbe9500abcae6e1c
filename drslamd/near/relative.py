"""Peers as they are seen from where we are now, with the covariance of both ends together.

Of two robots the solution knows more than of each: where both are wrong alike, they are right
about each other. So what is told of a pair comes from their joint covariance, carried to the end
of both legs, and is smaller where sensors were seen to be better than configured
(`TeamEstimate.narrow`). With errors a (ours) and b of x, y, theta in w, d the way from us to the
peer, and

    S = [1 0 -dy; 0 1 dx; 0 0 1]

the relative pose is wrong by R(-theta) (b - S a). Our own leg moves fifty times a second, but S F,
from its start, does not: so all but the noise of our own leg is worked out once for each solution
and each news of a peer, here for all peers together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drslamd.near.leg import Leg
from drslamd.near.packed import Packed, added_up, moved, turned
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.se2 import Array

FEW = 8
"""Peers, of whom plain numbers are faster than rows of an array."""
UPPER = np.triu_indices(3)
"""Of a matrix of three by three, in the order of packed covariances."""


@dataclass(frozen=True)
class Relatives:
    """m peers in w, as uncertain as they are for us, the noise of our leg left out.

    Attributes:
        poses: (m, 3) w_T_b.
        known: (6, m) covariance of b - S a, xx xy xt yy yt tt in the axes of w.
    """

    poses: Array
    known: Array

    @cached_property
    def _numbers(self) -> list[tuple[list[float], list[float]]]:
        """Pose and packed covariance of each peer."""
        return list(zip(self.poses.tolist(), self.known.T.tolist(), strict=True))

    def seen_from(self, pose: Sequence[float], added: Packed) -> tuple[Array, Array]:
        """(m, 3) a_T_b, and (6, m) its covariance in the axes of a.

        Args:
            pose: w_T_a.
            added: what our leg adds to its covariance, packed.
        """
        if len(self.poses) <= FEW:
            return self._few_seen_from(pose, added)
        x, y, theta = pose
        cos, sin = math.cos(theta), math.sin(theta)
        away = self.poses - (x, y, theta)
        seen = np.empty_like(away)
        dx, dy, turn = away.T
        seen[:, 0], seen[:, 1] = cos * dx + sin * dy, cos * dy - sin * dx
        seen[:, 2] = se2.wrap(turn)
        # `moved` and `turned` are linear in covariances: each is one product for all peers
        powers = np.empty((6, len(away)))
        powers[0], powers[1], powers[2] = 1.0, dx, dy
        np.multiply(powers[1:3], dx, out=powers[3:5])
        np.multiply(dy, dy, out=powers[5])
        here = self.known + np.array(_moves(added)) @ powers
        return seen, np.array(_turns(cos, sin)) @ here

    def _few_seen_from(self, pose: Sequence[float], added: Packed) -> tuple[Array, Array]:
        """The same one by one, in plain numbers."""
        x, y, theta = pose
        cos, sin = math.cos(theta), math.sin(theta)
        seen, covariances = [], []
        for (b_x, b_y, b_theta), known in self._numbers:
            dx, dy = b_x - x, b_y - y
            turn = _wrapped(b_theta - theta)
            seen.append((cos * dx + sin * dy, cos * dy - sin * dx, turn))
            covariances.append(turned(added_up(known, moved(added, dx, dy)), cos, sin))
        of_each: Array = np.array(covariances).reshape(-1, 6)
        return np.array(seen).reshape(-1, 3), np.ascontiguousarray(of_each.T)


def _moves(packed: Packed) -> list[tuple[float, ...]]:
    """(6, 6) `packed.moved` by d, as factors of 1, dx, dy, dx dx, dx dy, dy dy."""
    xx, xy, xt, yy, yt, tt = packed
    return [
        (xx, 0.0, -2 * xt, 0.0, 0.0, tt),
        (xy, xt, -yt, 0.0, -tt, 0.0),
        (xt, 0.0, -tt, 0.0, 0.0, 0.0),
        (yy, 2 * yt, 0.0, tt, 0.0, 0.0),
        (yt, tt, 0.0, 0.0, 0.0, 0.0),
        (tt, 0.0, 0.0, 0.0, 0.0, 0.0),
    ]


def _turns(cos: float, sin: float) -> list[tuple[float, ...]]:
    """(6, 6) `packed.turned`, by which packed covariances are multiplied."""
    cc, cs, ss = cos * cos, cos * sin, sin * sin
    return [
        (cc, 2 * cs, 0.0, ss, 0.0, 0.0),
        (-cs, cc - ss, 0.0, cs, 0.0, 0.0),
        (0.0, 0.0, cos, 0.0, sin, 0.0),
        (ss, -2 * cs, 0.0, cc, 0.0, 0.0),
        (0.0, 0.0, -sin, 0.0, cos, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
    ]


def _wrapped(angle: float) -> float:
    """`se2.wrap` of one number."""
    wrapped = math.pi - (math.pi - angle) % (2 * math.pi)
    return wrapped if wrapped > -math.pi else math.pi


def relatives(estimate: TeamEstimate, own: int, leg: Leg, legs: dict[int, Leg]) -> Relatives:
    """Peers of which something is known together with us.

    Args:
        leg: our own, from our last solved pose; legs: of the peers, in the order that is kept.
    """
    poses = np.array([peer.end for peer in legs.values()]).reshape(-1, 3)
    if not legs:
        return Relatives(poses, np.zeros((6, 0)))
    joints = [estimate.joint_of(own, robot) for robot in legs]
    joint = np.stack([found for found in joints if found is not None])
    across, along = (np.tile(np.eye(3), (len(legs), 1, 1)) for _ in range(2))
    across[:, 0, 2], across[:, 1, 2] = leg.start[1] - poses[:, 1], poses[:, 0] - leg.start[0]
    levers = np.array([peer.lever for peer in legs.values()])
    along[:, 0, 2], along[:, 1, 2] = -levers[:, 1], levers[:, 0]
    j = np.concatenate([-across, along], axis=2)
    times = np.array([estimate.narrow(own, robot) for robot in legs])
    known = times[:, None, None] * (j @ joint @ np.swapaxes(j, 1, 2))
    added = np.array([peer.added for peer in legs.values()]).T
    return Relatives(poses, known[:, UPPER[0], UPPER[1]].T + added)
