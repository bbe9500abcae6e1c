"""Teams in virtual time that record: the files that real daemons would have written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lab.play import virtual_team
from lab.play.simulator import Member, Simulator
from lab.recordings import world
from lab.recordings.recording import Recording

from drslamd.events import Effect, Event
from drslamd.gossip.seal import team_key
from drslamd.io.recording.log_files import LogFiles
from drslamd.io.recording.provenance import provenance
from drslamd.io.recording.recorder import Recorder
from drslamd.recording.encoder import Encoder
from drslamd.recording.records import Beginning

SHORT = world.Scene(robots=2, seconds=40.0)
WALL_US = 1_795_745_745_000_000
"""When the world of these tests began."""


def record(member: Member, simulator: Simulator, folder: Path) -> Recorder:
    """Let a robot that was just switched on record."""
    robot, clock = member.robot, member.clock
    handle, config = robot.handle, robot.config
    files = LogFiles(folder, config.robot.id, 1 << 30)

    def clocks() -> dict[str, int]:
        now = simulator.now
        return {"utime": clock.local(now), "wall_us": WALL_US + now, "within_us": 0}

    origin = provenance(config, "", team_key(None))
    recorder = Recorder(files, Encoder(config.robot.id, True), origin, clocks)
    recorder.begin(clock.local(simulator.now), Beginning(robot.own.epoch))

    def recorded(event: Event) -> list[Effect]:
        recorder.event(event)
        effects = handle(event)
        recorder.effects(event.utime, effects)
        return effects

    robot.handle = recorded  # type: ignore[method-assign]
    return recorder


def record_team(
    folder: Path, recording: Recording, extra: str = "", until_s: float | None = None, **more: Any
) -> Simulator:
    """A team that has driven, and whose recordings are in the folder."""
    simulator = virtual_team.start(recording, extra=extra, **more)
    recorders = [record(member, simulator, folder) for member in simulator.members.values()]
    simulator.run(recording.duration + virtual_team.SETTLE_S if until_s is None else until_s)
    for recorder in recorders:
        recorder._flush()
        recorder._files.close()
    return simulator
