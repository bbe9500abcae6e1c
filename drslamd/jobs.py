"""Computations under way, and how much of a core the three modules may take.

A module rests several times as long as it computed, so no team is so large that one of the three
takes more than a fifth of a core; module 3 may take a third to renew its solution every second.
What a module that rests then says comes later and is the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from drslamd.conventions import SECOND_US
from drslamd.events import JobDone, Solve
from drslamd.slam.closure_method import PairWindow
from drslamd.slam.consistency.pair import PairTracker
from drslamd.slam.front_end import WindowJob
from drslamd.slam.relative_pose.estimate import RelativePoseEstimate
from drslamd.slam.relative_pose.window_request import WindowRequest

RELATIVE_POSE = "relative_pose"
CONSISTENCY = "consistency"
OPTIMIZER = "optimizer"
WHAT_IF = "what_if"
RELOCATION = "relocation"
POINTS = "points"
JOINING = "joining"

REST = 4
"""How many times as long as it computed a module rests."""
LIGHT_US = SECOND_US // 3
"""A solution of the team that takes no longer may be renewed every second: where everybody is
matters more than a third of a core."""


@dataclass(frozen=True)
class Job:
    """A computation: its module, the pairs that it is about, and the window of each.

    Attributes:
        told: gets what comes out and the time, where it is about no pair; is there news to tell?
    """

    module: str
    pairs: tuple[PairTracker, ...] = ()
    requests: tuple[WindowRequest, ...] = ()
    told: Callable[[Any, int], bool] | None = None

    def tell_pairs(self, result: Any) -> bool:
        """Give the pairs what was found for them; False where it is not about pairs."""
        if self.module == RELATIVE_POSE:
            for pair, request, estimate in zip(self.pairs, self.requests, result, strict=True):
                pair.on_estimate(request, estimate)
            return True
        for pair in self.pairs:
            if self.requests:
                pair.on_costs(self.requests[0], *result)
            else:
                pair.on_check(result)
        return bool(self.pairs)


class DutyCycle(NamedTuple):
    """When a module last began to compute, and until when it rests, us."""

    since: int = 0
    until: int = 0


class Jobs:
    """Of one robot.

    Attributes:
        cycles: by module.
    """

    def __init__(self) -> None:
        self.cycles: dict[str, DutyCycle] = {}
        self._under_way: dict[int, Job] = {}
        self._begun = 0

    def begin(self, job: Job, run: Callable[[], object]) -> Solve:
        """Let it be computed."""
        self._begun += 1
        self._under_way[self._begun] = job
        return Solve(self._begun, job.module, run)

    def begin_windows(
        self,
        found: Sequence[WindowJob],
        solve: Callable[[Sequence[PairWindow]], list[RelativePoseEstimate]],
    ) -> list[Solve]:
        """Let module 1 solve windows at once, but none of a pair whose last one it still has."""
        free = [window for window in found if not self.is_busy(RELATIVE_POSE, window.pair)]
        if not free:
            return []
        pairs, requests, given = zip(*free, strict=True)
        return [self.begin(Job(RELATIVE_POSE, pairs, requests), partial(solve, given))]

    def finish(self, event: JobDone) -> Job:
        """Which job has ended; its module rests now."""
        job = self._under_way.pop(event.job_id)
        began = event.utime - event.elapsed_us
        since, until = self.cycles.get(job.module, DutyCycle(began, began))
        if until <= began:
            since, until = began, event.utime
        rested = max(until, event.utime) + _rest_us(job.module, event.elapsed_us)
        self.cycles[job.module] = DutyCycle(since, rested)
        return job

    def is_busy(self, module: str, pair: PairTracker | None = None) -> bool:
        """Does the module compute, for this pair or for any?"""
        return any(
            job.module == module and (pair is None or pair in job.pairs)
            for job in self._under_way.values()
        )

    def is_free(self, module: str, utime: int) -> bool:
        """Does it neither compute nor rest?"""
        return not (self.is_busy(module) or self.is_resting(module, utime))

    def is_resting(self, module: str, utime: int) -> bool:
        return utime < self.cycles.get(module, DutyCycle()).until


def _rest_us(module: str, elapsed_us: int) -> int:
    """How long a module rests that has computed for so long."""
    rest = REST * elapsed_us
    is_light = module == OPTIMIZER and elapsed_us <= LIGHT_US
    return min(rest, SECOND_US - elapsed_us) if is_light else rest
