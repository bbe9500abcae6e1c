"""``drslamd feed``: pose and peers of the running daemon in the words of other programs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drslamd.cli.ask import no_daemon, socket_of
from drslamd.cli.exit_codes import CANNOT_CREATE, OK, UNAVAILABLE, USAGE
from drslamd.cli.parser import Verbs, configured_verb, load
from drslamd.host.ending import ended_by_a_signal
from drslamd.host.unmade import unmade

EXAMPLES = """\
  drslamd feed mavlink -c /etc/drslamd/3.toml --to 127.0.0.1:14550   ArduPilot, PX4
  drslamd feed foxglove -c /etc/drslamd/3.toml      then open ws://localhost:8765 in Foxglove
  drslamd feed ros2 -c /etc/drslamd/3.toml          /tf and odometry, domain 0, no ROS needed
  drslamd feed ros2 -c /etc/drslamd/3.toml --mcap run.mcap           the same into a file
  drslamd feed dimos -c /etc/drslamd/3.toml         messages of dimos-lcm over LCM"""
KINDS = {
    "mavlink": "pymavlink",
    "foxglove": "foxglove-sdk",
    "ros2": "cyclonedds and mcap",
    "dimos": "dimos-lcm",
}
"""And the packages that they need."""
REMEDIES = {
    "mavlink": "correct --to HOST:PORT",
    "foxglove": "give another place with --listen or --port",
    "ros2": "give another domain with --domain",
    "dimos": "correct --url",
}
"""Of a place where nothing can be told."""
MOST_DOMAIN = 232
"""Ports of the next ones do not exist (RTPS)."""
LCM_URL = "udpm://239.255.76.67:7667?ttl=0"


def add(verbs: Verbs) -> None:
    """Add the verb."""
    feed = configured_verb(
        verbs, "feed", _feed, "tell pose and peers to other programs, until Ctrl-C", EXAMPLES
    )
    feed.add_argument("kind", choices=tuple(KINDS), help="whose words")
    feed.add_argument(
        "--to", metavar="HOST:PORT", default="127.0.0.1:14550", help="mavlink: where to (UDP)"
    )
    feed.add_argument(
        "--odom",
        action="store_true",
        help="mavlink: the pose of dead reckoning, which drifts and never jumps",
    )
    feed.add_argument(
        "--listen", metavar="ADDRESS", default="127.0.0.1", help="foxglove: for whom (default here)"
    )
    feed.add_argument("--port", type=int, default=8765, help="foxglove: default 8765")
    feed.add_argument("--domain", type=int, default=0, help="ros2: ROS_DOMAIN_ID (default 0)")
    feed.add_argument("--mcap", metavar="FILE", help="ros2: into a file instead")
    feed.add_argument("--url", default=LCM_URL, help=f"dimos: of LCM (default {LCM_URL})")


def _feed(options: argparse.Namespace) -> int:
    from drslamd.feed.stream import told
    from drslamd.machine.folders import near_path

    host, _, port = options.to.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 65_536:
        print(f"drslamd feed: --to {options.to}: must be HOST:PORT", file=sys.stderr)
        return USAGE
    for flag, value, most in (
        ("--port", options.port, 65_535),
        ("--domain", options.domain, MOST_DOMAIN),
    ):
        if not 0 <= value <= most:
            print(f"drslamd feed: {flag} {value}: 0 to {most}", file=sys.stderr)
            return USAGE
    robot, path = load(options.config).robot.id, near_path(socket_of(options.config))
    try:
        feed = _made(options, robot)(options)
    except ImportError:
        remedy = f'needs {KINDS[options.kind]}: pip install "drslamd[{options.kind}]"'
        print(f"drslamd feed {options.kind} {remedy}", file=sys.stderr)
        return UNAVAILABLE
    except OSError as error:
        if options.mcap:
            print(f"drslamd feed {options.kind}: {unmade(options.mcap, error)}", file=sys.stderr)
            return CANNOT_CREATE
        return _unheard(options, error.strerror or str(error))
    except RuntimeError as error:
        return _unheard(options, str(error))
    try:
        with ended_by_a_signal():
            for near in told(path):
                feed.tell(near)
    except OSError as error:
        print(no_daemon(path, error, options.config), file=sys.stderr)
        return UNAVAILABLE
    except KeyboardInterrupt:
        return OK
    finally:
        feed.close()
    return OK


def _unheard(options: argparse.Namespace, reason: str) -> int:
    print(f"drslamd feed {options.kind}: {reason}; {REMEDIES[options.kind]}", file=sys.stderr)
    return UNAVAILABLE


def _made(options: argparse.Namespace, robot: int) -> Callable[[argparse.Namespace], Any]:
    return {
        "mavlink": lambda o: _mavlink(o, robot),
        "foxglove": lambda o: _foxglove(o, robot),
        "ros2": lambda o: _ros2(o, robot),
        "dimos": lambda o: _dimos(o, robot),
    }[options.kind]


def _mavlink(options: argparse.Namespace, robot: int) -> Any:
    from drslamd.feed.mavlink import Mavlink

    host, _, port = options.to.rpartition(":")
    return Mavlink(robot, (host, int(port)), options.odom)


def _foxglove(options: argparse.Namespace, robot: int) -> Any:
    from drslamd.feed.foxglove_server import FoxgloveServer

    server = FoxgloveServer(robot, options.listen, options.port)
    print(f"foxglove: ws://{options.listen}:{server.port}", flush=True)
    return server


def _ros2(options: argparse.Namespace, robot: int) -> Any:
    from drslamd.feed.ros2 import Dds, Mcap

    return Mcap(robot, Path(options.mcap)) if options.mcap else Dds(robot, options.domain)


def _dimos(options: argparse.Namespace, robot: int) -> Any:
    import dimos_lcm  # noqa: F401

    from drslamd.feed.dimos import Dimos

    return Dimos(robot, options.url)
