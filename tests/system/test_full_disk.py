"""A disk that fills up while a real daemon records: the recording ends, the daemon lives on."""

from __future__ import annotations

import asyncio
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from lab.replay.exact import Replayer
from lab.replay.runs import key_of, read_runs

from drslamd.io.recording.log_files import recordings
from drslamd.io.status_socket import ask

pytestmark = pytest.mark.slow

SMALL_MB = 36
TOML = """
[robot]
id = 3
[team]
insecure = true
[uwb]
port = "{folder}/uwb"
[wheels]
source = "kobuki"
port = "{folder}/wheels"
[gossip]
interface = "127.0.0.1"
ttl = 0
[daemon]
state_dir = "{folder}/state"
status_socket = "{folder}/socket"
record = true
record_dir = "{folder}/disk"
"""


def hindrance() -> str:
    """Why there can be no small disk here; empty when there can."""
    if shutil.which("unshare") is None:
        return "no program unshare"
    command = ["unshare", "-rm", "mount", "-t", "tmpfs", "tmpfs", "/mnt"]
    tried = subprocess.run(command, capture_output=True, text=True)
    return "" if tried.returncode == 0 else f"unshare -rm: {tried.stderr.strip()}"


def status(socket: Path, wanted: Any) -> dict[str, Any]:
    """The first answer that is as wanted, or the last of ten seconds."""
    said: dict[str, Any] = {}
    end = time.monotonic() + 15
    while time.monotonic() < end:
        try:
            said = asyncio.run(ask(socket, "status"))
        except (OSError, ValueError):
            time.sleep(0.1)
            continue
        if wanted(said):
            break
        time.sleep(0.1)
    return said


@pytest.mark.row("O2")
def test_a_disk_that_is_full_ends_the_recording_and_not_the_daemon(tmp_path: Path) -> None:
    if hindrance():
        pytest.skip(hindrance())
    disk, socket, config = tmp_path / "disk", tmp_path / "socket", tmp_path / "3.toml"
    disk.mkdir()
    config.write_text(TOML.format(folder=tmp_path))
    mounted = f"mount -t tmpfs -o size={SMALL_MB}m tmpfs {disk}"
    run = f"exec {sys.executable} -m drslamd run -c {config}"
    process = subprocess.Popen(
        ["unshare", "-rm", "sh", "-c", f"{mounted} && {run}"], stderr=subprocess.DEVNULL
    )
    try:
        said = status(socket, lambda s: s["recording"]["bytes"] > 3_000)
        assert said["recording"]["fault"] == ""
        seen = Path(f"/proc/{process.pid}/root{disk}")
        (seen / "film.mp4").write_bytes(bytes(6 << 20))
        said = status(socket, lambda s: s["recording"]["fault"])
        assert said["problems"][-1] == (
            f"nothing is recorded: {disk} has less than 32 MB left: "
            "make room and start the daemon again"
        )
        (path,) = recordings(seen)
        shutil.copy(path, tmp_path)
        before = said["recording"]["bytes"]
        time.sleep(2)
        again = status(socket, lambda _: True)
        assert again["recording"]["bytes"] == before
        assert again["epoch"] == said["epoch"]
        assert process.poll() is None
    finally:
        process.terminate()
        process.wait(10)
    (recorded,) = read_runs([tmp_path])
    found = Replayer(recorded, key_of(recorded, None)).follow()
    assert (found.difference, recorded.said) == (None, [])
    assert found.events > 10
