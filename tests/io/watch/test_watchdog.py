"""What the watchdog holds against whom: a solver without headway, a reader whose bytes wait."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

import pytest

from drslamd.io.ports.readiness import has_bytes
from drslamd.io.systemd import Notifier
from drslamd.io.watch.watchdog import DISK_STUCK_S, STUCK_S, Watchdog, slow_disk
from drslamd.io.worker import Worker


class Manager(Notifier):
    """Counts the signs of life."""

    def __init__(self) -> None:
        super().__init__()
        self.fed = 0

    def alive(self) -> None:
        self.fed += 1


class Idle(Worker):
    """One that says for how long it is stuck."""

    def __init__(self) -> None:
        super().__init__()
        self.seconds = 0.0

    def stuck_s(self) -> float:
        return self.seconds


class Pipe:
    """A reader whose bytes are written by hand."""

    def __init__(self) -> None:
        self.ours, self.theirs = os.pipe()
        self.is_open = True
        self.reads = 0

    def descriptor(self) -> int:
        return self.ours if self.is_open else -1

    def read(self) -> None:
        os.read(self.ours, 100)
        self.reads += 1


class Scene:
    """A watchdog on a clock that is set by hand."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now, self.is_ticking = 1000.0, True
        self.manager, self.solver, self.pipe = Manager(), Idle(), Pipe()
        monkeypatch.setattr(time, "monotonic", lambda: self.now)
        self.dog = Watchdog(self.manager, self.solver, [self.pipe], lambda: self.is_ticking)

    def feeds(self, later_s: float = 0.0) -> bool:
        self.now += later_s
        before = self.manager.fed
        self.dog.look()
        return self.manager.fed > before


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Iterator[Scene]:
    monkeypatch.delenv("WATCHDOG_USEC", raising=False)
    made = Scene(monkeypatch)
    yield made
    os.close(made.pipe.ours)
    os.close(made.pipe.theirs)


def test_it_is_fed_while_all_is_well(scene: Scene) -> None:
    assert all(scene.feeds(1.7) for _ in range(20))


@pytest.mark.row("O6")
@pytest.mark.parametrize(("seconds", "fed"), [(STUCK_S, True), (STUCK_S + 0.01, False)])
def test_a_solver_without_headway_starves_it(scene: Scene, seconds: float, fed: bool) -> None:
    scene.solver.seconds = seconds
    assert scene.feeds() == fed


@pytest.mark.row("O6")
def test_a_robot_that_is_not_woken_starves_it(scene: Scene) -> None:
    scene.is_ticking = False
    assert not scene.feeds()


@pytest.mark.row("O6")
def test_bytes_that_nobody_reads_starve_it_until_somebody_does(scene: Scene) -> None:
    assert scene.feeds()
    os.write(scene.pipe.theirs, b"twice")
    assert scene.feeds(1.0)
    assert scene.feeds(STUCK_S - 1)
    assert not scene.feeds(1.1)
    scene.pipe.read()
    assert scene.feeds(1.0)


def test_a_reader_that_reads_more_slowly_than_it_is_written_to_feeds_it(scene: Scene) -> None:
    for _ in range(10):
        os.write(scene.pipe.theirs, b"x" * 200)
        scene.pipe.read()
        assert scene.feeds(2.0)


def test_a_reader_without_bytes_or_without_a_port_is_held_against_nobody(scene: Scene) -> None:
    assert all(scene.feeds(STUCK_S) for _ in range(3))
    os.write(scene.pipe.theirs, b"x")
    scene.pipe.is_open = False
    assert all(scene.feeds(STUCK_S) for _ in range(3))
    assert not has_bytes(-1)


def test_a_hang_is_ended_within_fifteen_seconds(scene: Scene) -> None:
    """Of systemd's ten from the last sign of life, which may come until it counts as stuck."""
    assert STUCK_S + 10.0 + scene.dog.every_s < 16.0
    assert STUCK_S + 10.0 < 15.0


@pytest.mark.row("O2")
@pytest.mark.parametrize(("seconds", "said"), [(DISK_STUCK_S - 0.1, False), (DISK_STUCK_S, True)])
def test_a_disk_that_hangs_is_named(seconds: float, said: bool) -> None:
    disk = Idle()
    disk.seconds = seconds
    assert bool(slow_disk(disk)) == said
    assert not said or "has not answered for 8 s" in slow_disk(disk)
