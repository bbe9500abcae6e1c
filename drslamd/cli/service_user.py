"""Looking at the machine as the service's user does: root may read what he may not."""

from __future__ import annotations

import grp
import os
import pwd
import sys
import traceback
from collections.abc import Callable
from pathlib import Path

from drslamd.cli.exit_codes import BUG, USAGE

SERVICE_USER = "drslamd"
"""User= of systemd/drslamd@.service."""
EXTRA_GROUPS = ("dialout",)
"""SupplementaryGroups= of the same."""
SERVICE_FOLDER = Path("/etc/drslamd")
"""Where the service looks for configurations."""
PLACES = {"STATE_DIRECTORY": "/var/lib/drslamd", "RUNTIME_DIRECTORY": "/run/drslamd"}
"""What systemd tells the service, and makes for it."""


def user_of_service(config_path: str) -> str | None:
    """Whose eyes count for this configuration; None when it is this user's own."""
    if os.geteuid() != 0 or unit_of(config_path) is None:
        return None
    try:
        pwd.getpwnam(SERVICE_USER)
    except KeyError:
        return None
    return SERVICE_USER


def unit_of(config_path: str) -> str | None:
    """The unit that reads this configuration; None where systemd knows nothing of it."""
    path = Path(config_path).resolve()
    return f"drslamd@{path.stem}" if path.parent == SERVICE_FOLDER else None


def as_user(name: str, look: Callable[[], int]) -> int:
    """Run `look` in a child that is this user; its exit code."""
    try:
        user = pwd.getpwnam(name)
    except KeyError:
        print(f"--user {name}: there is no such user", file=sys.stderr)
        return USAGE
    if os.geteuid() not in (0, user.pw_uid):
        print(f"--user {name}: only root may look as another user; use sudo", file=sys.stderr)
        return USAGE
    sys.stdout.flush()
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    code = BUG
    try:
        _become(user)
        code = look()
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _become(user: pwd.struct_passwd) -> None:
    os.environ["HOME"] = user.pw_dir
    if user.pw_name == SERVICE_USER:
        os.environ.update(PLACES)
    if os.geteuid() == user.pw_uid:
        return
    known = {group.gr_name: group.gr_gid for group in grp.getgrall()}
    extra = [known[name] for name in EXTRA_GROUPS if name in known]
    os.setgroups([*os.getgrouplist(user.pw_name, user.pw_gid), *extra])
    os.setgid(user.pw_gid)
    os.setuid(user.pw_uid)
