"""The files of recordings in one folder: their names, their quota, and a disk that is full.

    robot-003-20261127T021545.123456-0000.lcmlog

is the first file of the start of robot 3 that has this time as its epoch. Only files of such a name
are ever deleted, the oldest first, and never the one that is written.
"""

from __future__ import annotations

import os
import re
from contextlib import suppress
from datetime import datetime, timedelta, timezone
from pathlib import Path

from drslamd.io.logs import get_logger

MAX_FILE_BYTES = 64 << 20
"""Three quarters of an hour of a busy robot."""
FILES = 16
"""So many fill a quota, so that the old ones go in small steps."""
SPARE_BYTES = 32 << 20
"""Left free on the disk: the state of the robot must still be kept, and the system must live."""
_NAME = re.compile(r"robot-(\d{3})-(\d{8}T\d{6}\.\d{6})-(\d{4,})\.lcmlog")
_EPOCH_0 = datetime(1970, 1, 1, tzinfo=timezone.utc)


def file_name(robot: int, epoch: int, part: int) -> str:
    """Names sort in the order of starts and of parts."""
    begun = _EPOCH_0 + timedelta(microseconds=epoch)
    return f"robot-{robot:03d}-{begun:%Y%m%dT%H%M%S.%f}-{part:04d}.lcmlog"


def parse_name(path: Path) -> tuple[int, str, int] | None:
    """Robot, start and part that a file is named after; None where it is none of ours."""
    found = _NAME.fullmatch(path.name)
    return (int(found[1]), found[2], int(found[3])) if found else None


def recordings(folder: Path, robot: int | None = None) -> list[Path]:
    """The files of recordings in a folder, oldest first of each robot."""
    named = [(parse_name(path), path) for path in folder.iterdir()]
    found = sorted((name, path) for name, path in named if name is not None)
    return [path for name, path in found if robot in (None, name[0])]


class LogFiles:
    """Writes one file after the other.

    Attributes:
        name: of the file that is written; empty before there is one.
        fault: why nothing is written any more; empty while all is well.
        file_bytes: how large one file may become.
    """

    def __init__(self, folder: Path, robot: int, quota_bytes: int) -> None:
        self.folder = folder
        self.file_bytes = min(MAX_FILE_BYTES, quota_bytes // FILES)
        self.name, self.fault = "", ""
        self._robot, self._quota = robot, quota_bytes
        self._epoch, self._part = 0, -1
        self._descriptor, self._size = -1, 0

    def begin(self, epoch: int) -> None:
        """Name the files after this start."""
        self._epoch = epoch

    def next(self) -> None:
        """Open another file, after making room for it."""
        if self.fault:
            return
        self.close()
        self._part += 1
        name = file_name(self._robot, self._epoch, self._part)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._make_room()
            flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND
            self._descriptor = os.open(self.folder / name, flags, 0o640)
            self.name, self._size = name, 0
        except OSError as error:
            self._stop(f"cannot write {self.folder / name}: {error.strerror}")

    def write(self, data: bytes) -> None:
        """Append; a disk that takes no more ends the recording, at a whole entry where it can."""
        if self.fault or self._descriptor < 0:
            return
        try:
            free = os.fstatvfs(self._descriptor)
            if free.f_bavail * free.f_frsize < SPARE_BYTES + len(data):
                self._stop(
                    f"{self.folder} has less than {SPARE_BYTES >> 20} MB left: "
                    "make room and start the daemon again"
                )
                return
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
            self._size += len(data)
        except OSError as error:
            with suppress(OSError):  # a reader passes over the half of an entry
                os.ftruncate(self._descriptor, self._size)
            self._stop(f"cannot write {self.folder / self.name}: {error.strerror}")

    def close(self) -> None:
        """Let go of the file."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def _stop(self, why: str) -> None:
        self.fault = why
        self.close()
        get_logger().warning("recording.fault", what=why)

    def _make_room(self) -> None:
        """Delete our oldest files until another one fits into the quota."""
        sizes: dict[Path, int] = {}
        for path in recordings(self.folder, self._robot):
            with suppress(FileNotFoundError):  # somebody makes room too
                sizes[path] = path.stat().st_size
        used = sum(sizes.values())
        for path, size in sizes.items():
            if used + self.file_bytes <= self._quota:
                break
            path.unlink(missing_ok=True)
            used -= size
