"""A daemon with a planted fault, as a process: ``python faulty_daemon.py FAULT run -c FILE``."""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import Callable

from drslamd import cli
from drslamd.daemon import Daemon
from drslamd.events import Solve

AFTER_S = 0.3
ENDLESS_S = 30.0


def stuck_solver(daemon: Daemon) -> None:
    """A computation that does not come to an end, as far as the test can see."""
    daemon._perform(Solve(10**6, "optimizer", lambda: time.sleep(ENDLESS_S)))


def hung_loop(_: Daemon) -> None:
    """Something blocks, and so does everything else."""
    time.sleep(ENDLESS_S)


def own_bug(daemon: Daemon) -> None:
    """An exception that nobody expected."""
    daemon.handle(None)  # type: ignore[arg-type]


FAULTS: dict[str, Callable[[Daemon], None]] = {
    "stuck_solver": stuck_solver,
    "hung_loop": hung_loop,
    "own_bug": own_bug,
}


def main() -> int:
    """Plant the fault, then be the daemon."""
    fault = FAULTS[sys.argv[1]]
    healthy = Daemon.run

    async def run(self: Daemon) -> None:
        asyncio.get_running_loop().call_later(AFTER_S, fault, self)
        await healthy(self)

    Daemon.run = run  # type: ignore[method-assign]
    return cli.main(sys.argv[2:])


if __name__ == "__main__":
    sys.exit(main())
