"""Where the kernel shows what this machine is: real, or a tree that a test has made."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

MAX_LOOKED_AT = 20_000
"""Open files of all processes, of which some hold a port."""


@dataclass(frozen=True)
class Host:
    """Roots of the trees that checks read."""

    sys: Path = Path("/sys")
    proc: Path = Path("/proc")
    dev: Path = Path("/dev")

    @property
    def net(self) -> Path:
        return self.sys / "class" / "net"

    def text(self, path: Path) -> str:
        """What a file of the kernel says, stripped; empty where there is none."""
        try:
            return path.read_text().strip()
        except (OSError, UnicodeDecodeError):
            return ""

    def serial_devices(self) -> list[str]:
        """Names of the devices that are plugged in, the lasting ones first."""
        lasting = sorted(map(str, (self.dev / "serial" / "by-id").glob("*")))
        named = {os.path.realpath(name) for name in lasting}
        patterns = ("linktrack", "ttyUSB*", "ttyACM*", "ttyCH343USB*", "ttyAMA*", "ttyTHS*")
        others = sorted(str(p) for pattern in patterns for p in self.dev.glob(pattern))
        return lasting + [name for name in others if os.path.realpath(name) not in named]

    def holders(self, device: str) -> list[str]:
        """Programs that have a device open, as far as this user may see them."""
        found = []
        looked_at = 0
        for process in self.proc.glob("[0-9]*"):
            try:
                targets = [os.readlink(link) for link in (process / "fd").iterdir()]
            except OSError:
                continue
            looked_at += len(targets)
            if device in targets and process.name != str(os.getpid()):
                found.append(f"{self.text(process / 'comm')} (process {process.name})")
            if looked_at > MAX_LOOKED_AT:
                break
        return found
