"""What is kept of a solution for the next one, beside where everybody is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drslamd.conventions import GRID_HZ
from drslamd.slam.calibration.range_scatter import LEAST_SCATTER
from drslamd.slam.optimizer.banded.banded_optimizer import TeamProblem
from drslamd.slam.optimizer.banded.odometry_levels import raised
from drslamd.slam.optimizer.banded.point import Point
from drslamd.slam.optimizer.kept.believed import Believed
from drslamd.slam.optimizer.kept.head import Pair
from drslamd.slam.optimizer.kept.kept_claims import KeptSpread
from drslamd.slam.optimizer.kept.kept_factor import KeptFactor
from drslamd.slam.optimizer.kept.quick_check import Freedom
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array

MOVED = 0.12
"""Of log variance: what is claimed of the head holds as long as what is feared of each robot moved
less, and half of it for pairs in the mean. A sigma goes with the fourth root, so it is off by 3 %
at most; what is feared of a whole robot is a guess that scatters by some percent itself."""

GROWN = 1.1
"""Times as many links as when shares were found ..."""
MINUTE = 60 * GRID_HZ
"""... and samples since then, at most: thinning takes away links, and rooms become worse ones."""


@dataclass(frozen=True)
class Sureness:
    """How far measurements are believed when something is claimed.

    Attributes:
        pairs: (pairs,) how many times the sent sigma the ranges of each are as wrong by.
        names: of these; feared: (robots,) variance of odometry over the configured one.
    """

    pairs: Array
    names: list[Pair]
    feared: Array

    @staticmethod
    def of(team: TeamProblem, scatter: Array, feared: Array) -> Sureness:
        ratio = team.problem.model.correlated_ratio(1.0)
        return Sureness(ratio * np.maximum(scatter, LEAST_SCATTER), team.pairs, feared)

    def believed(self, problem: Problem, point: Point) -> Believed:
        """A problem so far believed."""
        return Believed(
            raised(problem, self.feared[problem.odometry.robot], point), point, self.pairs
        )

    def has_moved(self, before: Sureness) -> bool:
        """Is it another one than before, of pairs and robots that were there?"""
        then = dict(zip(before.names, before.pairs.tolist(), strict=True))
        now = dict(zip(self.names, self.pairs.tolist(), strict=True))
        ratios = np.array([now[name] / then[name] for name in now if name in then])
        robots = self.feared / before.feared
        return bool(
            np.abs(np.log(ratios)).mean() > MOVED / 2 or np.abs(np.log(robots)).max() > MOVED
        )


@dataclass(frozen=True)
class KeptShares:
    """What is left of the covariances of poses and pairs (`banded.pairs.narrowing`), some seconds
    ago. It moves slowly, and to find it takes longer than a second that is kept.

    Attributes:
        robots: of whose last poses; links: of odometry, so many; newest: keyframe of all.
        left: (k, k), or of none.
    """

    robots: tuple[int, ...]
    links: int
    newest: int
    left: Array

    @staticmethod
    def of(team: TeamProblem, last: tuple[int, ...], left: Array) -> KeptShares:
        """Of the poses `last`, one of each robot."""
        robots = tuple(team.problem.robot_id[list(last)].tolist())
        newest = int(team.problem.n.max(initial=0))
        return KeptShares(robots, len(team.problem.odometry), newest, left)

    @staticmethod
    def none(team: TeamProblem, last: tuple[int, ...]) -> KeptShares:
        """Nothing is known of them."""
        return KeptShares.of(team, last, np.ones((0, 0)))

    def hold(self, now: KeptShares) -> bool:
        """Are they those of the same robots, which have not driven much further since?"""
        is_near = now.links <= GROWN * self.links and now.newest - self.newest <= MINUTE
        return self.robots == now.robots and is_near


@dataclass(frozen=True)
class Kept:
    """What the next solution begins with.

    Attributes:
        downwards: of the system that leads to the solution; claimed: of what may be claimed there.
        sure: when that was made; spread: what it tells of all that was learned.
        variances: of the mountings, see `mountings.variances`; checked: of odometry. Both are made
            anew as the way grows.
        shares: what is left of what is claimed of poses and pairs.
    """

    downwards: KeptFactor
    claimed: KeptFactor
    sure: Sureness
    spread: KeptSpread
    variances: Array
    checked: Freedom
    shares: KeptShares
