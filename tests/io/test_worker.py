"""The one thread for what takes long."""

from __future__ import annotations

import asyncio
import gc
import threading
import time
import weakref
from collections.abc import Callable

import pytest

from drslamd.io.worker import WHOLE_LOOK_S, Finished, GarbageLooks, Worker


def test_the_worker_hands_back_results_and_exceptions_in_order() -> None:
    async def run() -> list[Finished]:
        worker, out = Worker(), []
        worker.start()
        done = asyncio.Event()

        def take(finished: Finished) -> None:
            out.append(finished)
            if len(out) == 2:
                done.set()

        worker.submit(lambda: 6 * 7, take)
        worker.submit(lambda: 1 // 0, take)
        await asyncio.wait_for(done.wait(), 10)
        worker.stop()
        return out

    good, bad = asyncio.run(run())
    assert (good.result, good.error) == (42, None)
    assert isinstance(bad.error, ZeroDivisionError)


def with_worker(work: Callable[[Worker, Callable[[Finished], None]], None], count: int) -> None:
    """Let a worker do `count` things; `done` is called in the loop's own thread."""

    async def run() -> None:
        worker, left, over = Worker(), [count], asyncio.Event()
        worker.start()

        def done(_: Finished) -> None:
            assert threading.current_thread() is threading.main_thread()
            left[0] -= 1
            if not left[0]:
                over.set()

        work(worker, done)
        await asyncio.wait_for(over.wait(), 10)
        worker.stop()

    asyncio.run(run())


def test_computations_run_one_after_the_other_in_a_thread_of_their_own() -> None:
    running, most, threads = [0], [0], set()

    def compute() -> None:
        running[0] += 1
        most[0] = max(most[0], running[0])
        threads.add(threading.current_thread().name)
        threading.Event().wait(0.005)
        running[0] -= 1

    def work(worker: Worker, done: Callable[[Finished], None]) -> None:
        for _ in range(5):
            worker.submit(compute, done)

    with_worker(work, 5)
    assert (most[0], threads) == (1, {"worker"})


def test_how_long_it_took_is_told() -> None:
    took: list[float] = []

    def work(worker: Worker, done: Callable[[Finished], None]) -> None:
        def note(finished: Finished) -> None:
            took.append(finished.seconds)
            done(finished)

        worker.submit(lambda: threading.Event().wait(0.05), note)

    with_worker(work, 1)
    assert 0.04 < took[0] < 5.0


def test_when_the_loop_has_closed_the_thread_ends_and_computes_nothing_more() -> None:
    ran = threading.Event()

    async def run() -> None:
        worker = Worker()
        worker.start()
        worker.submit(lambda: threading.Event().wait(0.05), lambda _: None)
        worker.submit(ran.set, lambda _: None)
        worker.stop()

    asyncio.run(run())
    assert not ran.wait(0.2)


@pytest.mark.parametrize("fault", [KeyboardInterrupt, SystemExit, ZeroDivisionError])
def test_no_exception_ends_the_thread(fault: type[BaseException]) -> None:
    found: list[BaseException | None] = []

    def fail() -> None:
        raise fault

    def work(worker: Worker, done: Callable[[Finished], None]) -> None:
        def note(finished: Finished) -> None:
            found.append(finished.error)
            done(finished)

        for run in (fail, lambda: None):
            worker.submit(run, note)

    with_worker(work, 2)
    assert isinstance(found[0], fault)
    assert found[1] is None


@pytest.mark.row("T1")
@pytest.mark.row("O6")
def test_how_long_it_is_stuck_counts_from_its_last_step_on_a_clock_that_nobody_sets(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now, made = [1000.0], [0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    monkeypatch.setattr(time, "time_ns", lambda: 4 * 10**18)
    monkeypatch.setattr(time, "time", lambda: 4e9)
    worker = Worker(lambda: made[0])
    assert worker.stuck_s() == 0.0
    worker.submit(lambda: None, lambda _: None)
    now[0] += 3.0
    assert worker.stuck_s() == 3.0
    made[0] += 1
    assert worker.stuck_s() == 0.0
    now[0] += 2.0
    assert worker.stuck_s() == 2.0


@pytest.mark.row("O6")
def test_who_waits_for_nothing_is_not_stuck(monkeypatch: pytest.MonkeyPatch) -> None:
    """And an old computation that came to its end says nothing of a new one."""
    now = [1000.0]

    async def run() -> None:
        worker, ended = Worker(), asyncio.Event()
        worker.start()
        worker.submit(lambda: None, lambda _: ended.set())
        await asyncio.wait_for(ended.wait(), 10)
        assert worker.waiting == 0
        with monkeypatch.context() as patch:
            patch.setattr(time, "monotonic", lambda: now[0] + 1e6)
            assert worker.stuck_s() == 0.0
        worker.stop()

    asyncio.run(run())


def test_while_it_works_garbage_is_not_looked_for_in_what_was_there_before() -> None:
    during = []

    def look() -> None:
        gc.collect()
        during.append(is_there() is not None)

    gc.disable()  # or it might be found before
    try:
        left = ring()
        is_there = weakref.ref(left)
        del left
        with_worker(lambda worker, done: worker.submit(look, done), 1)
    finally:
        gc.enable()
    assert during == [True]
    gc.collect()
    assert is_there() is None


def test_what_a_look_found_in_use_is_looked_through_again_after_an_hour(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [1000.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    looks = GarbageLooks()
    gc.disable()
    looks.begin()
    try:
        used, never_used = ring(), weakref.ref(ring())
        gc.collect(1)
        assert never_used() is None
        was_used = weakref.ref(used)
        del used
        for passed, is_looked_through in ((WHOLE_LOOK_S - 1, False), (WHOLE_LOOK_S, True)):
            now[0] += passed
            gc.collect(1)
            gc.collect()
            assert (was_used() is None) is is_looked_through
    finally:
        looks.end()
        gc.enable()
    assert gc.get_freeze_count() == 0


def ring() -> Ring:
    made = Ring()
    made.itself = made
    return made


class Ring:
    """Garbage that only a look for it finds."""

    itself: Ring
