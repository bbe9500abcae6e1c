"""A team of any size whose pairs have mostly met, as the graph of one of its robots.

Entries go straight into the graph, as if modules 1 and 2 had made them: a keyframe and a range to
each peer in reach every second, and a closure now and then. Each robot drives about in an area that
grows with the team; every clock has its own beginning.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drslamd.config import Config, parse
from drslamd.conventions import GRID_HZ, ROTATION_STEP_RAD, TRANSLATION_STEP_M, Chain
from drslamd.slam import se2
from drslamd.slam.back_end import BackEnd
from drslamd.slam.graph import team_frame
from drslamd.slam.graph.estimate import Learned, TeamEstimate, Trajectory
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from lab.recordings.recording import Array

SQUARE_M = 6.0
"""Side of the square that each robot has to itself."""
RANGE_M = 12.0
"""How far its radio reaches."""
SPEED_MPS = 0.3
SIGMA_M = 0.07
CLOSURE_S = 10
"""Between two closures of a pair."""
SPARSE_S = 64
"""Ranges of older times stand so far apart: thinning keeps no more of them (`FEW_RANGES`)."""
WHOLE_S = 900
"""Times that keep all their ranges."""
APART = 7 * GRID_HZ
"""Samples between the clocks of two neighbouring numbers."""


class MetTeam:
    """Robots that drive about, and the graph of the first one.

    Attributes:
        back: module 3 of robot 0.
        second: of the team's time, up to which all is inserted.
        truth: (seconds, robots, 3).
    """

    def __init__(
        self, robots: int, seconds: int, more: int, seed: int = 8, range_m: float = RANGE_M
    ) -> None:
        """
        Args:
            seconds: to drive at once; more: that may follow one by one.
            range_m: how far its radio reaches.
        """
        self._rng = np.random.default_rng(seed)
        self.robots, self._whole_from = robots, seconds - WHOLE_S
        self._range_m = range_m
        self.truth = self._driven(seconds + more)
        self._scale = self._rng.normal(0, 0.02, robots)
        self._odometry = self._measured()
        self._bias = self._rng.normal(0, 0.05, (robots, robots))
        self.chains = [Chain(robot, 1) for robot in range(robots)]
        self.back = BackEnd(config_of(0), self.chains[0])
        self.second = 0
        for _ in range(seconds):
            self.drive()

    @property
    def living(self) -> set[int]:
        return set(range(self.robots))

    def drive(self) -> None:
        """One more second of all robots."""
        for chain, entry in self.entries():
            self.back.insert(chain, entry)

    def entries(self) -> list[tuple[Chain, GraphEntry]]:
        """What all robots say of the next second."""
        second, poses = self.second, self.truth[self.second]
        self.second += 1
        apart = poses[:, None, :2] - poses[None, :, :2]
        distance = np.hypot(apart[..., 0], apart[..., 1])
        noisy = distance + self._bias + self._rng.normal(0, SIGMA_M, distance.shape)
        is_told = second >= self._whole_from or second % SPARSE_S == 0
        in_reach = np.triu(distance < self._range_m, 1) & is_told
        return [(c, self._entry(c, second, in_reach[c.robot], noisy[c.robot])) for c in self.chains]

    def _entry(self, chain: Chain, second: int, in_reach: Array, noisy: Array) -> GraphEntry:
        robot, n = chain.robot, GRID_HZ * second + APART * chain.robot
        x, y, theta = self._odometry[second, robot]
        x, y = round(x / TRANSLATION_STEP_M), round(y / TRANSLATION_STEP_M)
        frame = Keyframe(n, 0, x, y, round(theta / ROTATION_STEP_RAD))
        ranges, closures = [], []
        for other in np.flatnonzero(in_reach).tolist():
            peer, there = self.chains[other], n + APART * (other - robot)
            ends = (0.0, 0.0), (0.0, 0.0)
            ranges.append(RangeMeasurement(n, peer, there, *ends, float(noisy[other]), 0.1))
            if (second + other) % CLOSURE_S == 0:
                closures.append(self._closure(second, robot, other, n, there))
        return GraphEntry(second, None, (frame,), tuple(ranges), tuple(closures))

    def _closure(
        self, second: int, robot: int, other: int, n: int, there: int
    ) -> ClosureMeasurement:
        here = self.truth[second]
        a_T_b = se2.between(here[robot], here[other]) + self._rng.normal(0, 0.1, 3)
        number, covariance = self.robots * second + other, (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)
        pose = tuple(a_T_b.tolist())
        return ClosureMeasurement(number, True, n, self.chains[other], there, pose, covariance)

    def know_the_truth(self) -> None:
        """The back end remembers a solution that is right, so that the next one begins well."""
        views = self.back.graph.view.chains
        (group,) = [g for g in team_frame.groups(self.back.graph) if len(g) == self.robots]
        gauge = min(group)
        first = self.truth[0, gauge.robot]
        trajectories = {}
        for robot, view in views.items():
            seconds = (view.keyframes.n - APART * robot) // GRID_HZ
            poses = se2.between(first[None], self.truth[seconds, robot])
            trajectories[robot] = Trajectory(view.chain, view.keyframes.n, poses)
        scale = {k: Learned(float(s / (1 + s))) for k, s in enumerate(self._scale)}
        bias = {
            (a, b): Learned(float(self._bias[a, b]))
            for a in range(self.robots)
            for b in range(a + 1, self.robots)
        }
        self.back.estimate = TeamEstimate(gauge, trajectories, scale=scale, bias_m=bias)

    def _driven(self, seconds: int) -> Array:
        """(seconds, robots, 3) about a square, turned back by its walls."""
        rng, side = self._rng, SQUARE_M * float(np.sqrt(self.robots))
        poses = np.empty((seconds, self.robots, 3))
        pose = np.empty((self.robots, 3))
        pose[:, :2] = rng.uniform(2, side - 2, (self.robots, 2))
        pose[:, 2] = rng.uniform(-np.pi, np.pi, self.robots)
        for k in range(seconds):
            poses[k] = pose
            away = side / 2 - pose[:, :2]
            home = np.arctan2(away[:, 1], away[:, 0]) - pose[:, 2]
            inside = np.abs(away).max(axis=1) < side / 2 - 1.5
            turn = np.where(inside, rng.normal(0, 0.3, self.robots), 0.6 * np.sin(home))
            step = SPEED_MPS * np.stack([np.cos(pose[:, 2]), np.sin(pose[:, 2])], axis=-1)
            pose = pose + np.column_stack([step, turn])
        return poses

    def _measured(self) -> Array:
        """(seconds, robots, 3) what wheels say of these ways, each from zero."""
        rng, shape = self._rng, self.truth[1:].shape
        step = se2.between(self.truth[:-1].reshape(-1, 3), self.truth[1:].reshape(-1, 3))
        step = step.reshape(shape)
        step[..., 2] = se2.wrap(step[..., 2])
        step[..., :2] *= 1 + self._scale[None, :, None]
        step += rng.normal(size=shape) * np.sqrt(SPEED_MPS) * [0.01, 0.01, np.radians(0.5)]
        out = np.zeros_like(self.truth)
        for k in range(len(step)):
            out[k + 1] = se2.compose(out[k], step[k])
        return out


def config_of(robot: int) -> Config:
    """Of one robot, as little as there must be."""
    return parse(
        f'[robot]\nid = {robot}\n[team]\ninsecure = true\n[uwb]\nport = "uwb"\n'
        '[wheels]\nsource = "kobuki"\nport = "wheels"\n'
    )


def begun(back: BackEnd, living: set[int]) -> Any:
    """The next job of module 3, if one is due, its graph looked at to the end."""
    job = back.begin(living)
    while back.is_looking:
        job = back.begin(living)
    return job
