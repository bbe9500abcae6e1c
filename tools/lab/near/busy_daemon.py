"""A daemon that knows a large team and computes its module 3 all the time, or not at all.

usage: python -m lab.near.busy_daemon CONFIG ROBOTS compute|rest

At its end it prints how long it told whoever read, s of a core, and how often.
"""

from __future__ import annotations

import asyncio
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drslamd.config import parse
from drslamd.conventions import Chain, Segment
from drslamd.daemon import Daemon
from drslamd.events import Solve
from drslamd.near.surroundings import Surroundings
from drslamd.sensors.samples import Motion
from drslamd.slam.back_end import BackEnd
from drslamd.slam.graph.estimate import TeamEstimate, Trajectory
from lab.benchmark import growth
from lab.benchmark.large_teams.met_team import begun

SECONDS = 40
NEIGHBOURS = 14
NO_JOB = -1


def team(robots: int, own: Chain) -> tuple[BackEnd, Any]:
    """The graph of a team that drove for a while, and module 3 on it."""
    rng = np.random.default_rng(8)
    truth = [growth._wander(rng, SECONDS) for _ in range(robots)]
    odometry = [growth._drifted(rng, path) for path in truth]
    chains = [own, *(Chain(robot, 1) for robot in range(1, robots))]
    back = BackEnd(growth._config(0), own)
    for second in range(SECONDS):
        for k, chain in enumerate(chains):
            seen = chains[: k + 1 + NEIGHBOURS]
            back.insert(chain, growth._entry(rng, second, chain, seen, truth, odometry))
    return back, begun(back, set(range(robots)))


def known_here(estimate: TeamEstimate, own: Chain, n: int) -> TeamEstimate:
    """As if our last solved keyframe were sample n of our track."""
    mine = estimate.trajectories[own.robot]
    now = Trajectory(own, np.append(mine.n[:-1], n), mine.poses)
    frame = Segment(*own, 0)
    return replace(estimate, frame=frame, trajectories={**estimate.trajectories, own.robot: now})


class Telling:
    """How long it takes to tell, while somebody reads.

    Attributes:
        spent_s: of a core; times: samples of odometry that were told.
    """

    def __init__(self, daemon: Daemon) -> None:
        self.spent_s, self.times = 0.0, 0
        self._socket = daemon._near
        near = daemon.robot.near
        self._on_motion, self._tell = near.on_motion, self._socket.tell
        near.on_motion = self._timed_motion  # type: ignore[method-assign]
        self._socket.tell = self._timed_tell  # type: ignore[method-assign]

    def _timed_motion(self, motion: Motion) -> None:
        began = time.thread_time()
        self._on_motion(motion)
        if self._socket.has_readers:
            self.spent_s += time.thread_time() - began
            self.times += 1

    def _timed_tell(self, near: Surroundings) -> None:
        began = time.thread_time()
        self._tell(near)
        if self._socket.has_readers:
            self.spent_s += time.thread_time() - began


async def main(path: str, robots: int, computes: bool) -> None:
    daemon = Daemon(parse(Path(path).read_text()))
    robot = daemon.robot
    back, job = team(robots, robot.own)
    estimate = job()
    handle = robot.handle

    def handled(event: Any) -> Any:
        if type(event).__name__ == "JobDone" and event.job_id == NO_JOB:
            compute()
            return []
        track = robot.front.reckoning.track
        if robot.back.estimate is None and len(track):
            robot.back.graph.chains.update(back.graph.chains)
            robot.back.estimate = known_here(estimate, robot.own, track.end - 1)
        return [e for e in handle(event) if not isinstance(e, Solve)]

    def compute() -> None:
        if computes:
            daemon._perform(Solve(NO_JOB, "optimizer", job))

    robot.handle = handled  # type: ignore[method-assign]
    telling = Telling(daemon)
    asyncio.get_running_loop().call_later(1.0, compute)
    await daemon.run()
    print(telling.spent_s, telling.times)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], int(sys.argv[2]), sys.argv[3] == "compute"))
