"""A day of a team: every half hour a robot loses its power, three in ten datagrams are lost.

What makes a day fit into two hours of a core are means of the scenario, none of the product: robots
drive for two of every ten minutes and stand for the rest, as robots with work to do; wheels speak
at 10 Hz, a pair is ranged at 2 Hz by one of its modules, and the three modules run every ten
seconds.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drslamd.conventions import SECOND_US, grid_utime
from lab.play.playback import Chunk, Hardware
from lab.recordings import world
from lab.recordings.recording import Array, Recording
from lab.recordings.world import STEP_S
from lab.score import metrics
from lab.soak import radio
from lab.soak.harm import on_the_air
from lab.soak.invariants import Invariants
from lab.soak.put_aside import put_aside, taken_up
from lab.soak.stage import Bench, Stage

ROBOTS = 5
BLOCK_S, DRIVEN_S = 600, 120
RESTART_S = 1_800
"""Between two restarts; the robots take turns."""
OFF_US = 2 * SECOND_US
LOSS, STRANGE_PER_S = 0.3, 0.1
"""Of the radio, and what a stranger says (1 % of what is on the air)."""
LOOK_S = 10
RATES = "[relative_pose]\nrate_hz = 0.1\n[consistency]\nrate_hz = 0.1\n[optimizer]\nrate_hz = 0.1\n"
SCENE = world.Scene(
    robots=ROBOTS,
    seconds=BLOCK_S,
    ranges=world.RangeModel(bias=0.0, slow=0.03, burst_share=0.0),
    odometry=world.OdometryModel(scale=0.0, yaw_deg_per_m=0.0),
    odometry_hz=10,
    range_hz=2,
    both_measure=False,
)


@dataclass(frozen=True)
class Hour:
    """What was measured in an hour of the team's time.

    Attributes:
        took_s: of a core.
        rss_mb, descriptors: of the process that plays it all, at the end.
        solve_ms: mean of module 3.
        pair_rms_m: how far wrong robots were about each other's place, root of the mean square.
        entries: of all logs that robot 0 holds at the end.
        sitting: how many processes played the day by then; memory is that of the latest.
    """

    hour: int
    took_s: float
    rss_mb: float
    descriptors: int
    solve_ms: float
    pair_rms_m: float
    entries: int
    sitting: int

    def as_json(self) -> dict[str, Any]:
        return asdict(self)


class Day:
    """The world in blocks of ten minutes, made when they are needed; two are kept."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._blocks: dict[int, Recording] = {}
        self._ends: dict[int, list[Array]] = {}
        rng = np.random.default_rng([seed, 4])
        self._bias_m = np.triu(rng.normal(0, 0.05, (ROBOTS, ROBOTS)), 1)

    def block(self, k: int) -> Recording:
        """Block k, its times counted from its own begin; ask for them in order."""
        if k not in self._blocks:
            rng = np.random.default_rng([self._seed, 5, k])
            starts = self._ends.get(k - 1, [None] * ROBOTS)
            truths = [_out_and_rest(rng, start) for start in starts]
            block = world.recorded(f"block {k}", rng, SCENE, truths)
            ends = np.sort(block.ranges[:, 1:3].astype(int), axis=1)
            block.ranges[:, 3] += self._bias_m[ends[:, 0], ends[:, 1]]
            self._blocks[k], self._ends[k] = block, [truth[-1] for truth in truths]
            self._blocks.pop(k - 3, None)
            self._ends.pop(k - 3, None)
        return self._blocks[k]

    def truth(self, robot: int, t_s: float) -> Array:
        """(3,) where a robot is."""
        k = int(t_s // BLOCK_S)
        trail = self.block(k).trails[robot]
        return np.asarray(metrics.at_times(trail.t, trail.truth, np.array([t_s % BLOCK_S]))[0])


def _out_and_rest(rng: np.random.Generator, start: Array | None) -> Array:
    """(n, 3) true poses of a block: it drives from where it stands, then stands."""
    scene = world.Scene(**{**SCENE.__dict__, "seconds": DRIVEN_S})
    way = world.drive(rng, scene, start)
    rest = np.repeat(way[-1:], round((BLOCK_S - DRIVEN_S) / STEP_S), axis=0)
    return np.concatenate([way, rest])


@dataclass
class DayStage(Stage):
    """A stage whose recording goes on."""

    day: Day | None = None

    def chunks(self, device: Hardware, since_s: float) -> Iterator[Chunk]:
        assert self.day is not None
        return _Printing(self.day, device, since_s)


class _Printing:
    """What the devices of a robot print, block after block. (A generator cannot be put aside.)"""

    def __init__(self, day: Day, device: Hardware, since_s: float) -> None:
        self._day, self._device, self._since_s = day, device, since_s
        self._block = int(since_s // BLOCK_S)
        self._left = self._right = 0.0
        self._chunks: Iterator[Chunk] = iter(())

    def __iter__(self) -> Iterator[Chunk]:
        return self

    def __next__(self) -> Chunk:
        while True:
            chunk = next(self._chunks, None)
            if chunk is None:
                self._chunks = iter(self._printed())
                self._block += 1
            elif chunk.t >= self._since_s:
                return chunk

    def _printed(self) -> list[Chunk]:
        """Of this block, in the times of the day."""
        device = self._device
        part = Hardware(self._day.block(self._block), device.robot, device.base, 2)
        part.uwb = device.uwb
        ways: list[tuple[float, float]] = []
        part.wiring = _going_on(self._left, self._right, ways)
        begins_s = self._block * BLOCK_S
        chunks = [Chunk(begins_s + c.t, c.port, c.printed) for c in part.chunks()]
        self._left, self._right = ways[0]
        return chunks


def _going_on(left: float, right: float, ways: list[tuple[float, float]]) -> Any:
    """Counters that go on from there; where they end is put into `ways`."""

    def wiring(t: Array, one: Array, other: Array) -> tuple[Array, Array]:
        ways.append((left + one[-1], right + other[-1]))
        return left + one, right + other

    return wiring


@dataclass
class _Play:
    """A day so far: its team, what is watched, and how many seconds of it are over."""

    bench: Bench
    invariants: Invariants
    measured: _Measured
    second: int = 0


def hours(
    seed: int,
    count: float,
    progress: Callable[[float], None],
    aside: tuple[Path, str] | None = None,
) -> Iterator[Hour]:
    """Play so many hours; a row after each.

    Args:
        progress: told the seconds of the team that have passed.
        aside: a file in which the day is put aside every half hour of the team, and the commit that
            plays it. A day that is there, of the same commit, seed and length, is gone on with.

    Raises:
        Broken: a promise was not kept.
    """
    until_s = LOOK_S * round(count * 3600 / LOOK_S)
    path, commit = aside or (Path(), "")
    mark = (commit, seed, until_s)
    play: _Play = (taken_up(path, mark) if aside else None) or _begun(seed, until_s)
    play.measured.sit_down()
    while play.second < until_s:
        play.second += LOOK_S
        play.bench.run(play.second)
        play.invariants.look()
        play.measured.look()
        play.bench.stage.radio.damaged.clear()
        progress(play.second)
        if play.second % RESTART_S == 0:
            _restart(play.bench, play.second // RESTART_S % ROBOTS)
        if play.second % 3600 == 0 or play.second == until_s:
            yield play.measured.hour(-(-play.second // 3600))
        if aside and play.second % RESTART_S == 0:
            put_aside(path, play, mark)
    if aside:
        path.unlink(missing_ok=True)


def _begun(seed: int, until_s: int) -> _Play:
    day = Day(seed)
    stage = DayStage(day.block(0), np.random.default_rng([seed, 3]), 0.0, float("inf"), day=day)
    stage.radio.troubles.append(radio.Trouble(0, 2**62, radio.lossy(LOSS)))
    on_the_air.stranger(stage, STRANGE_PER_S, until_s)
    bench = Bench(stage, seed, RATES)
    return _Play(bench, Invariants(bench, keeps_journal=False), _Measured(bench, day))


def _restart(bench: Bench, robot: int) -> None:
    bench.kill(bench.members[robot])

    def begin() -> None:
        bench.switch_on(robot)

    bench.at(bench.now + OFF_US, begin)


class _Measured:
    """What an hour comes to."""

    def __init__(self, bench: Bench, day: Day) -> None:
        self._bench, self._day = bench, day
        self._sitting = 0
        self._took_s = self._looked_s = 0.0
        self._errors: list[float] = []
        self._solve_ms: list[float] = []

    def sit_down(self) -> None:
        """A process begins to play, or goes on."""
        self._sitting += 1
        self._looked_s = time.process_time()

    def look(self) -> None:
        """Take what was found since the last look, so that nothing piles up."""
        now = time.process_time()
        self._took_s, self._looked_s = self._took_s + now - self._looked_s, now
        for member in self._bench.members.values():
            traces = member.traces
            self._solve_ms += traces.solve_ms.pop("optimizer", [])
            for kept in (traces.sent, traces.notes, traces.saved, traces.solve_ms):
                kept.clear()
        members = self._bench.members
        for a, b in ((a, b) for a in members for b in members if a < b):
            if members[a].running and members[b].running:
                self._compare(a, b)

    def _compare(self, a: int, b: int) -> None:
        members = self._bench.members
        estimate = members[a].robot.back.estimate
        found = estimate.relative(a, b) if estimate else None
        if estimate is None or found is None:
            return
        true = []
        for robot in (a, b):
            n = int(estimate.trajectories[robot].n[-1])
            t_s = members[robot].clock.world(grid_utime(n)) / 1e6
            if t_s < self._bench.now / 1e6 - BLOCK_S:
                return
            true.append(self._day.truth(robot, max(t_s, 0.0)))
        there = metrics.relative(*true)
        self._errors.append(float(np.hypot(*(found[0] - there)[:2])))

    def hour(self, number: int) -> Hour:
        row = Hour(
            number,
            round(self._took_s, 1),
            round(_rss_mb(), 1),
            len(os.listdir("/proc/self/fd")),
            round(float(np.mean(self._solve_ms or [0.0])), 2),
            round(float(np.sqrt(np.mean(np.square(self._errors or [0.0])))), 4),
            sum(len(log.sealed) for log in self._bench.members[0].robot.team.logs._logs.values()),
            self._sitting,
        )
        self._took_s, self._errors, self._solve_ms = 0.0, [], []
        return row


def _rss_mb() -> float:
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20
