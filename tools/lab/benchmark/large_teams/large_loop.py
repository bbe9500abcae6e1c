"""The event loop of one of fifty robots: how long its sensors wait for module 3.

Module 3 on a real event loop with the daemon's worker and its rests, on a team whose pairs have
mostly met. Everybody's entries come one by one, as messages do, and the graph is looked at in
slices. What messages and sensors cost is not in it: `daemon` measures that.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from drslamd.conventions import SECOND_US
from drslamd.events import JobDone
from drslamd.io.worker import Finished, Worker
from drslamd.jobs import OPTIMIZER, Job, Jobs
from lab.benchmark.large_teams.met_team import MetTeam
from lab.benchmark.rows import Row

ROBOTS = {True: 10, False: 50}
AFTER_S = {True: 60, False: 600}
SECONDS = {True: 5, False: 60}
READ_S = 0.02
"""Between two looks of sensors."""
FIRST_S = 120.0
"""That the first solution may take; it makes everything anew."""
GOAL_MS = 20.0


def rows(quick: bool) -> Iterator[Row]:
    """The lag of the loop, 99 % and the longest, and how often the answer was renewed."""
    robots, seconds = ROBOTS[quick], SECONDS[quick]
    team = MetTeam(robots, AFTER_S[quick], seconds)
    team.know_the_truth()
    loop = asyncio.run(_measured(team, seconds))
    work = f"event loop of one of {robots} robots that have met"
    yield Row(3, f"{work}, lag p99", float(np.quantile(loop.lags, 0.99)), "ms", GOAL_MS)
    yield Row(3, f"{work}, longest lag", max(loop.lags), "ms")
    apart = seconds / loop.solved if loop.solved else float("inf")
    yield Row(3, f"{work}, between two answers, mean", apart, "s")


@dataclass
class LargeLoop:
    """What a robot does of module 3, and what its sensors see of that.

    Attributes:
        lags: ms by which each look of sensors came late.
        solved: answers of module 3.
        failed: raises what a computation ended with.
    """

    team: MetTeam
    worker: Worker
    jobs: Jobs = field(default_factory=Jobs)
    lags: list[float] = field(default_factory=list)
    solved: int = 0
    failed: asyncio.Future[None] = field(default_factory=lambda: asyncio.Future())

    @property
    def _utime(self) -> int:
        return round(asyncio.get_running_loop().time() * SECOND_US)

    def read(self, due: float, until: float) -> None:
        """Sensors are looked at each `READ_S`: how late? Each look that was missed counts."""
        loop = asyncio.get_running_loop()
        now = loop.time()
        while due <= now:
            self.lags.append(1e3 * (now - due))
            due += READ_S
        if due < until:
            loop.call_at(due, self.read, due, until)

    async def answer(self) -> None:
        """Until the first one is there."""
        while not self.solved and not self.failed.done():
            await asyncio.sleep(READ_S)

    async def drive(self, seconds: int) -> None:
        """What all say, message by message; each second a digest, and module 3 where it is free."""
        loop, back = asyncio.get_running_loop(), self.team.back
        began = loop.time()
        for second in range(seconds):
            said = self.team.entries()
            for number, (chain, entry) in enumerate(said):
                due = began + second + number / len(said)
                await asyncio.sleep(max(0.0, due - loop.time()))
                back.insert(chain, entry)
                if not back.is_looking:
                    self.optimize()
            back.said_digest()

    def optimize(self) -> None:
        """Look at some of the graph; go on at once after sensors were read, or begin to solve."""
        if self.failed.done() or not self.jobs.is_free(OPTIMIZER, self._utime):
            return
        back, loop = self.team.back, asyncio.get_running_loop()
        job = back.begin(self.team.living, utime=self._utime)
        if job is not None:
            solve = self.jobs.begin(Job(OPTIMIZER), job)
            self.worker.submit(solve.run, lambda done: self._ended(solve.job_id, done))
        elif back.is_looking:
            loop.call_later(0, self.optimize)

    def _ended(self, job_id: int, done: Finished) -> None:
        if done.error is not None:
            self.failed.set_exception(done.error)
            return
        elapsed, now = round(done.seconds * SECOND_US), self._utime
        self.jobs.finish(JobDone(now, job_id, done.result, elapsed))
        self.team.back.on_solution(done.result, now)
        self.solved += 1


async def _measured(team: MetTeam, seconds: int) -> LargeLoop:
    """Drive on for so long, from the first answer on."""
    worker = Worker()
    worker.start()
    loop = LargeLoop(team, worker)
    try:
        loop.optimize()
        await asyncio.wait_for(loop.answer(), FIRST_S)
        # (nor does it rest as long as after the first one, which is not a usual one)
        loop.solved, loop.jobs = 0, Jobs()
        now = asyncio.get_running_loop().time()
        loop.read(now, now + seconds)
        await loop.drive(seconds)
        if loop.failed.done():
            loop.failed.result()
    finally:
        worker.stop()
    return loop
