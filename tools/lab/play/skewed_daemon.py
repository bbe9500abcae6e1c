"""A daemon whose clock is wrong, for showing that this does not matter.

usage: python -m lab.play.skewed_daemon CONFIG OFFSET_US PPM
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from drslamd.host.loading import without_openssl

with without_openssl():  # as the command does
    import asyncio

    from drslamd.config import parse
    from drslamd.daemon import Daemon
    from drslamd.io.logs import set_up
    from lab.play.simulator import Clock


class SkewedClock:
    """The monotonic clock, ahead by an offset and running at a rate of its own."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def now(self) -> int:
        return self._clock.local(time.monotonic_ns() // 1_000)


async def main(path: str, offset_us: str, ppm: str) -> None:
    config = parse(Path(path).read_text())
    set_up(config.daemon)
    await Daemon(config, SkewedClock(Clock(int(offset_us), float(ppm)))).run()


if __name__ == "__main__":
    asyncio.run(main(*sys.argv[1:4]))
