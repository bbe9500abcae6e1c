"""Sensors without a daemon: their ports are opened, and a person moves the robot.

Everything has an end: what does not begin, or does not end, within the time that it was given is a
fault with its reason, and so is a port that a daemon holds.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from enum import Enum
from typing import Any, NamedTuple, Union

from drslamd.config import Config
from drslamd.config_wheels import SerialWheelSection
from drslamd.conventions import SECOND_US
from drslamd.events import CanFrame, Event, PortCondition, PortState, SerialData
from drslamd.io.clock import Clock, MonotonicClock
from drslamd.io.serial_port import SerialPort
from drslamd.parts import dbc_text, make_wheels
from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput
from drslamd.sensors.samples import Motion, RangeSample
from drslamd.sensors.wheels.wheel_input import WheelInput
from drslamd.setup.way import Phase, Way, WayWatch
from drslamd.setup.wheel_scales import step_m

LOOK_S = 0.02
"""Also how often a base that must be asked may be."""
LISTEN_US = 6 * SECOND_US
"""Until a sensor has to be heard; a second longer than it takes to say why it is not."""
TELL_US = SECOND_US // 4
MAX_SAMPLES = 20_000
"""Ranges of a minute to a team of seven; nobody measures longer."""


class Why(Enum):
    """What kind of fault it is."""

    BUSY = "another program holds the port"
    PORT = "the port cannot be used"
    SENSOR = "the sensor says nothing of use"
    TIME = "it took too long"


class NotMeasured(NamedTuple):
    """Why nothing was measured, in one sentence."""

    why: Why
    sentence: str


class Seen(NamedTuple):
    """How far it is, for whoever waits: told when it changes, and now and then."""

    phase: Phase
    way: Way


async def measured_way(
    config: Config, within_s: float, tell: Callable[[Seen], None]
) -> Union[Way, NotMeasured]:
    """Until the robot was moved and stands again.

    Raises:
        ConfigError: a file or a package that the wheels need is not there.
    """
    wheels = WheelInput(config.wheels, dbc_text(config))
    watch = WayWatch(config.wheels.track_m, step_m(config.wheels) or 0.0)
    heard: list[PortState] = []

    def take(event: Event) -> None:
        if isinstance(event, PortState):
            heard.append(event)
            return
        for motion in _motions(wheels, event):
            watch.add(motion)

    clock = MonotonicClock()
    port = make_wheels(config, clock, take)
    async with _running(port):
        begin, told, told_phase = clock.now(), 0, Phase.ENDED
        while True:
            await asyncio.sleep(LOOK_S)
            now = clock.now()
            if isinstance(port, SerialPort) and wheels.must_be_asked and (ask := wheels.poll(now)):
                port.write(ask)
            if fault := _port_fault(heard, config) or _silence(wheels, begin, now):
                return fault
            if watch.phase is Phase.BROKEN:
                return NotMeasured(Why.SENSOR, "the wheels were not heard for a moment: once again")
            is_heard = wheels.last_motion_utime is not None
            if is_heard and (watch.phase is not told_phase or now - told > TELL_US):
                told, told_phase = now, watch.phase
                tell(Seen(watch.phase, watch.way()))
            if watch.phase is Phase.ENDED:
                return watch.way()
            if now - begin > within_s * SECOND_US:
                return _too_late(watch, within_s)


async def measured_ranges(
    config: Config, peer_uwb_id: int, seconds: float, tell: Callable[[float], None]
) -> Union[list[RangeSample], NotMeasured]:
    """All ranges to one module that come within some seconds; `tell` hears how many have passed."""
    module = LinkTrackInput(config.uwb_id, config.uwb.max_range_m)
    samples: list[RangeSample] = []
    heard: list[PortState] = []

    def take(event: Event) -> None:
        if isinstance(event, PortState):
            heard.append(event)
        elif isinstance(event, SerialData) and len(samples) < MAX_SAMPLES:
            samples.extend(module.feed(event.data, event.utime))

    clock: Clock = MonotonicClock()
    port = SerialPort("uwb", config.uwb.port, config.uwb.baud, clock, take)
    async with _running(port):
        begin = clock.now()
        while (passed := clock.now() - begin) < seconds * SECOND_US:
            await asyncio.sleep(LOOK_S)
            if fault := _port_fault(heard, config):
                return fault
            if module.last_good_utime is None and passed > LISTEN_US:
                advice = module.advice(clock.now()) or "the LinkTrack says nothing"
                return NotMeasured(Why.SENSOR, advice)
            tell(passed / SECOND_US)
    fitting = [sample for sample in samples if sample.peer_uwb_id == peer_uwb_id]
    others = sorted({sample.peer_uwb_id for sample in samples})
    if not fitting:
        there = f"only {', '.join(map(str, others))}" if others else "no other"
        return NotMeasured(Why.SENSOR, f"no range to module {peer_uwb_id}: {there} is heard")
    return fitting


def _motions(wheels: WheelInput, event: Event) -> list[Motion]:
    if isinstance(event, SerialData):
        return wheels.feed(event.data, event.utime)
    return wheels.on_frame(event) if isinstance(event, CanFrame) else []


@asynccontextmanager
async def _running(port: Any) -> AsyncIterator[None]:
    """A port that is open for so long."""
    task = asyncio.ensure_future(port.run())
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


def _port_fault(heard: list[PortState], config: Config) -> NotMeasured | None:
    """Of the last state of a port."""
    if not heard or heard[-1].condition is PortCondition.OPEN:
        return None
    state = heard[-1]
    if state.condition is PortCondition.BUSY:
        path = config.uwb.port if state.port == "uwb" else _wheel_port(config)
        return NotMeasured(
            Why.BUSY,
            f"{path} is in use; stop the daemon first: systemctl stop drslamd@{config.robot.id}",
        )
    return NotMeasured(Why.PORT, state.detail)


def _wheel_port(config: Config) -> str:
    wheels = config.wheels
    return wheels.port if isinstance(wheels, SerialWheelSection) else str(wheels.can.channel)


def _silence(wheels: WheelInput, begin: int, now: int) -> NotMeasured | None:
    last = wheels.last_motion_utime
    if now - (begin if last is None else last) < LISTEN_US:
        return None
    return NotMeasured(Why.SENSOR, wheels.advice(now) or "the wheels say nothing")


def _too_late(watch: WayWatch, within_s: float) -> NotMeasured:
    way = watch.way()
    if watch.phase is Phase.STANDING:
        return NotMeasured(
            Why.TIME,
            f"no wheel moved within {within_s:g} s: push it; if you did, look at its encoders",
        )
    said = f"left {way.left_m:.2f} m, right {way.right_m:.2f} m so far"
    return NotMeasured(
        Why.TIME, f"it did not stand still for two seconds within {within_s:g} s ({said})"
    )
