"""How wrong poses of a solved pose graph may be.

The paper's weights take every closure and every link for a witness of its own, with one number for
its rotation and one for its position. What is claimed must not: windows share most of their data,
and a wheel whose size is wrong is wrong in all links alike. So the covariance is that of an
estimator which weighs by W what really errs by S,

    cov = G' S G,   G = W J H^-1,   H = J' W J
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drslamd.conventions import GRID_HZ
from drslamd.slam import headway, se2
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.graph.team_frame import Group
from drslamd.slam.graph.thinning.chain_view import ChainView
from drslamd.slam.odometry.noise import by_yaw_rate
from drslamd.slam.optimizer import factors
from drslamd.slam.optimizer.closures.pose_graph_solver import PoseGraphSolver
from drslamd.slam.optimizer.complex_factors import ComplexFactors
from drslamd.slam.optimizer.factors import Numbering, chain_links
from drslamd.slam.optimizer.problem import BetweenFactors
from drslamd.slam.se2 import Array, Index

WINDOW_N = 40 * GRID_HZ
"""Samples that a window spans at most, as configured: closures of a pair within it rest on the same
ranges."""
NOBODY = -1
"""Whose constants a closure has."""


@dataclass(frozen=True)
class EdgeErrors:
    """How wrong edges are, whatever they weigh.

    Attributes:
        random: (m, 3, 3) covariance of what each has of its own, in the frame of its first pose.
        robot: (m,) whose odometry it is, NOBODY where it is a closure.
        constant: (m, 2, 3) what one sigma of that robot's scale, and of its yaw rate, makes of it.
    """

    random: Array
    robot: Index
    constant: Array

    @property
    def is_closure(self) -> NDArray[np.bool_]:
        """(m,)."""
        return np.asarray(self.robot == NOBODY)

    def chosen(self, which: NDArray[np.bool_]) -> EdgeErrors:
        return EdgeErrors(self.random[which], self.robot[which], self.constant[which])


@dataclass(frozen=True)
class WholeGraph:
    """All poses of a group and what is measured of them.

    Attributes:
        edges: as the paper weighs them; errors: how wrong they are.
        gauge: the pose that is at `origin` (3,) in the frame of the team.
    """

    places: Numbering
    edges: ComplexFactors
    errors: EdgeErrors
    gauge: int
    origin: Array

    @staticmethod
    def of(graph: PoseGraph, group: Group, window_n: int = WINDOW_N) -> WholeGraph:
        """
        Args:
            window_n: samples that windows of the team span at most.
        """
        places = factors.numbering(graph, group.members)
        gauge = factors.gauge_place(graph, group, places)
        origin = graph.view.segment(group.frame).poses[0]
        return WholeGraph(places, *edges_of(graph, places, window_n), gauge, origin)

    def in_frame(self, poses: Array) -> Array:
        """(n, 3) of the team, of all poses (n, 3) in any."""
        w_T_any = se2.compose(self.origin, se2.inverse(poses[self.gauge]))
        out = se2.compose(w_T_any[None], poses)
        out[:, 2] = se2.wrap(out[:, 2])
        return np.asarray(out)

    def joint(
        self, wanted: list[int], poses: Array, weighed: ComplexFactors | None = None
    ) -> Array:
        """(3 k, 3 k) covariance of x, y, theta of k poses in the frame of the team.

        Args:
            poses: (n, 3) in that frame, of least cost or near it.
            weighed: the edges as they were weighed for these, where not as in `edges`: who counts
                for little is believed to be as wrong as it counts.
        """
        edges, errors = self.edges, self.errors
        if weighed is not None:
            believed = (weighed.tau / edges.tau)[:, None, None]
            edges, errors = weighed, replace(errors, random=errors.random / believed)
        gains = PoseGraphSolver(edges, len(self.places.n), self.gauge).gains(poses, wanted)
        headway.mark()
        return claim(gains, errors)


def edges_of(
    graph: PoseGraph, places: Numbering, window_n: int = WINDOW_N
) -> tuple[ComplexFactors, EdgeErrors]:
    """All edges between numbered poses as the paper weighs them, and how wrong they are."""
    closures = factors.closures(graph, places)
    shared = _sharing(graph, places, closures, window_n)[:, None, None]
    edges = [ComplexFactors.of(closures)]
    nothing = np.zeros((len(closures), 2, 3))
    errors = [(closures.covariance * shared, np.full(len(closures), NOBODY), nothing)]
    for robot, place in places.place.items():
        chain = graph.view.chains[robot]
        links = chain_links(chain, calibrated=False)
        i, j = place[links.i], place[links.j]
        edges.append(ComplexFactors.of(BetweenFactors(i, j, links.measured, links.covariance)))
        random = chain_links(chain, calibrated=True).covariance
        errors.append((random, np.full(len(i), robot), _constants(chain)))
    joined = ComplexFactors.joined(edges)
    # a pose relative to itself says nothing
    used = (joined.i >= 0) & (joined.j >= 0) & (joined.i != joined.j)
    found = EdgeErrors(*(np.concatenate(column) for column in zip(*errors, strict=True)))
    return joined.chosen(used), found.chosen(used)


def _constants(chain: ChainView) -> Array:
    """(m, 2, 3) see `EdgeErrors.constant`, of its links."""
    links, noise = chain.links, chain.model.noise
    gyro = noise.gyro
    yaw = gyro.yaw_rad_per_s if gyro is not None and noise.learns_gyro else noise.yaw_rad_per_m
    by_scale = links.measured * [1.0, 1.0, 0.0]
    by_yaw = by_yaw_rate(links.sums, links.measured[:, :2], noise)
    return np.stack([noise.scale * by_scale, yaw * by_yaw], axis=1)


def _sharing(graph: PoseGraph, places: Numbering, closures: BetweenFactors, window_n: int) -> Array:
    """(m,) how many closures of its pair lie in one window with each, itself among them, whichever
    of the two told them."""
    robots = places.robot[np.stack([closures.i, closures.j])]
    shift = np.array([graph.view.shifts[robot] for robot in robots[0].tolist()])
    when = places.n[closures.i] - shift
    _, pair = np.unique(np.sort(robots, axis=0), axis=1, return_inverse=True)
    out = np.ones(len(when))
    for number in np.unique(pair):
        mine = np.flatnonzero(pair == number)
        order = np.sort(when[mine])
        first = np.searchsorted(order, when[mine] - window_n / 2)
        out[mine] = np.searchsorted(order, when[mine] + window_n / 2, side="right") - first
    return out


def claim(gains: Array, errors: EdgeErrors) -> Array:
    """(3 k, 3 k) covariance of poses that follow edges by `gains` (m, 3, 3 k)."""
    found = np.einsum("mac,mad->cd", errors.random @ gains, gains)
    for robot in np.unique(errors.robot[~errors.is_closure]):
        mine = errors.robot == robot
        swing = np.einsum("mka,mac->kc", errors.constant[mine], gains[mine])
        found += swing.T @ swing
    return np.asarray((found + found.T) / 2)
