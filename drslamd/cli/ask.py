"""A question to the running daemon of one configuration."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path
from typing import Any

from drslamd.cli.parser import load
from drslamd.cli.service_user import unit_of
from drslamd.host.owners import permissions, user_name
from drslamd.io.status_socket import ask
from drslamd.machine.folders import socket_to_ask


class NoAnswer(Exception):
    """Nobody answered; the text says why and what to do."""


def ask_daemon(config_path: str, question: str) -> Any:
    """The answer, or None when none came, which has been said.

    Raises:
        ConfigError: the configuration cannot be used.
    """
    try:
        return answer(socket_of(config_path), question, config_path)
    except NoAnswer as error:
        print(error, file=sys.stderr)
        return None


def socket_of(config_path: str) -> Path:
    """Where the daemon of a configuration answers.

    Raises:
        ConfigError: the configuration cannot be used.
    """
    return socket_to_ask(load(config_path))


def answer(path: Path, question: str, config_path: str) -> Any:
    """What the daemon at that socket says.

    Raises:
        NoAnswer: nobody answered.
    """
    try:
        return asyncio.run(ask(path, question))
    except (OSError, ValueError, asyncio.TimeoutError) as error:
        raise NoAnswer(no_daemon(path, error, config_path)) from None


def no_daemon(path: Path, error: Exception, config_path: str) -> str:
    """Nobody answers there: why, and what to do."""
    return f"no daemon answers at {path}: {_why(path, error, config_path)}"


def _why(path: Path, error: Exception, config_path: str) -> str:
    unit = unit_of(config_path)
    start = "start it: " + (f"systemctl start {unit}, or " if unit else "")
    start += f"drslamd run -c {config_path}"
    if isinstance(error, FileNotFoundError):
        return f"none runs with this configuration; {start}"
    if isinstance(error, ConnectionRefusedError):
        return f"the last one ended without a goodbye; {start}"
    if isinstance(error, PermissionError):
        whose = permissions(path) or permissions(path.parent)
        group = f"it has {whose}" if whose else "it is not for this user"
        return (
            f"this is user {user_name()}, and {group}; ask with sudo, or join its group: "
            f"usermod -aG drslamd {user_name()}"
        )
    if isinstance(error, (asyncio.TimeoutError, TimeoutError)):
        if unit is None:
            return (
                "it runs but hangs; its log may say why, end it with kill -ABRT and start it again"
            )
        return f"it runs but hangs; journalctl -u {unit} may say why, systemctl restart {unit}"
    if isinstance(error, ValueError):
        return f"what came is no answer ({error}); is it a daemon of this version?"
    return f"{error}; is daemon.status_socket the one that the daemon was started with?"
