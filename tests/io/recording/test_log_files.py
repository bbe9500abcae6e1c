"""Files of one robot in a folder: names, the quota, a disk that takes no more."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

import pytest

from drslamd.io.recording.log_files import (
    FILES,
    MAX_FILE_BYTES,
    SPARE_BYTES,
    LogFiles,
    file_name,
    parse_name,
    recordings,
)

EPOCH = 1_795_745_745_123_456
QUOTA = 16 << 20


def files_in(folder: Path, epoch: int = EPOCH, robot: int = 3) -> LogFiles:
    files = LogFiles(folder, robot, QUOTA)
    files.begin(epoch)
    files.next()
    return files


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_named_by_robot_start_and_part() -> None:
    name = file_name(3, EPOCH, 12)
    assert name == "robot-003-20261127T021545.123456-0012.lcmlog"
    assert parse_name(Path("/any") / name) == (3, "20261127T021545.123456", 12)
    assert parse_name(Path("robot-003.lcmlog")) is None


def test_the_oldest_recording_of_a_robot_comes_first(tmp_path: Path) -> None:
    wanted = [(1, EPOCH, 9_999), (1, EPOCH, 10_000), (1, EPOCH + 1, 0), (2, EPOCH - 1, 0)]
    for robot, epoch, part in reversed(wanted):
        (tmp_path / file_name(robot, epoch, part)).touch()
    (tmp_path / "notes.txt").touch()
    assert [p.name for p in recordings(tmp_path)] == [file_name(*w) for w in wanted]
    assert [p.name for p in recordings(tmp_path, 2)] == [file_name(*wanted[3])]


def test_what_is_written_stands_in_the_file_at_once(tmp_path: Path) -> None:
    files = files_in(tmp_path / "made")
    files.write(b"one")
    files.write(b"two")
    assert (tmp_path / "made" / files.name).read_bytes() == b"onetwo"
    files.next()
    files.write(b"three")
    assert names(tmp_path / "made") == [file_name(3, EPOCH, 0), file_name(3, EPOCH, 1)]
    assert files.fault == ""
    files.close()


@pytest.mark.parametrize(("quota", "size"), [(QUOTA, QUOTA // FILES), (1 << 40, MAX_FILE_BYTES)])
@pytest.mark.row("O3")
def test_a_file_is_a_share_of_the_quota_and_not_endless(
    tmp_path: Path, quota: int, size: int
) -> None:
    assert LogFiles(tmp_path, 3, quota).file_bytes == size


@pytest.mark.row("O3")
@pytest.mark.parametrize(("spare", "stay"), [(0, 15), (-1, 14)])
def test_the_oldest_go_when_another_one_does_not_fit(tmp_path: Path, spare: int, stay: int) -> None:
    size = QUOTA // FILES
    for part in range(15):
        path = tmp_path / file_name(3, EPOCH - 1, part)
        path.write_bytes(b"x" * (size - (spare if part == 0 else 0)))
    others = [tmp_path / file_name(4, 1, 0), tmp_path / "robot-003.lcmlog"]
    for other in others:
        other.write_bytes(b"x" * 2 * size)
    files = files_in(tmp_path)
    files.close()
    left = [parse_name(path) for path in recordings(tmp_path, 3)]
    assert [name[2] for name in left if name][:-1] == list(range(15 - stay, 15))
    assert all(other.exists() for other in others)


def test_a_file_that_somebody_deletes_meanwhile_is_no_fault(tmp_path: Path) -> None:
    (tmp_path / file_name(3, EPOCH - 1, 0)).symlink_to(tmp_path / "gone")
    files = files_in(tmp_path)
    assert files.fault == ""
    files.close()


def test_a_folder_that_cannot_be_made_is_a_fault_with_its_name(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    files = files_in(tmp_path / "file")
    assert files.fault == f"cannot write {tmp_path}/file/{file_name(3, EPOCH, 0)}: File exists"
    files.write(b"x")
    files.next()
    assert files.fault.endswith("File exists")


def test_a_file_that_is_there_is_never_written_over(tmp_path: Path) -> None:
    (tmp_path / file_name(3, EPOCH, 0)).write_bytes(b"old")
    assert files_in(tmp_path).fault.endswith("File exists")
    assert (tmp_path / file_name(3, EPOCH, 0)).read_bytes() == b"old"


class Disk:
    """What `statvfs` says of a disk."""

    f_frsize = 4096

    def __init__(self, free: int) -> None:
        self.f_bavail = free // 4096


@pytest.mark.parametrize(("missing", "is_kept"), [(0, True), (4096, False)])
def test_a_disk_that_is_nearly_full_ends_it_while_others_can_still_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, missing: int, is_kept: bool
) -> None:
    files = files_in(tmp_path)
    free = SPARE_BYTES + 8192 - missing
    monkeypatch.setattr(os, "fstatvfs", lambda _: Disk(free))
    files.write(bytes(8192))
    assert (tmp_path / files.name).stat().st_size == (8192 if is_kept else 0)
    wanted = f"{tmp_path} has less than 32 MB left: make room and start the daemon again"
    assert files.fault == ("" if is_kept else wanted)
    files.close()


def test_a_disk_that_is_full_in_the_middle_of_a_write_keeps_whole_entries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = files_in(tmp_path)
    files.write(b"whole")
    write = os.write

    def half(descriptor: int, data: Any) -> int:
        if len(data) > 3:
            return write(descriptor, data[:3])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "write", half)
    files.write(b"broken")
    assert (tmp_path / files.name).read_bytes() == b"whole"
    assert files.fault == f"cannot write {tmp_path / files.name}: No space left on device"
