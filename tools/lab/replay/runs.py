"""Recordings by run: one start of one daemon, in one file or in several."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from drslamd.config import Config, ConfigError
from drslamd.conventions import SECOND_US
from drslamd.gossip.seal import team_key
from drslamd.io.recording.log_files import parse_name, recordings
from drslamd.io.recording.provenance import fingerprint
from drslamd.io.state_store import read_key
from drslamd.recording.decoder import Decoder, Unreadable
from drslamd.recording.event_log import Damage, Entry, entries
from drslamd.recording.records import Beginning, Opening, Record, Told
from drslamd.robot import Robot
from drslamd.slam.calibration import sensor_calibration
from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration
from drslamd.slam.relocation.last_place import LastPlace, is_kept_place
from lab.recordings.recording import BadRecording


@dataclass
class Run:
    """One start of one robot's daemon.

    Attributes:
        files: of it, in order.
        opening: of the first file that is there.
        said: what is not whole about it, once it was read.
    """

    files: list[Path]
    opening: Opening
    robot: int
    said: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        return f"robot {self.robot}, {self.files[0].name}"

    @property
    def is_whole(self) -> bool:
        """Is its beginning there?"""
        return self.opening.part == 0

    def config(self) -> Config:
        """As it was recorded.

        Raises:
            BadRecording: this program knows no such configuration.
        """
        try:
            return Config.model_validate_json(json.dumps(self.opening.provenance["configuration"]))
        except (ValueError, KeyError) as error:
            raise BadRecording(f"{self.files[0]}: its configuration: {error}") from None

    def length_s(self) -> float:
        """From its first to its last entry."""
        last = self.opening.utime
        for path in self.files[-1:]:
            with path.open("rb") as file:
                for entry in entries(file):
                    last = entry.utime if isinstance(entry, Entry) else last
        return max(last - self.opening.utime, 0) / SECOND_US

    def wall_ahead_us(self) -> int:
        """How far the wall clock was ahead of the robot's own when the run began."""
        said = self.opening.provenance.get("clocks", {})
        return int(said.get("wall_us", 0)) - int(said.get("utime", 0))

    def records(self) -> Iterator[Record]:
        """Everything in it; where something is missing, `Told` of kind "gap"."""
        self.said.clear()
        decoder = Decoder()
        part = self.opening.part
        utime = self.opening.utime
        for number, path in enumerate(self.files):
            with path.open("rb") as file:
                for entry in entries(file):
                    if isinstance(entry, Damage):
                        is_end = entry.is_tail and path == self.files[-1]
                        self.said.append(
                            f"{path.name}: {'the end is cut, ' if is_end else ''}"
                            f"{entry.size} bytes at {entry.at} are no entry"
                        )
                        if not is_end:
                            yield Told(utime, "gap", {"lost": None})
                        continue
                    record, utime = decoder.decode(entry), entry.utime
                    if isinstance(record, Unreadable):
                        self.said.append(f"{path.name}: {record.reason}")
                        yield Told(utime, "gap", {"lost": None})
                        continue
                    if isinstance(record, Opening) and record.part != part + number:
                        self.said.append(f"{path.name}: part {part + number} is missing before it")
                        yield Told(utime, "gap", {"lost": None})
                        part = record.part - number
                    if record is not None:
                        yield record


def read_runs(paths: list[Path]) -> list[Run]:
    """The runs in files and folders, by robot and time.

    Raises:
        BadRecording: there is none, or a file that is none.
    """
    files: list[Path] = []
    for path in paths:
        found = recordings(path) if path.is_dir() else [path]
        if path.is_dir() and not found:
            found = [
                file
                for below in sorted(path.iterdir())
                if below.is_dir()
                for file in recordings(below)
            ]
        files += found
    if not files:
        raise BadRecording(f"{', '.join(map(str, paths))}: no robot-*.lcmlog in it")
    runs: dict[object, Run] = {}
    for path in files:
        named = parse_name(path)
        key = (path.parent, named[:2]) if named else path
        if key in runs:
            runs[key].files.append(path)
        else:
            opening, robot = _opening(path)
            runs[key] = Run([path], opening, robot)
    return sorted(runs.values(), key=lambda run: (run.robot, run.opening.beginning.epoch))


def is_recording(path: Path) -> bool:
    """Is it a recording of robots, or a folder of them?"""
    if not path.is_dir():
        return path.suffix == ".lcmlog"
    below = [path, *(p for p in path.iterdir() if p.is_dir())]
    return any(recordings(folder) for folder in below)


def make_robot(config: Config, run: Run, key: bytes, beginning: Beginning | None = None) -> Robot:
    """The robot that began then, or when the run began."""
    began = beginning or run.opening.beginning
    return Robot(
        config,
        key,
        began.epoch,
        dict(began.epochs),
        calibration_of(began.calibration),
        run.opening.provenance.get("dbc", ""),
        taped=taped_of(run, config),
        place=place_of(began.place),
    )


def taped_of(run: Run, config: Config) -> SensorCalibration:
    """What a tape said when the run was recorded, if this configuration still names a file."""
    return calibration_of(run.opening.provenance.get("taped") if config.robot.calibration else {})


def place_of(state: object) -> LastPlace | None:
    """As it was recorded; nothing where that is damaged."""
    if not isinstance(state, dict) or not is_kept_place(state):
        return None
    return LastPlace.of_state(state)


def calibration_of(state: object) -> SensorCalibration:
    """As it was recorded; nothing where that is damaged."""
    if not isinstance(state, dict) or not sensor_calibration.is_sound(state):
        return UNLEARNED
    return SensorCalibration.of_state(state)


def key_of(run: Run, key_file: str | None) -> bytes:
    """The team key that a run was made with.

    Raises:
        BadRecording: it is not at hand.
    """
    section = run.config().team
    if section.insecure:
        return team_key(None)
    try:
        key = team_key(read_key(key_file or section.key_file))
    except ConfigError as error:
        raise BadRecording(
            f"{run.name} was made with a team key, which no recording holds; give it by --key FILE "
            f"({error})"
        ) from None
    if fingerprint(key) != run.opening.provenance.get("key"):
        raise BadRecording(
            f"{key_file or section.key_file} is not the team key that {run.name} was made with"
        )
    return key


def _opening(path: Path) -> tuple[Opening, int]:
    decoder = Decoder()
    try:
        with path.open("rb") as file:
            for entry in entries(file):
                if isinstance(entry, Damage):
                    continue
                record = decoder.decode(entry)
                if isinstance(record, Opening) and decoder.robot is not None:
                    return record, decoder.robot
                reason = record.reason if isinstance(record, Unreadable) else "another LCM log"
                raise BadRecording(f"{path}: no recording of drslamd: {reason}")
    except OSError as error:
        raise BadRecording(f"{path}: {error.strerror}") from None
    raise BadRecording(f"{path}: no recording of drslamd: there is no entry in it")
