"""The folders of the daemon: can it keep its state, is there room, can it answer questions?"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from pathlib import Path

from drslamd.config import Config, ConfigError
from drslamd.host.kernel import Host
from drslamd.host.owners import barrier, permissions, user_name
from drslamd.io.state_store import StateStore, cannot_write
from drslamd.io.status_socket import MAX_PATH_BYTES, PATH_TOO_LONG, cannot_listen
from drslamd.machine.finding import Finding, Severity
from drslamd.machine.folders import socket_path, state_dir

LEAST_BYTES = 16 << 20
"""Of free room: the state is small, but a full disk is seldom alone."""


def state_folder(config: Config, host: Host) -> Iterator[Finding]:
    """What keeps the next start from knowing what this one learned."""
    try:
        store = StateStore(state_dir(config), config.robot.id)
    except ConfigError:
        return  # a refusal
    reason = _obstacle(store.path.parent, store.path.with_suffix(".check"), "STATE_DIRECTORY")
    if reason:
        cause = cannot_write(store.path, reason)
        yield _warning("state folder", cause, _open_up(store.path.parent, "daemon.state_dir"))
    elif (room := _free_bytes(store.path.parent)) < LEAST_BYTES:
        cause = f"only {room >> 20} MB are free in {store.path.parent}"
        yield _warning("disk", cause, "make room, or name another folder in daemon.state_dir")
    store.load()
    if store.fault:
        remedy = "nothing needs to be done: calibration is learned again"
        yield _warning("state file", store.fault, remedy)


def status_folder(config: Config, host: Host) -> Iterator[Finding]:
    """What keeps ``drslamd status`` from asking."""
    try:
        path = socket_path(config)
    except ConfigError:
        return  # a refusal
    if len(os.fsencode(path)) > MAX_PATH_BYTES:
        remedy = f"shorten daemon.status_socket to {MAX_PATH_BYTES} bytes"
        yield _warning("status socket", cannot_listen(path, PATH_TOO_LONG), remedy)
    elif reason := _obstacle(path.parent, path.with_suffix(".check"), "RUNTIME_DIRECTORY"):
        remedy = _open_up(path.parent, "daemon.status_socket")
        yield _warning("status socket", cannot_listen(path, reason), remedy)


def _obstacle(folder: Path, trial: Path, variable: str) -> str:
    """Why a file cannot be made in a folder, or the folder itself; empty when it can.

    Args:
        variable: in which systemd names a folder that it makes.
    """
    if not os.path.lexists(folder) and str(folder) in os.environ.get(variable, "").split(":"):
        return ""
    if os.path.isdir(folder):
        try:
            descriptor = os.open(trial, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
        except FileExistsError:
            return ""  # another look of the same kind
        except OSError as error:
            return str(error.strerror)
        os.close(descriptor)
        trial.unlink()
        return ""
    above = _nearest(folder)
    if above == folder:
        return os.strerror(errno.EEXIST)
    if not os.path.isdir(above):
        return os.strerror(errno.ENOTDIR)
    allowed = os.access(above, os.W_OK | os.X_OK, effective_ids=True)
    return "" if allowed else "Permission denied"


def _open_up(folder: Path, key: str) -> str:
    above = _nearest(folder)
    if not os.path.isdir(above):
        return f"{above} is a file and no folder: name another in {key}"
    wall = barrier(above)
    return (
        f"this is user {user_name()}, and {wall} has {permissions(wall) or 'no owner'}: make it "
        f"writable, or name another folder in {key}"
    )


def _free_bytes(folder: Path) -> int:
    room = os.statvfs(_nearest(folder))
    return room.f_bavail * room.f_frsize


def _nearest(folder: Path) -> Path:
    """The folder, or the first above it that there is."""
    places = (folder, *folder.absolute().parents)
    return next(place for place in places if os.path.lexists(place))


def _warning(check: str, cause: str, remedy: str) -> Finding:
    return Finding(check, Severity.WARNING, cause, remedy)
