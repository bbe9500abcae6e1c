"""The watchdog is fed while the loop, the robot, its readers and the solver all move; else not."""

from __future__ import annotations

import asyncio
import itertools
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from deploy_helpers import example_in

from drslamd.config import parse
from drslamd.daemon import Daemon
from drslamd.events import Effect, Event, JobDone, Save, Solve
from drslamd.io.systemd import Notifier
from drslamd.io.watch import watchdog
from drslamd.slam import headway

PERIOD_S = 0.15
FOREIGN_JOB = 10**6
READERS = ["uwb", pytest.param("wheels", marks=pytest.mark.slow)]
JOB_IDS = itertools.count(FOREIGN_JOB)


class Recorder(Notifier):
    """A service manager that asks for a sign of life every `PERIOD_S`."""

    def __init__(self) -> None:
        super().__init__()
        self.fed: list[float] = []

    @property
    def watchdog_s(self) -> float | None:
        return PERIOD_S

    def alive(self) -> None:
        self.fed.append(time.monotonic())


def compute(daemon: Daemon, run: Callable[[], object]) -> None:
    """Give the solver something to do whose result nobody needs."""
    daemon._perform(Solve(next(JOB_IDS), "optimizer", run))


class Scene:
    """A daemon in this process for `seconds`; something happens to it after a healthy start."""

    def __init__(self, folder: Path) -> None:
        self.daemon = Daemon(parse(example_in(folder).read_text()))
        self.recorder = Recorder()
        self.daemon._notifier = self.daemon._watchdog._notifier = self.recorder
        self._ignore_foreign_jobs()

    def _ignore_foreign_jobs(self) -> None:
        robot = self.daemon.robot
        handle = robot.handle

        def without_foreign(event: Event) -> list[Effect]:
            if isinstance(event, JobDone) and event.job_id >= FOREIGN_JOB:
                return []
            return list(handle(event))

        robot.handle = without_foreign  # type: ignore[method-assign]

    async def play(self, happens: Callable[[Daemon], object], seconds: float) -> float:
        """How long the watchdog starved at the end of the scene."""
        task = asyncio.ensure_future(self.daemon.run())
        await asyncio.sleep(3 * PERIOD_S)
        assert len(self.recorder.fed) >= 4
        happens(self.daemon)
        await asyncio.wait([task], timeout=seconds)
        starved = time.monotonic() - self.recorder.fed[-1]
        if not task.done():
            signal.raise_signal(signal.SIGTERM)
        await task
        return starved


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Scene:
    for name in ("NOTIFY_SOCKET", "WATCHDOG_USEC"):
        monkeypatch.delenv(name, raising=False)

    async def make() -> Scene:
        return Scene(tmp_path)

    return asyncio.run(make())


def test_a_healthy_daemon_feeds_it(scene: Scene) -> None:
    assert asyncio.run(scene.play(lambda _: None, 0.5)) < PERIOD_S


@pytest.mark.slow
@pytest.mark.row("O6")
def test_a_loop_that_hangs_does_not_feed_it(scene: Scene) -> None:
    asyncio.run(scene.play(lambda _: time.sleep(0.5), 0.2))
    fed = scene.recorder.fed
    assert max(b - a for a, b in itertools.pairwise(fed)) >= 0.5


@pytest.mark.slow
@pytest.mark.row("O6")
def test_a_robot_that_is_no_longer_woken_does_not_feed_it(scene: Scene) -> None:
    def sleep_for_ever(daemon: Daemon) -> None:
        daemon._wake = lambda: None  # type: ignore[method-assign]

    assert asyncio.run(scene.play(sleep_for_ever, 2.0)) > 0.5


@pytest.mark.row("O6")
@pytest.mark.slow
@pytest.mark.row("O6")
def test_a_solver_that_is_stuck_does_not_feed_it(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scene.daemon._watchdog, "stuck_s", 0.2)
    starved = asyncio.run(scene.play(lambda daemon: compute(daemon, lambda: time.sleep(1.5)), 1.0))
    assert starved > 0.5


@pytest.mark.slow
def test_a_queue_of_computations_that_moves_feeds_it(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a slow computer the last of many waits long; that is load, not a fault."""
    monkeypatch.setattr(scene.daemon._watchdog, "stuck_s", 0.3)

    def many(daemon: Daemon) -> None:
        for _ in range(8):
            compute(daemon, lambda: time.sleep(0.1))

    assert asyncio.run(scene.play(many, 0.7)) < PERIOD_S


@pytest.mark.slow
@pytest.mark.row("O6")
def test_a_long_computation_that_makes_headway_feeds_it(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As that of a large team does."""
    monkeypatch.setattr(scene.daemon._watchdog, "stuck_s", 0.3)

    def long() -> None:
        for _ in range(10):
            time.sleep(0.1)
            headway.mark()

    assert asyncio.run(scene.play(lambda daemon: compute(daemon, long), 0.9)) < PERIOD_S


@pytest.mark.row("O6")
@pytest.mark.row("O2")
def test_a_disk_that_hangs_is_named_and_the_robot_goes_on(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A new start would hang on the same disk."""
    monkeypatch.setattr(watchdog, "DISK_STUCK_S", 0.2)
    freed = threading.Event()
    said: list[str] = []

    def hang(daemon: Daemon) -> None:
        daemon._store.save = lambda _: freed.wait(5)  # type: ignore[method-assign, assignment]
        daemon._perform(Save({}))
        compute(daemon, lambda: said.append("solved"))
        loop = asyncio.get_running_loop()
        loop.call_later(0.45, lambda: said.extend(daemon._picture()["problems"]))
        loop.call_later(0.5, freed.set)

    assert asyncio.run(scene.play(hang, 0.6)) < PERIOD_S
    assert said[0] == "solved"
    assert any("the disk has not answered for 0 s" in sentence for sentence in said)


@pytest.mark.row("O6")
@pytest.mark.parametrize("port", READERS)
def test_a_reader_that_died_ends_the_daemon(scene: Scene, port: str) -> None:
    async def die() -> None:
        await asyncio.sleep(4 * PERIOD_S)
        raise ZeroDivisionError

    _reader(scene, port).run = die  # type: ignore[attr-defined]
    with pytest.raises(ZeroDivisionError):
        asyncio.run(scene.play(lambda _: None, 2.0))


@pytest.mark.parametrize("port", READERS)
def test_a_reader_that_ended_without_a_word_ends_the_daemon_too(scene: Scene, port: str) -> None:
    async def end() -> None:
        await asyncio.sleep(4 * PERIOD_S)

    _reader(scene, port).run = end  # type: ignore[attr-defined]
    with pytest.raises(RuntimeError):
        asyncio.run(scene.play(lambda _: None, 2.0))


def _reader(scene: Scene, port: str) -> object:
    return scene.daemon._uwb if port == "uwb" else scene.daemon._wheels
