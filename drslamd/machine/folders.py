"""Where a robot keeps its state and answers questions, and where whoever asks it looks."""

from __future__ import annotations

import os
from pathlib import Path

from drslamd.config import Config, ConfigError

SERVICE_RUNTIME = Path("/run/drslamd")
"""RuntimeDirectory= of systemd/drslamd@.service."""


def state_dir(config: Config) -> Path:
    """Where this robot keeps its state: as configured, as systemd says, or in the home.

    Raises:
        ConfigError: nobody says where.
    """
    named = config.daemon.state_dir or os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    return Path(named) if named else _home() / ".local" / "state" / "drslamd"


def _home() -> Path:
    try:
        home = Path.home()
    except RuntimeError:
        home = Path()
    if not os.environ.get("HOME", "/") or not home.is_absolute():
        fault = (
            "daemon.state_dir: not given, and this user has no home (HOME is not set) in which "
            'the state could be kept; set it, for instance to "/var/lib/drslamd"'
        )
        raise ConfigError([fault])
    return home


def socket_path(config: Config) -> Path:
    """Where this robot answers questions.

    Raises:
        ConfigError: nobody says where.
    """
    if config.daemon.status_socket:
        return Path(config.daemon.status_socket)
    runtime = os.environ.get("RUNTIME_DIRECTORY", "").split(":")[0]
    return (Path(runtime) if runtime else state_dir(config)) / _socket_name(config)


def near_path(status: Path) -> Path:
    """Where a robot tells its pose as often as it can, beside where it answers questions."""
    return status.with_suffix(".near")


def socket_to_ask(config: Config) -> Path:
    """Where a running daemon of this robot answers: the service's, if there is one.

    Raises:
        ConfigError: nobody says where.
    """
    service = SERVICE_RUNTIME / _socket_name(config)
    if config.daemon.status_socket or "RUNTIME_DIRECTORY" in os.environ:
        return socket_path(config)
    try:
        service.stat()
    except FileNotFoundError:
        return socket_path(config)
    except OSError:
        pass  # there, but not for this user: to ask will say so
    return service


def _socket_name(config: Config) -> str:
    return f"drslamd-{config.robot.id}.sock"
