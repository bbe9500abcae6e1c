"""Why a file that somebody asked for cannot be made, and what to do."""

from __future__ import annotations

import errno
from pathlib import Path

OTHER_PLACE = "name a place on a file system that takes files"
REMEDIES = {
    errno.EEXIST: "it is not written over: name another one",
    errno.ENOENT: "make its folder first: mkdir -p {folder}",
    errno.EACCES: "name a place where this user may write, or try sudo",
    errno.EPERM: "name a place where this user may write, or try sudo",
    errno.ENOTDIR: "a file stands where a folder should be: name another place",
    errno.EISDIR: "it is a folder: name a file in it",
    errno.ENOSPC: "make room",
    errno.EDQUOT: "make room",
    errno.EROFS: OTHER_PLACE,
}


def unmade(path: str | Path, error: OSError) -> str:
    """The sentence, the cause first."""
    reason = error.strerror or str(error)
    # a folder of /proc is there and takes nothing
    is_there = error.errno == errno.ENOENT and Path(path).parent.is_dir()
    remedy = OTHER_PLACE if is_there else REMEDIES.get(error.errno or 0, OTHER_PLACE)
    return f"{path}: {reason}; {remedy.format(folder=Path(path).parent)}"
