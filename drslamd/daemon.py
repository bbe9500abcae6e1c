"""One robot's process: the pure `Robot` between its ports, its network and its clock.

Everything here is wiring. Events come from the ports and go into `Robot.handle`; the effects that
come back are carried out. Computations run in one worker thread, so that sensors are read on time
while a solve runs; their results come back as events.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any

from drslamd import report
from drslamd.config import Config
from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.events import (
    Effect,
    Event,
    JobDone,
    Note,
    Restart,
    Save,
    SaveDone,
    Send,
    Slept,
    Solve,
    Stop,
    Tick,
    Write,
)
from drslamd.gossip.envelopes.opening import is_news_of_a_member
from drslamd.gossip.seal import team_key
from drslamd.host.ending import stops
from drslamd.io.clock import Clock, MonotonicClock, cpu_s
from drslamd.io.logs import get_logger
from drslamd.io.near_socket import NearSocket
from drslamd.io.pace import Pace
from drslamd.io.serial_port import SerialPort
from drslamd.io.state_store import StateStore
from drslamd.io.status_socket import StatusSocket
from drslamd.io.systemd import Notifier
from drslamd.io.wall_clock import read_wall_clock
from drslamd.io.watch.sleep_watch import SleepWatch
from drslamd.io.watch.watchdog import Watchdog, slow_disk
from drslamd.io.worker import Finished, Worker
from drslamd.machine.folders import near_path, socket_path, state_dir
from drslamd.parts import (
    begun_robot,
    dbc_text,
    make_ports,
    make_recorder,
    make_transport,
    outlived,
    taped_calibration,
    team_secret,
)
from drslamd.recording.records import Beginning
from drslamd.reports import graph_report
from drslamd.robot import Robot
from drslamd.slam import headway

RESTARTS_APART_US = 30 * SECOND_US
"""Between two restarts in one process, twice as long after each: a robot that is lied to about its
own past still has a present."""

log = get_logger()


class Daemon:
    """Owns the ports, the sockets, the clock and the one `Robot`."""

    def __init__(self, config: Config, clock: Clock | None = None) -> None:
        """
        Raises:
            ConfigError: the team key, the DBC file, the calibration or a chosen package cannot be
                used.
        """
        self._config = config
        self._clock = clock or MonotonicClock()
        secret = team_secret(config)
        self._store = StateStore(state_dir(config), config.robot.id)
        state = self._store.load()
        self._load_fault = self._store.fault
        key, dbc, taped = team_key(secret), dbc_text(config), taped_calibration(config)
        self._make_robot = partial(Robot, config, key, dbc_text=dbc, taped=taped)
        self._recorder = make_recorder(config, self._clock, state_dir(config), dbc, key, taped)
        last = outlived(state)
        epoch = self._store.begin(last, state.get("epoch", 0))
        self.robot = self._new_robot(Beginning(epoch, **last))
        self._ends: Robot | None = None
        """The robot in whose place another one is about to begin."""
        self._may_restart_at, self._restart_apart = 0, RESTARTS_APART_US
        is_news = lambda data: is_news_of_a_member(self.robot.team.seal, data)  # noqa: E731
        self._transport = make_transport(config, self._clock, self.handle, is_news)
        self._near = NearSocket(near_path(socket_path(config)), self._clock)
        is_read = lambda: self._near.has_readers  # noqa: E731
        self._uwb, self._wheels = make_ports(config, self._clock, self.handle, is_read)
        self._pace = Pace()
        questions: dict[str, Callable[[], Any]] = {
            "status": self._picture,
            "trajectory": self._paths,
            "graph": self._graph,
            "closures": lambda: report.closures(self.robot),
        }
        self._status = StatusSocket(socket_path(config), questions)
        self._notifier = Notifier()
        self._worker, self._disk = Worker(headway.marks), Worker()
        readers = (self._uwb, self._wheels, self._transport)
        self._watchdog = Watchdog(self._notifier, self._worker, readers, self._is_ticking)
        self._sleep = SleepWatch()
        self._timer: asyncio.TimerHandle | None = None
        self._due = self._asked = 0
        self._stop = asyncio.Event()
        self._failure: BaseException | None = None
        self._carry_out: dict[type[Any], Callable[[Any], None]] = {
            Send: lambda e: self._transport.send(e.channel, e.payload),
            Write: self._write,
            Solve: self._solve,
            Save: self._save,
            Restart: self._restart,
            Note: _note,
        }

    async def run(self) -> None:
        """Until SIGTERM, SIGINT or the end of its terminal; a fault of ours is raised."""
        loop = asyncio.get_running_loop()
        for number in stops():
            loop.add_signal_handler(number, self.stop)
        loop.set_exception_handler(
            lambda _, context: self._fail(
                context.get("exception") or RuntimeError(context["message"])
            )
        )
        self._worker.start()
        self._disk.start()
        self._recorder.start()
        log.info("daemon.start", robot=self._config.robot.id, epoch=self.robot.own.epoch)
        if self._config.team.insecure:
            log.warning("team.insecure", remedy="make a key with: drslamd keygen")
        if self._load_fault:
            log.warning("state.fault", what=self._load_fault)
        self.handle(SaveDone(self._clock.now(), self._store.fault))
        parts = (self._transport.run(), self._uwb.run(), self._wheels.run(), self._feed_watchdog())
        tasks = [self._start(part) for part in parts]
        for fault in (await self._status.open(), self._near.open()):
            if fault:
                log.warning("status.fault", what=fault)
        self.handle(Tick(self._clock.now()))
        self._notifier.ready()
        await self._stop.wait()
        self._notifier.stopping()
        await self._end(tasks)
        if self._failure is not None:
            raise self._failure

    def stop(self) -> None:
        """End `run` in order, as SIGTERM does."""
        self._stop.set()

    def handle(self, event: Event) -> None:
        """One event in, its effects carried out; an exception is our bug and ends the daemon."""
        if self._failure is not None:
            return
        slept_us = self._sleep.slept_us()
        first = [Slept(self._clock.now(), slept_us)] if slept_us else []
        for each in (*first, event):
            for effect in self._answers(each):
                self._perform(effect)
        self._wake()
        self._near.tell(self.robot.near)

    def _new_robot(self, begun: Beginning) -> Robot:
        self._recorder.begin(self._clock.now(), begun)
        return begun_robot(self._make_robot, begun)

    def _answers(self, event: Event) -> list[Effect]:
        # recorded before it is tried, so that a bug can be replayed
        self._recorder.event(event)
        effects = self.robot.handle(event)
        self._recorder.effects(event.utime, effects)
        return effects

    def _perform(self, effect: Effect) -> None:
        self._carry_out[type(effect)](effect)

    def _wake(self) -> None:
        """Tick when the robot wants to be woken."""
        due, now = self.robot.next_tick, self._clock.now()
        if self._timer is not None and self._due == due:
            return
        if self._timer is not None:
            self._timer.cancel()
        # (what waits behind a pause was due before anybody could be asked to wake it)
        self._due, self._asked = due, max(due, now)
        wait_s = (self._asked - now) / SECOND_US
        self._timer = asyncio.get_running_loop().call_later(wait_s, self._tick)

    def _tick(self) -> None:
        self._timer, now = None, self._clock.now()
        self._pace.lags.append((now - self._asked) / MILLISECOND_US)
        self.handle(Tick(now))

    # effects

    def _write(self, effect: Write) -> None:
        if effect.port != "wheels" or not isinstance(self._wheels, SerialPort):
            raise AssertionError(f"nothing may be written to {effect.port}")
        self._wheels.write(effect.data)

    def _solve(self, effect: Solve) -> None:
        robot = self.robot

        def done(finished: Finished) -> None:
            if finished.error is not None:
                raise finished.error
            if robot is self.robot:
                self._pace.took(effect.name, 1e3 * finished.seconds)
                elapsed = round(finished.seconds * SECOND_US)
                self.handle(JobDone(self._clock.now(), effect.job_id, finished.result, elapsed))

        self._worker.submit(effect.run, done)

    def _restart(self, effect: Restart) -> None:
        """A new robot in the place of the old one, as soon as its epoch is kept."""
        old, now = self.robot, self._clock.now()
        if now < self._may_restart_at:
            return
        self._ends, self._may_restart_at = old, now + self._restart_apart
        self._restart_apart *= 2
        log.warning("epoch.restart", epoch=old.own.epoch, above=effect.above, why=effect.why)

        def done(finished: Finished) -> None:
            if finished.error is not None:
                raise finished.error
            self._succeed(old, finished.result)

        self._disk.submit(partial(self._store.begin, old.memory.state(), effect.above), done)

    def _succeed(self, old: Robot, epoch: int) -> None:
        """Begin again under a new epoch; ports and network stay as they are."""
        kept = {**old.memory.state(), "epoch": epoch, "epochs": dict(old.team.seal.epochs)}
        self.robot = self._new_robot(Beginning(**kept))
        for state in (*old.ports.values(), old.network):
            if state is not None:
                self.handle(state)
        self.handle(SaveDone(self._clock.now(), self._store.fault))

    def _save(self, effect: Save) -> None:
        # a sync can take seconds on an SD card; neither the loop nor a solve waits for it
        if self.robot is self._ends:
            return  # the epoch of its successor is on the disk, or will be

        def done(finished: Finished) -> None:
            if finished.error is not None:
                raise finished.error
            self.handle(SaveDone(self._clock.now(), self._store.fault))

        self._disk.submit(partial(self._store.save, effect.state), done)

    # life

    def _start(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = asyncio.ensure_future(work)
        task.add_done_callback(self._ended)
        return task

    def _ended(self, task: asyncio.Task[None]) -> None:
        if task.cancelled():
            return
        error = task.exception()
        if error is None and not self._stop.is_set():
            error = RuntimeError("a part of the daemon ended that must not end")
        if error is not None:
            self._fail(error)

    def _fail(self, error: BaseException | None) -> None:
        """Our own bug: say so once, and end."""
        if self._failure is None:
            self._failure = error
        self._stop.set()

    async def _feed_watchdog(self) -> None:
        while True:
            await asyncio.sleep(self._watchdog.every_s)
            self._watchdog.look()
            self._notifier.status(self._one_line)

    def _is_ticking(self) -> bool:
        return self._clock.now() - self.robot.next_tick < SECOND_US

    def _complaints(self) -> list[str]:
        """What only the process knows to be wrong."""
        said = (slow_disk(self._disk), self._transport.complaint(), *self._recorder.problems())
        return [sentence for sentence in said if sentence]

    def _picture(self) -> dict[str, Any]:
        """The robot's own picture, and what only the process knows."""
        picture = report.status(self.robot, self._clock.now())
        picture["network"]["dropped"] = self._transport.dropped
        picture["network"]["flooded"] = self._transport.flooded
        picture["wheels"]["counters"].update(self._wheels.counters())
        picture["cpu_s"], picture["recording"] = round(cpu_s(), 3), self._recorder.status()
        picture["problems"] += self._complaints()
        return {**picture, "ms": self._pace.milliseconds(), "loop_lag_ms": self._pace.lag()}

    def _paths(self) -> dict[str, Any]:
        paths = report.trajectories(self.robot, self._clock.now())
        return {**paths, "wall": read_wall_clock(self._clock)._asdict()}

    def _graph(self) -> dict[str, Any]:
        graph = graph_report.graph(self.robot, self._clock.now())
        windows = report.closures(self.robot)["closures"]
        return {**graph, "windows": windows, "wall": read_wall_clock(self._clock)._asdict()}

    def _one_line(self) -> str:
        picture = report.status(self.robot, self._clock.now())
        alive = sum(peer["alive"] for peer in picture["peers"].values())
        problems = "; ".join(picture["problems"] + self._complaints())
        key = "INSECURE, " if picture["insecure"] else ""
        said = f"; {problems}" if problems else ""
        return f"{key}{picture['pose']['state']}, {alive} peers{said}"

    async def _end(self, tasks: list[asyncio.Task[None]]) -> None:
        """Say goodbye, keep the state, let go of everything; nobody waits for the solver."""
        if self._timer is not None:
            self._timer.cancel()
        if self._failure is None:
            for effect in self._answers(Stop(self._clock.now())):
                if isinstance(effect, Save):
                    self._store.save(effect.state)
                else:
                    self._perform(effect)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self._status.close()
        self._near.close()
        await self._recorder.close()
        self._worker.stop()
        self._disk.stop()
        log.info("daemon.stop", robot=self._config.robot.id)


def _note(note: Note) -> None:
    log.log(_LEVELS[note.level.value], note.event, **note.fields)


_LEVELS = {"info": 20, "warning": 30}
