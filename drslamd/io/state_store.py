"""What a robot keeps over a restart: epochs, what it learned of its sensors, its place, the key.

The file is replaced whole or not at all, so a power cut leaves the old one or the new one. It is
read as if a stranger had written it: bounded in size, depth and every number; and nothing is
written that would not be read.
"""

from __future__ import annotations

import json
import os
import secrets
import stat
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from drslamd.config import ConfigError
from drslamd.conventions import ROBOT_NAMES, SECOND_US
from drslamd.gossip.epochs import is_kept_epoch, next_epoch
from drslamd.gossip.seal import KEY_BYTES
from drslamd.host.owners import denied
from drslamd.host.plain_file import read_plain
from drslamd.io.clock import uptime_s, wall_s
from drslamd.slam.calibration import sensor_calibration
from drslamd.slam.relocation.last_place import is_kept_place

SCHEMA = 1
MAX_STATE_BYTES = 256 * 1024
"""Of the file; epochs and biases of 254 peers are a tenth of it."""


class StateStore:
    """One JSON file."""

    def __init__(self, folder: Path, robot: int) -> None:
        self.path = folder / f"robot-{robot}.json"
        self.fault = ""
        """Why nothing can be kept; empty when it can."""

    def load(self) -> dict[str, Any]:
        """What was kept, or nothing when there is none or it is not ours to read."""
        try:
            state = json.loads(read_plain(self.path, MAX_STATE_BYTES))
        except FileNotFoundError:
            return {}
        except RecursionError:
            self.fault = f"cannot read {self.path}: brackets nested too deep; starting afresh"
            return {}
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            self.fault = f"cannot read {self.path}: {reason}; starting afresh"
            return {}
        if not isinstance(state, dict) or state.get("schema") != SCHEMA:
            self.fault = f"{self.path} was written by another version; starting afresh"
            return _of_any_version(state)
        if not is_sound(state):
            self.fault = f"{self.path} is damaged; starting afresh"
            return {}
        return state

    def begin(self, state: Mapping[str, Any], above: int) -> int:
        """Keep this state under a new epoch, before anything is sent under it.

        Args:
            above: the last epoch that is known.

        Returns:
            The epoch. Where it cannot be kept, another start will begin from the same knowledge,
            and the wall clock keeps them in order. A clock that is behind the last epoch cannot:
            then the time since the computer began does, and after another power-up the random part
            still tells two starts apart.
        """
        now_s, draw_us = wall_s(), secrets.randbelow(SECOND_US)
        epoch = next_epoch(above, now_s, draw_us)
        self.save({**state, "epoch": epoch})
        if self.fault and now_s <= above // SECOND_US:
            epoch = next_epoch(above + uptime_s() * SECOND_US, now_s, draw_us)
        return epoch

    def save(self, state: Mapping[str, Any]) -> None:
        """Replace the file; a fault is remembered, not raised: the robot can drive without."""
        text = json.dumps({**state, "schema": SCHEMA}, indent=1)
        if len(text) > MAX_STATE_BYTES or not is_sound(json.loads(text)):
            raise AssertionError("state that the next start would not read")
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
            self.fault = cannot_write(self.path, str(error.strerror))
            with suppress(OSError):
                fresh.unlink()


def cannot_write(path: Path, reason: str) -> str:
    """What is said of a state that cannot be kept."""
    return f"cannot write {path}: {reason}"


def _of_any_version(state: Any) -> dict[str, Any]:
    """What every version keeps alike: numbers of starts, where they are believable.

    So neither an older nor a newer program in the place of this one uses a number twice.
    """
    fields = state if isinstance(state, dict) else {}
    starts = {key: fields[key] for key in ("epoch", "epochs") if key in fields}
    return starts if is_sound(starts) else {}


def is_sound(state: Mapping[str, Any]) -> bool:
    """Could a daemon have kept this? Any JSON object may be given."""
    epochs = state.get("epochs", {})
    return (
        is_kept_epoch(state.get("epoch", 0))
        and isinstance(epochs, dict)
        and epochs.keys() <= ROBOT_NAMES
        and all(is_kept_epoch(epoch) for epoch in epochs.values())
        and sensor_calibration.is_sound(state.get("calibration", {}))
        and is_kept_place(state.get("place", {}))
    )


def read_key(path: str) -> bytes:
    """The team's secret.

    Raises:
        ConfigError: missing, readable by others, or not a key.
    """
    try:
        mode = os.stat(path).st_mode
        if not stat.S_ISREG(mode):
            raise ConfigError([f"team.key_file = {path!r}: not a plain file; name a file"])
        text = Path(path).read_text().strip()
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError([f"team.key_file = {path!r}: {_unreadable(path, error)}"]) from None
    mode = stat.S_IMODE(mode)
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


def _unreadable(path: str, error: OSError | UnicodeDecodeError) -> str:
    """Why a key cannot be read, and what to do."""
    if isinstance(error, UnicodeDecodeError):
        return f"not a text file; make a key with: drslamd keygen {path}"
    if isinstance(error, FileNotFoundError):
        return f"{error.strerror}; copy the team's key there, or make one: drslamd keygen {path}"
    if isinstance(error, PermissionError):
        return f"{error.strerror}; {denied(Path(path))}"
    return f"{error.strerror}; correct the path"


def write_key(path: Path) -> None:
    """A new secret in a new file, mode 0600.

    Raises:
        FileExistsError: a key is never overwritten.
    """
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w") as file:
        file.write(os.urandom(KEY_BYTES).hex() + "\n")
