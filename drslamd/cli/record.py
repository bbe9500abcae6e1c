"""``drslamd record``: what robots say on a network, into an LCM log, without a daemon."""

from __future__ import annotations

import argparse
import signal
import sys
import time
from pathlib import Path

from pydantic import ValidationError

from drslamd.cli.exit_codes import CANNOT_CREATE, OK, UNAVAILABLE
from drslamd.cli.parser import Verbs, load, verb
from drslamd.config import ConfigError, GossipSection
from drslamd.config_faults import sentences
from drslamd.config_wheels import Section
from drslamd.host.ending import stops
from drslamd.host.unmade import unmade

SAY_EVERY_S = 1.0


class _Group(Section):
    """The part of a configuration that says where robots talk."""

    gossip: GossipSection


def add(verbs: Verbs) -> None:
    """Add the verb."""
    record = verb(
        verbs,
        "record",
        _record,
        "write what all robots say into an LCM log, until Ctrl-C",
        "  drslamd record run.lcmlog --interface wlan0     on a laptop in the robots' network\n"
        "  drslamd record run.lcmlog -c /etc/drslamd/3.toml\n\n"
        "lcm-logplayer and lcm-spy open the file. What a robot itself hears and does, for\n"
        "tools/replay, its daemon records: record = true in [daemon].",
    )
    record.add_argument("file", metavar="FILE", help="a new file; none is written over")
    record.add_argument("-c", "--config", metavar="FILE", help="take [gossip] from this TOML file")
    record.add_argument("--interface", metavar="NAME", help="network interface, like wlan0")
    record.add_argument("--group", metavar="ADDRESS", help="multicast group of the team")
    record.add_argument("--port", type=int, metavar="PORT", help="UDP port of the team")


def _record(options: argparse.Namespace) -> int:
    from drslamd.io.recording.group_log import GroupLog

    section, path = _section(options), Path(options.file)
    where = f"{section.group}:{section.port} on {section.interface or 'the default interface'}"
    if path.exists():
        print(f"{path}: is there already; give another name", file=sys.stderr)
        return CANNOT_CREATE
    try:
        log = GroupLog(section, path)
    except OSError as error:
        is_file = error.filename is not None
        reason = f"{error.strerror or error}; name one that is up: --interface (ip -br address)"
        print(unmade(path, error) if is_file else f"cannot join {where}: {reason}", file=sys.stderr)
        return CANNOT_CREATE if is_file else UNAVAILABLE
    stopped: list[int] = []
    for number in stops():
        signal.signal(number, lambda got, _: stopped.append(got))
    print(f"listening to {where}, Ctrl-C ends", file=sys.stderr)
    shown = time.monotonic()

    def is_over() -> bool:
        nonlocal shown
        if sys.stderr.isatty() and time.monotonic() - shown >= SAY_EVERY_S:
            shown = time.monotonic()
            count = sum(log.channels.values())
            print(f"\r{count} messages, {log.bytes / 1e6:.1f} MB", end="", file=sys.stderr)
        return bool(stopped)

    code = OK
    try:
        log.run(is_over)
    except OSError as error:
        print(f"\n{unmade(path, error)}; what was heard before is kept", file=sys.stderr)
        code = CANNOT_CREATE
    log.close()
    for channel, count in sorted(log.channels.items()):
        print(f"{count:>8} {channel}")
    if log.refused:
        print(f"{log.refused:>8} datagrams that are no LCM message of one piece: left out")
    if not log.channels:
        print(
            "nothing was heard: are group, port and interface those of the robots? "
            "name the interface with --interface",
            file=sys.stderr,
        )
    return code


def _section(options: argparse.Namespace) -> GossipSection:
    """Where to listen. Raises ConfigError, with a sentence for each fault."""
    section = load(options.config).gossip if options.config else GossipSection()
    named = {"interface": options.interface, "group": options.group, "port": options.port}
    given = {key: value for key, value in named.items() if value is not None}
    options.config = options.config or "drslamd record"
    try:
        return _Group.model_validate({"gossip": {**section.model_dump(), **given}}).gossip
    except ValidationError as error:
        raise ConfigError(sentences(error, _Group)) from None
