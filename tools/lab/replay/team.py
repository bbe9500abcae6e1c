"""Recordings of a team, played to it once more in virtual time: what would it have done?

The robots get the bytes of their own devices when they got them. What they say to each other is
said anew, and reaches whom it could reach then; what robots said of whom there is no recording is
said as it was. Computations are made anew and take the median of the times that were recorded.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import tomli
from pydantic import ValidationError

from drslamd.config import Config, ConfigError
from drslamd.config_faults import sentences
from drslamd.conventions import SECOND_US
from drslamd.events import (
    CanFrame,
    ChannelMessage,
    Datagram,
    Event,
    JobDone,
    NetworkState,
    PortState,
    SerialData,
    Stop,
)
from drslamd.gossip import lc02
from drslamd.recording.records import Marked, Record
from lab.play.simulator import Clock, Network, Simulator
from lab.replay import mail
from lab.replay.runs import Run, calibration_of, key_of, taped_of

FED = (SerialData, CanFrame, PortState, NetworkState)
"""Events that come from outside the team."""
SOLVE_US = 20_000
"""Of a computation, where none was recorded."""


@dataclass
class Team:
    """Runs, and what they say together.

    Attributes:
        clocks: of each run.
        solve_us: how long computations took, the median.
    """

    runs: Sequence[Run]
    clocks: list[Clock]
    reach: mail.Reach
    solve_us: int

    @property
    def robots(self) -> list[int]:
        return sorted({run.robot for run in self.runs})

    def said(self) -> list[str]:
        """What is not whole about the recordings."""
        beginnings = [
            f"{run.files[0].name}: the beginning of this run is gone; robot {run.robot} begins in "
            "the middle of it"
            for run in self.runs
            if not run.is_whole
        ]
        return beginnings + [sentence for run in self.runs for sentence in run.said]

    @property
    def duration_s(self) -> float:
        """Until the last entry of any run."""
        return max(
            (clock.world(run.opening.utime) / SECOND_US + run.length_s())
            for run, clock in zip(self.runs, self.clocks, strict=True)
        )


def gathered(runs: Sequence[Run]) -> Team:
    """Find the clocks, with the earliest run at time 0."""
    mails = [mail.mail_of(run) for run in runs]
    clocks = mail.clocks(runs, mails)
    begins = [c.world(run.opening.utime) for run, c in zip(runs, clocks, strict=True)]
    shift = min(begins)
    clocks = [Clock(c.offset_us + round(shift * (1 + c.ppm * 1e-6)), c.ppm) for c in clocks]
    reach = mail.Reach()
    for a, sender in enumerate(runs):
        for b, receiver in enumerate(runs):
            if sender.robot != receiver.robot:
                messages = mail.travelled(mails[a], mails[b])
                reach.add(sender.robot, clocks[a], receiver.robot, messages)
    return Team(runs, clocks, reach, _median_us(runs))


def _median_us(runs: Sequence[Run]) -> int:
    took = [
        record.event.elapsed_us
        for run in runs
        for record in run.records()
        if isinstance(record, Marked) and isinstance(record.event, JobDone)
    ]
    return int(np.median(took)) if took else SOLVE_US


def configured(run: Run, extra: str) -> Config:
    """A run's configuration with other values for some keys.

    Args:
        extra: TOML.

    Raises:
        ConfigError: one sentence per fault.
    """
    try:
        changes = tomli.loads(extra)
    except tomli.TOMLDecodeError as error:
        raise ConfigError([f"not valid TOML: {error}"]) from None
    table = json.loads(json.dumps(run.opening.provenance["configuration"]))
    for section, values in changes.items():
        is_table = isinstance(values, dict) and isinstance(table.get(section, {}), dict)
        table[section] = {**table.get(section, {}), **values} if is_table else values
    try:
        return Config.model_validate_json(json.dumps(table))
    except ValidationError as error:
        raise ConfigError(sentences(error, Config)) from None


def play(
    team: Team,
    extra: str = "",
    key_file: str | None = None,
    progress: Callable[[float], None] | None = None,
    watch: Callable[[Simulator], None] | None = None,
) -> Simulator:
    """Play the runs of a team.

    Args:
        extra: TOML that changes everybody's configuration.
        watch: shown the team every second.

    Raises:
        BadRecording: a team key is not at hand.
        ConfigError: the changed configuration cannot be used.
    """
    network = Network(connected=team.reach.connects)
    simulator = Simulator(0, network, team.solve_us)
    robots = {run.robot for run in team.runs}
    for run, clock in zip(team.runs, team.clocks, strict=True):
        config, key = configured(run, extra), key_of(run, key_file)
        begin = _Playing(simulator, run, clock, config, key, robots).begin
        simulator.at(max(clock.world(run.opening.utime), 0), begin)
    end = team.duration_s
    for second in range(1, int(end) + 1):
        simulator.run(second)
        if watch:
            watch(simulator)
        if progress:
            progress(second)
    simulator.run(end)
    return simulator


class _Playing:
    """One run on its way through the simulation."""

    def __init__(
        self,
        simulator: Simulator,
        run: Run,
        clock: Clock,
        config: Config,
        key: bytes,
        robots: set[int],
    ) -> None:
        self._simulator, self._run, self._clock = simulator, run, clock
        self._config, self._key, self._robots = config, key, robots
        self._records: Iterator[Record] = iter(())

    def begin(self) -> None:
        """Switch the robot on; an earlier start of it is over."""
        earlier = self._simulator.members.get(self._run.robot)
        if earlier is not None:
            self._simulator.kill(earlier)
        began = self._run.opening.beginning
        self._member = self._simulator.add(
            self._config,
            self._clock,
            secret=None if self._config.team.insecure else self._key,
            epoch=began.epoch,
            epochs=dict(began.epochs),
            kept=calibration_of(began.calibration),
            dbc_text=self._run.opening.provenance.get("dbc", ""),
            taped=taped_of(self._run, self._config),
        )
        self._records = self._run.records()
        self._next()

    def _next(self) -> None:
        for record in self._records:
            if isinstance(record, (*FED, Stop)) or self._is_foreign(record):
                event: Any = record
                self._simulator.at(self._clock.world(event.utime), partial(self._feed, event))
                return

    def _feed(self, event: Event) -> None:
        if not self._member.running:
            return
        if isinstance(event, Stop):
            return  # at the end everybody is asked
        self._simulator.handle(self._member, lambda utime: _at(event, utime))
        self._next()

    def _is_foreign(self, record: Record) -> bool:
        """Is it a message of a robot of whom there is no recording?"""
        if isinstance(record, Datagram):
            framed = lc02.decode(record.data)
            channel = "" if isinstance(framed, lc02.FramingFault) else framed[0]
        elif isinstance(record, ChannelMessage):
            channel = record.channel
        else:
            return False
        number = channel.rpartition("_")[2]
        return not (number.isdigit() and int(number) in self._robots)


def _at(event: Any, utime: int) -> Any:
    """An event at the time that the robot's clock shows now."""
    return replace(event, utime=utime)
