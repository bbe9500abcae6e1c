"""What the daemon will not start with: `run` asks this before it opens anything, and `check` too.

Nothing is judged here a second time: each look calls what the daemon itself will call.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator

from drslamd.config import Config, ConfigError
from drslamd.config_wheels import CanWheelSection, DbcSection
from drslamd.io.can_bus import require_python_can
from drslamd.io.claim import holder, is_held
from drslamd.io.liblcm import require_lcm
from drslamd.machine.finding import Finding, Severity
from drslamd.machine.folders import socket_path, socket_to_ask, state_dir
from drslamd.parts import dbc_text, taped_calibration, team_secret

MICROSECONDS_NEED = 1 << 60
"""Stamps and their products are 64-bit integers."""
SECOND_DAEMON = "second daemon"
"""The check of which the findings end with an exit code of their own."""


def refusals(config: Config) -> list[Finding]:
    """Why the daemon would not start, causes first; empty when it would."""
    living = second_daemon(config)
    return [*([living] if living else []), *_faults(config)]


def of_config(error: ConfigError) -> list[Finding]:
    """A configuration that cannot be used."""
    return [_error("configuration", fault) for fault in error.faults]


def second_daemon(config: Config) -> Finding | None:
    """A daemon that runs with this configuration, as a service or by hand."""
    try:
        places = {socket_to_ask(config): None, socket_path(config): None}
    except ConfigError:
        return None  # said by another check
    for path in places:
        if is_held(path):
            return already_runs(config, holder(path))
    return None


def already_runs(config: Config, process: str) -> Finding:
    """What a second daemon of a configuration is told."""
    by = f" ({process})" if process else ""
    return Finding(
        SECOND_DAEMON,
        Severity.ERROR,
        f"a daemon already runs as robot {config.robot.id} here{by}",
        f"stop it first: systemctl stop drslamd@{config.robot.id}, or Ctrl-C where it runs",
    )


def _faults(config: Config) -> Iterator[Finding]:
    for check, look in LOOKS.items():
        try:
            look(config)
        except ConfigError as error:
            yield from (_error(check, fault) for fault in error.faults)


def _error(check: str, fault: str) -> Finding:
    cause, _, remedy = fault.partition("; ")
    return Finding(check, Severity.ERROR, cause, remedy)


def _word_size(_config: Config) -> None:
    if sys.maxsize < MICROSECONDS_NEED:
        fault = (
            "this is a 32-bit system, on which numpy counts microseconds wrongly; install a 64-bit "
            "one (Raspberry Pi OS 64-bit)"
        )
        raise ConfigError([fault])


def _transport(config: Config) -> None:
    if config.gossip.provider == "liblcm":
        require_lcm()


def _can(config: Config) -> None:
    if isinstance(config.wheels, CanWheelSection):
        require_python_can()


def _dbc(config: Config) -> None:
    if isinstance(config.wheels, DbcSection):
        # the sensors take their time to load
        from drslamd.sensors.wheels.wheel_input import WheelInput

        WheelInput(config.wheels, dbc_text(config))


LOOKS: dict[str, Callable[[Config], object]] = {
    "computer": _word_size,
    "folders": state_dir,
    "team key": team_secret,
    "lcm": _transport,
    "python-can": _can,
    "dbc": _dbc,
    "calibration": taped_calibration,
}
"""In the order in which one fault follows from another; each raises ConfigError."""
