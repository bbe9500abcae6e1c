"""Whose a file is, and what keeps this process from it, in words."""

from __future__ import annotations

import grp
import os
import pwd
import stat
from pathlib import Path


def user_name() -> str:
    """Of this process."""
    return _user(os.geteuid())


def permissions(path: Path) -> str:
    """Owner, group and mode; empty where they cannot be seen."""
    try:
        status = path.stat()
    except OSError:
        return ""
    mode = stat.S_IMODE(status.st_mode)
    return f"owner {_user(status.st_uid)}, group {group_name(status.st_gid)}, mode {mode:04o}"


def group_name(gid: int) -> str:
    try:
        return grp.getgrgid(gid).gr_name
    except KeyError:
        return str(gid)


def barrier(path: Path) -> Path:
    """What keeps this process from `path`: the first folder that it may not enter, or the file."""
    for folder in reversed(path.absolute().parents):
        try:
            is_open = os.access(folder, os.X_OK, effective_ids=True)
        except OSError:
            is_open = False
        if not is_open:
            return folder
    return path


def denied(path: Path) -> str:
    """A remedy for a file that may not be read."""
    wall = barrier(path)
    seen = permissions(wall)
    whose = f"{wall} has {seen}" if seen else f"{wall} cannot be seen"
    is_ours = bool(seen) and wall.stat().st_uid == os.geteuid()
    mend = f"chmod u+rX {wall}" if is_ours else "let it belong to the user that runs drslamd: chown"
    return f"this is user {user_name()}, and {whose}: {mend}"


def _user(uid: int) -> str:
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return str(uid)
