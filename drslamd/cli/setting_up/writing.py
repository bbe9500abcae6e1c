"""Files that a verb makes: whole or not at all, and never in the place of another unasked."""

from __future__ import annotations

import os
import pwd
from contextlib import suppress
from pathlib import Path

from drslamd.cli.service_user import SERVICE_USER

READABLE = 0o644
"""The daemon runs as another user."""


def write_whole(path: Path, text: str, *, may_replace: bool) -> None:
    """
    Raises:
        FileExistsError: there is one and it may not be replaced.
        OSError: it cannot be written.
    """
    fresh = path.with_name(path.name + ".new")
    descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, READABLE)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            os.fchmod(file.fileno(), READABLE)
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        if may_replace:
            fresh.replace(path)
        else:
            os.link(fresh, path)  # unlike a rename it fails where there is one
    finally:
        with suppress(FileNotFoundError):
            fresh.unlink()


def give_to_service(path: Path) -> None:
    """A file that only its owner may read, to the user of the service, where there is one.

    Raises:
        OSError: root may not do that here.
    """
    if os.geteuid() != 0:
        return
    with suppress(KeyError):
        user = pwd.getpwnam(SERVICE_USER)
        os.chown(path, user.pw_uid, user.pw_gid)
