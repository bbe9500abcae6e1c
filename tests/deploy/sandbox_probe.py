"""Run in place of the daemon inside its sandbox: what it may do there, as one line of JSON."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


def numbers() -> None:
    """Everything that the daemon computes with, in a thread as it does."""
    import numpy as np
    import scipy.linalg

    def solve(_: int) -> float:
        a = np.random.default_rng(1).normal(size=(300, 300))
        scipy.linalg.solveh_banded(np.full((2, 50), [[4.0], [1.0]]), np.ones(50), lower=True)
        return float(np.linalg.svd(a)[1][0])

    with ThreadPoolExecutor(2) as pool:
        assert len(set(pool.map(solve, range(4)))) == 1


def packages() -> None:
    """Every package that a configuration can call for."""
    import can  # noqa: F401
    import cantools  # noqa: F401
    import lcm  # noqa: F401
    import serial  # noqa: F401


def opens(path: str, flags: int = os.O_RDONLY) -> Callable[[], None]:
    return lambda: os.close(os.open(path, flags))


def sockets(family: str, kind: int = socket.SOCK_DGRAM) -> Callable[[], None]:
    return lambda: socket.socket(getattr(socket, family), kind).close()


def state() -> None:
    """The daemon's own folder."""
    path = os.path.join(os.environ["STATE_DIRECTORY"], "probe")
    opens(path, os.O_CREAT | os.O_WRONLY)()
    os.unlink(path)


PROBES: dict[str, Callable[[], object]] = {
    "numbers": numbers,
    "packages": packages,
    "state folder": state,
    "configuration": opens("/etc/drslamd/3.toml"),
    "own key": opens("/etc/drslamd/team.key"),
    "udp": sockets("AF_INET"),
    "unix socket": sockets("AF_UNIX"),
    "random numbers": opens("/dev/urandom"),
    "other devices": opens("/dev/ttyS0"),
    "kernel log": opens("/dev/kmsg"),
    "etc": opens("/etc/drslamd/new", os.O_CREAT | os.O_WRONLY),
    "shadow": opens("/etc/shadow"),
    "home": lambda: os.listdir("/root"),
    "raw packets": sockets("AF_PACKET", socket.SOCK_RAW),
    "netlink": sockets("AF_NETLINK", socket.SOCK_RAW),
    "other processes": lambda: os.stat("/proc/1/stat"),
    "more privileges": lambda: os.setuid(0),
}


def verdict(probe: Callable[[], object]) -> str:
    try:
        probe()
    except (OSError, ImportError) as error:
        return str(error)
    return "yes"


if __name__ == "__main__":
    print(json.dumps({name: verdict(probe) for name, probe in PROBES.items()}))
