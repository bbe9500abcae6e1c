"""What a configuration chooses: network, wheels, DBC file, calibration, recording."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from drslamd.config import Config, ConfigError, GossipSection
from drslamd.config_wheels import DbcSection, SerialWheelSection
from drslamd.host.owners import denied
from drslamd.host.plain_file import read_plain
from drslamd.io.can_bus import CanBus, require_python_can
from drslamd.io.clock import Clock
from drslamd.io.liblcm import Liblcm, require_lcm
from drslamd.io.multicast import Multicast
from drslamd.io.ports.reading_round import ReadingRound
from drslamd.io.recording.log_files import LogFiles
from drslamd.io.recording.provenance import clocks, provenance
from drslamd.io.recording.recorder import NoRecorder, Recorder
from drslamd.io.serial_port import SerialPort
from drslamd.io.state_store import read_key
from drslamd.io.transport import Transport
from drslamd.recording.encoder import Encoder
from drslamd.recording.records import Beginning
from drslamd.robot import Robot
from drslamd.sensors.wheels.dbc_file import decoded
from drslamd.sensors.wheels.wheel_input import is_stamped
from drslamd.setup.calibration_file import MAX_BYTES, Taped, UnusableCalibration, read
from drslamd.slam.calibration.sensor_calibration import UNLEARNED, SensorCalibration
from drslamd.slam.relocation.last_place import LastPlace

Handle = Callable[[Any], None]
"""Takes an event."""


def team_secret(config: Config) -> bytes | None:
    """What seals the messages of the team; None where it has asked to run without.

    Raises:
        ConfigError: the key cannot be used; or there is none, other computers can be reached, and
            nobody wrote down that all of them are trusted.
    """
    team, network = config.team, network_name(config.gossip)
    if not team.insecure:
        return read_key(team.key_file)
    if not stays_on_this_host(config.gossip) and team.trust_everyone_on != network:
        instead = f", not {team.trust_everyone_on!r}" if team.trust_everyone_on else ""
        fault = (
            f"team.insecure = true: whoever is on the network {network} could forge messages; "
            "make a key with drslamd keygen FILE and set team.key_file, or, if every computer "
            f"there is trusted, team.trust_everyone_on = {network!r}{instead}"
        )
        raise ConfigError([fault])
    return None


def network_name(section: GossipSection) -> str:
    """What the network of the team is called: its interface, or the group that any may carry."""
    return section.interface or section.group


def stays_on_this_host(section: GossipSection) -> bool:
    """Can no other computer hear the team, nor speak to it?"""
    if section.provider == "liblcm" and section.url:
        scheme, _, rest = section.url.partition("://")
        ttl = re.search(r"ttl=(\d+)", rest)
        return scheme == "udpm" and (ttl is None or int(ttl[1]) == 0)  # LCM's default is 0
    return section.ttl == 0 or section.interface == "lo" or section.interface.startswith("127.")


def make_transport(
    config: Config,
    clock: Clock,
    handle: Handle,
    is_news: Callable[[bytes], bool] = lambda data: False,
) -> Transport:
    """
    Args:
        is_news: is a datagram proven to be a robot's, and new?

    Raises:
        ConfigError: the chosen package is not installed.
    """
    section = config.gossip
    if section.provider == "liblcm":
        require_lcm()
        return Liblcm(section, clock, handle)
    return Multicast(section, clock, handle, is_news)


def make_ports(
    config: Config, clock: Clock, handle: Handle, is_read: Callable[[], bool]
) -> tuple[SerialPort, SerialPort | CanBus]:
    """Those of the UWB module and of the wheels, read in rounds where nobody waits.

    Args:
        is_read: does somebody take poses on the local socket, each as soon as it is there?

    Raises:
        ConfigError: a chosen package is not installed.
    """
    rounds = ReadingRound(lambda: is_read() or config.near.lcm_hz > 0)
    uwb = SerialPort("uwb", config.uwb.port, config.uwb.baud, clock, handle, rounds)
    return uwb, make_wheels(config, clock, handle, rounds)


def make_wheels(
    config: Config, clock: Clock, handle: Handle, rounds: ReadingRound | None = None
) -> SerialPort | CanBus:
    """
    Args:
        rounds: for a base that stamps what it sends.

    Raises:
        ConfigError: the chosen package is not installed.
    """
    section = config.wheels
    if isinstance(section, SerialWheelSection):
        stamped = rounds if is_stamped(section) else None
        return SerialPort("wheels", section.port, section.baud, clock, handle, stamped)
    require_python_can()
    return CanBus(section.can, clock, handle)


def dbc_text(config: Config) -> str:
    """What the DBC file says, empty without one.

    Raises:
        ConfigError: the file cannot be read.
    """
    if not isinstance(config.wheels, DbcSection):
        return ""
    path = Path(config.wheels.dbc_file)
    try:
        return decoded(path.read_bytes())
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        remedy = denied(path) if isinstance(error, PermissionError) else "correct the path"
        raise ConfigError([f"wheels.dbc_file = {str(path)!r}: {reason}; {remedy}"]) from None


def make_recorder(
    config: Config,
    clock: Clock,
    state_dir: Path,
    dbc_text: str,
    key: bytes,
    taped: SensorCalibration = UNLEARNED,
) -> Recorder | NoRecorder:
    """What keeps all that is heard and done, if `daemon.record` says so."""
    section = config.daemon
    if not section.record:
        return NoRecorder()
    folder = Path(section.record_dir) if section.record_dir else state_dir / "recordings"
    files = LogFiles(folder, config.robot.id, section.record_mb << 20)
    encoder = Encoder(config.robot.id, is_framed=config.gossip.provider == "native")
    origin = provenance(config, dbc_text, key, taped)
    return Recorder(files, encoder, origin, partial(clocks, clock))


def outlived(state: Mapping[str, Any]) -> dict[str, Any]:
    """What of a state file a robot begins with, beside its epoch."""
    return {
        "epochs": {int(robot): epoch for robot, epoch in state.get("epochs", {}).items()},
        "calibration": SensorCalibration.of_state(state.get("calibration", {})).state(),
        "place": state.get("place", {}),
    }


def begun_robot(make: Callable[..., Robot], begun: Beginning) -> Robot:
    """A robot that begins with that.

    Args:
        make: takes its epoch, those of its peers, and what the last start learned and where it was.
    """
    kept, place = SensorCalibration.of_state(begun.calibration), LastPlace.of_state(begun.place)
    return make(begun.epoch, dict(begun.epochs), kept, place=place)


def taped_calibration(config: Config) -> SensorCalibration:
    """What a tape says of this robot, nothing where the configuration names no file.

    Raises:
        ConfigError: the file cannot be read, or belongs to another robot or to other wheels.
    """
    path = config.robot.calibration
    if not path:
        return UNLEARNED
    try:
        taped = read_taped(Path(path))
        if taped is not None:
            return taped.calibration(config)
        reason = "No such file; make it with drslamd calibrate, or leave the key out"
    except UnusableCalibration as error:
        reason = str(error)
    raise ConfigError([f"robot.calibration = {path!r}: {reason}"])


def read_taped(path: Path) -> Taped | None:
    """What such a file says, None where there is none.

    Raises:
        UnusableCalibration: it cannot be read.
    """
    try:
        return read(read_plain(path, MAX_BYTES))
    except FileNotFoundError:
        return None
    except PermissionError as error:
        raise UnusableCalibration(f"{error.strerror}; {denied(path)}") from None
    except UnicodeDecodeError:
        raise UnusableCalibration("not a text file; make it with drslamd calibrate") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise UnusableCalibration(f"{reason}; name a file that drslamd calibrate made") from None
