"""What a robot keeps over a restart: epochs, what it learned of its sensors, the team key.

The file is replaced whole or not at all, so a power cut leaves the old one or the new one.
"""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drslamd.config import ConfigError
from drslamd.gossip.seal import KEY_BYTES
from drslamd.slam.calibration import sensor_calibration

SCHEMA = 1


class StateStore:
    """One JSON file."""

    def __init__(self, folder: Path, robot: int) -> None:
        self.path = folder / f"robot-{robot}.json"
        self.fault = ""
        """Why nothing can be kept; empty when it can."""

    def load(self) -> dict[str, Any]:
        """What was kept, or nothing when there is none or it is not ours to read."""
        try:
            state = json.loads(self.path.read_text())
        except FileNotFoundError:
            return {}
        except (OSError, ValueError) as error:
            self.fault = f"cannot read {self.path}: {error}"
            return {}
        if not isinstance(state, dict) or state.get("schema") != SCHEMA:
            self.fault = f"{self.path} was written by another version; starting afresh"
            return {}
        if not _is_sound(state):
            self.fault = f"{self.path} is damaged; starting afresh"
            return {}
        return state

    def save(self, state: Mapping[str, Any]) -> None:
        """Replace the file; a fault is remembered, not raised: the robot can drive without."""
        text = json.dumps({"schema": SCHEMA, **state}, indent=1)
        fresh = self.path.with_suffix(".new")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with fresh.open("w") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            fresh.replace(self.path)
            folder = os.open(self.path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
            self.fault = ""
        except OSError as error:
            self.fault = f"cannot write {self.path}: {error.strerror}"


def _is_sound(state: dict[str, Any]) -> bool:
    epochs = state.get("epochs", {})
    return (
        isinstance(state.get("epoch", 0), int)
        and isinstance(epochs, dict)
        and all(robot.isdecimal() and isinstance(n, int) for robot, n in epochs.items())
        and sensor_calibration.is_sound(state.get("calibration", {}))
    )


def next_epoch(state: Mapping[str, Any], wall: int) -> int:
    """An epoch above every earlier one: the wall clock's, unless that went backwards."""
    return max(int(state.get("epoch", 0)) + 1, wall)


def read_key(path: str) -> bytes:
    """The team's secret.

    Raises:
        ConfigError: missing, readable by others, or not a key.
    """
    try:
        mode = stat.S_IMODE(os.stat(path).st_mode)
        text = Path(path).read_text().strip()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise ConfigError([f"team.key_file = {path!r}: {reason}"]) from None
    if mode & 0o077:
        raise ConfigError(
            [f"team.key_file = {path!r}: mode {mode:04o} lets others read it; chmod 600 {path}"]
        )
    try:
        secret = bytes.fromhex(text)
    except ValueError:
        secret = b""
    if len(secret) != KEY_BYTES:
        raise ConfigError(
            [f"team.key_file = {path!r}: not a team key; make one with: drslamd keygen {path}"]
        )
    return secret


def write_key(path: Path) -> None:
    """A new secret in a new file, mode 0600.

    Raises:
        FileExistsError: a key is never overwritten.
    """
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w") as file:
        file.write(os.urandom(KEY_BYTES).hex() + "\n")
