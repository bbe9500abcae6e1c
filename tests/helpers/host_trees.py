"""Trees like those in which the kernel shows a machine."""

from __future__ import annotations

from pathlib import Path

from drslamd.host.kernel import Host

ETHERNET, CAN = 1, 280
UP, DOWN = 0x1003, 0x1002


class HostTree(Host):
    """A machine that a test has made."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder / "sys", folder / "proc", folder / "dev")
        for part in (self.net, self.proc, self.dev):
            part.mkdir(parents=True)

    def link(self, name: str, flags: int = UP, kind: int = ETHERNET, carrier: str = "1") -> None:
        """An interface."""
        self.put(self.net / name / "flags", f"{flags:#x}")
        self.put(self.net / name / "type", str(kind))
        self.put(self.net / name / "carrier", carrier)

    def put(self, path: Path, text: str) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n")
