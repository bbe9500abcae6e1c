"""``drslamd view``: the team on a live map, in a browser."""

from __future__ import annotations

import argparse
import asyncio
import ipaddress
import re
import socket
import sys
from typing import TYPE_CHECKING

from pydantic import ValidationError

from drslamd.cli.exit_codes import OK, UNAVAILABLE, USAGE
from drslamd.cli.parser import Verbs, load, verb
from drslamd.config import GossipSection
from drslamd.config_faults import sentences
from drslamd.config_wheels import Section

if TYPE_CHECKING:
    from drslamd.view.live_map import Listening
    from drslamd.view.scene.hearing import Hearing

HTTP_PORT = 8808
EXAMPLES = """\
  drslamd view --interface wlan0             the team on this network, not verified
  drslamd view -c /etc/drslamd/3.toml        group, interface and team key of that file
  drslamd view -c 3.toml --listen 0.0.0.0    also for the phone of who stands beside it"""
REMEDY = 'drslamd view needs aiohttp: pip install "drslamd[view]"'


class _Flags(Section):
    """As the file has it, so that faults are worded alike."""

    gossip: GossipSection


def add(verbs: Verbs) -> None:
    """Add the verb."""
    view = verb(verbs, "view", _view, "show the team on a live map, in a browser", EXAMPLES)
    view.add_argument("-c", "--config", metavar="FILE", help="group, interface and key of this")
    view.add_argument("--group", metavar="ADDRESS", help="multicast group (default 239.255.76.67)")
    view.add_argument("--port", type=int, help="of the group (default 7667)")
    view.add_argument("--interface", metavar="NAME", help="network interface of the team")
    view.add_argument(
        "--listen",
        metavar="ADDRESS",
        default="127.0.0.1",
        help="where browsers may come from: 127.0.0.1 this computer (default), 0.0.0.0 anywhere",
    )
    view.add_argument(
        "--http-port", type=int, default=HTTP_PORT, metavar="PORT", help="default 8808, 0 any free"
    )


def _view(options: argparse.Namespace) -> int:
    try:
        import aiohttp  # noqa: F401
    except ImportError:
        print(REMEDY, file=sys.stderr)
        return UNAVAILABLE
    fault = _usage_fault(options)
    if fault:
        print(f"drslamd view: {fault}", file=sys.stderr)
        return USAGE
    hearing, listening = _ears(options)
    return asyncio.run(_run(options, hearing, listening))


async def _run(options: argparse.Namespace, hearing: Hearing, listening: Listening) -> int:
    from drslamd.view.door import is_loopback
    from drslamd.view.live_map import LiveMap

    live_map = LiveMap(hearing, listening)
    try:
        port = await live_map.open(options.listen, options.http_port)
    except OSError as error:
        where = f"{options.listen}:{options.http_port}"
        print(
            f"{where}: {error.strerror or error}; give another with --listen or --http-port",
            file=sys.stderr,
        )
        return UNAVAILABLE
    for host in _hosts(options.listen):
        print(f"live map: http://{host}:{port}/", flush=True)
    print(hearing.trust(), file=sys.stderr)
    if not is_loopback(options.listen):
        print("whoever reaches this computer over the network can look, too", file=sys.stderr)
    await live_map.run()
    return OK


def _usage_fault(options: argparse.Namespace) -> str | None:
    """What cannot be meant, in a sentence."""
    if not 0 <= options.http_port <= 65_535:
        return f"--http-port {options.http_port}: allowed are 0 to 65535"
    try:
        ipaddress.ip_address(options.listen)
    except ValueError:
        return f"--listen {options.listen}: must be an address, such as 127.0.0.1 or 0.0.0.0"
    try:
        _section(GossipSection(), options)
    except ValidationError as error:
        (fault, *_) = sentences(error, _Flags)
        return re.sub(r"^gossip[.:] ?", "--", fault).replace(" = ", " ", 1)
    return None


def _ears(options: argparse.Namespace) -> tuple[Hearing, Listening]:
    """What is listened to, and what of it is believed.

    Raises:
        ConfigError: the file or its key cannot be used.
    """
    from drslamd.io.state_store import read_key
    from drslamd.view.listener import Listener
    from drslamd.view.scene.hearing import Hearing

    secret, verifies, section = None, False, GossipSection()
    if options.config:
        config = load(options.config)
        section, verifies = config.gossip, not config.team.insecure
        secret = read_key(config.team.key_file) if verifies else None
    section, hearing = _section(section, options), Hearing(secret, verifies)
    if section.provider == "liblcm":
        from drslamd.io.liblcm import Liblcm, require_lcm

        require_lcm()
        return hearing, lambda clock, deliver: Liblcm(section, clock, deliver)
    return hearing, lambda clock, deliver: Listener(section, clock, deliver)


def _section(section: GossipSection, options: argparse.Namespace) -> GossipSection:
    """With the flags in the place of its keys.

    Raises:
        ValidationError: a flag cannot be used.
    """
    named = {name: getattr(options, name) for name in ("group", "port", "interface")}
    given = {name: value for name, value in named.items() if value is not None}
    return _Flags.model_validate({"gossip": {**section.model_dump(), **given}}).gossip


def _hosts(listen: str) -> list[str]:
    """Under which names a browser finds us."""
    address = ipaddress.ip_address(listen)
    if address.is_unspecified:
        return ["localhost", f"{socket.gethostname()}.local"]
    return [f"[{address}]" if address.version == 6 else str(address)]
