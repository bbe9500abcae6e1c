"""The parts of a daemon that its configuration chooses: network, wheels, DBC file, recording."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from drslamd.config import Config, ConfigError, DbcSection, SerialWheelSection
from drslamd.host.owners import denied
from drslamd.io.can_bus import CanBus, require_python_can
from drslamd.io.clock import Clock
from drslamd.io.liblcm import Liblcm, require_lcm
from drslamd.io.multicast import Multicast
from drslamd.io.recording.log_files import LogFiles
from drslamd.io.recording.provenance import clocks, provenance
from drslamd.io.recording.recorder import NoRecorder, Recorder
from drslamd.io.serial_port import SerialPort
from drslamd.io.transport import Transport
from drslamd.recording.encoder import Encoder

Handle = Callable[[Any], None]
"""Takes an event."""


def make_transport(config: Config, clock: Clock, handle: Handle) -> Transport:
    """
    Raises:
        ConfigError: the chosen package is not installed.
    """
    section = config.gossip
    if section.provider == "liblcm":
        require_lcm()
        return Liblcm(section, clock, handle)
    return Multicast(section, clock, handle)


def make_wheels(config: Config, clock: Clock, handle: Handle) -> SerialPort | CanBus:
    """
    Raises:
        ConfigError: the chosen package is not installed.
    """
    section = config.wheels
    if isinstance(section, SerialWheelSection):
        return SerialPort("wheels", section.port, section.baud, clock, handle)
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
        return path.read_text()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        remedy = denied(path) if isinstance(error, PermissionError) else "correct the path"
        raise ConfigError([f"wheels.dbc_file = {str(path)!r}: {reason}; {remedy}"]) from None


def make_recorder(
    config: Config, clock: Clock, state_dir: Path, dbc_text: str, key: bytes
) -> Recorder | NoRecorder:
    """What keeps all that is heard and done, if `daemon.record` says so."""
    section = config.daemon
    if not section.record:
        return NoRecorder()
    folder = Path(section.record_dir) if section.record_dir else state_dir / "recordings"
    files = LogFiles(folder, config.robot.id, section.record_mb << 20)
    encoder = Encoder(config.robot.id, is_framed=config.gossip.provider == "native")
    return Recorder(files, encoder, provenance(config, dbc_text, key), partial(clocks, clock))
