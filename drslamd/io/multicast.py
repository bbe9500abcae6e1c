"""LCM over UDP multicast without liblcm: small messages only, on the interface that is named.

liblcm needs a route to the group (an ad-hoc network has none), never receives again after its
interface was re-created, and can be killed by one malformed datagram. This transport joins by
interface, takes the return of its own messages as the only proof that the group works, and joins
again when they stay away.
"""

from __future__ import annotations

import asyncio
import errno
import ipaddress
import itertools
import socket
import struct
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from drslamd.config import GossipSection
from drslamd.events import Datagram, Event, NetworkState
from drslamd.gossip import lc02
from drslamd.gossip.membership.shares import Shares
from drslamd.host.interfaces import NO_ADDRESS, SYSFS, address_of, fault_of
from drslamd.io.backoff import Backoff
from drslamd.io.clock import Clock
from drslamd.io.watch.callers import Callers

IP_MULTICAST_ALL = 49
"""Linux, <linux/in.h>; the socket module does not name it."""
RECEIVE_BUFFER = 1 << 20
"""Bytes asked of the kernel: a second of a team of fifty."""
ECHO_S = 5.0
"""Silence of our own messages after which the group is joined anew."""
LOOK_S = 1.0
"""How often that is looked at."""
RECENT = 32
"""Own datagrams that are recognised when they come back."""
DATAGRAMS_AT_ONCE = 64
"""Read in one go; then other readers have their turn."""
SHARE, SHARE_AT_ONCE, ADDRESSES = 1_000, 2_000, 256
"""Datagrams a second of one address, and after a pause: fifty robots on one computer say fewer.
So many addresses are told apart."""
REMIND_S = 5.0
"""How often switches are told that we are here, while somebody is missed."""


class Multicast:
    """The native transport.

    Attributes:
        dropped: messages that the network did not take, since the start.
        flooded: datagrams that were not looked at, since their address sends too many.
        reads: how often it has read since the start.
    """

    def __init__(
        self,
        section: GossipSection,
        clock: Clock,
        deliver: Callable[[Event], None],
        is_news: Callable[[bytes], bool] = lambda data: False,
    ) -> None:
        """
        Args:
            is_news: is a datagram proven to be a robot's, and new? Then it is heard in any flood.
        """
        self._section = section
        self._clock = clock
        self._deliver = deliver
        self._socket: socket.socket | None = None
        self._sequence = itertools.count()
        self._recent: deque[bytes] = deque(maxlen=RECENT)
        self._unheard_since: float | None = None
        self._failed = asyncio.Event()
        self._backoff = Backoff()
        self._last_state: tuple[bool, str] | None = None
        self._own_addresses: set[str] = set()
        """That were heard since the group was joined; no computer has many."""
        self._is_news = is_news
        self._shares: Shares[str] = Shares(SHARE, SHARE_AT_ONCE, ADDRESSES)
        self._callers, self._told_switches, self._said_where = Callers(), 0.0, 0.0
        self.dropped = self.reads = self.flooded = 0

    async def run(self) -> None:
        """Join, watch, join again."""
        try:
            while True:
                if self._open():
                    await self._until_it_fails()
                await self._backoff.wait()
        finally:
            self._close()

    def descriptor(self) -> int:
        """Of the open socket, or -1."""
        return -1 if self._socket is None else self._socket.fileno()

    def send(self, channel: str, payload: bytes) -> None:
        """Publish without waiting."""
        datagram = lc02.encode(next(self._sequence), channel, payload)
        if self._socket is None:
            self.dropped += 1
            return
        try:
            self._socket.sendto(datagram, (self._section.group, self._section.port))
        except OSError as error:
            self.dropped += 1
            if not isinstance(error, BlockingIOError):
                self._fail(send_fault(self._section, error))
            return
        self._recent.append(datagram)
        if self._unheard_since is None:
            self._unheard_since = asyncio.get_running_loop().time()

    @property
    def _where(self) -> str:
        return _where(self._section)

    def _open(self) -> bool:
        try:
            self._socket = open_group(self._section)
        except OSError as error:
            self._state(False, join_fault(self._section, error))
            return False
        self._failed.clear()
        self._unheard_since = None
        self._own_addresses.clear()
        loop = asyncio.get_running_loop()
        loop.add_reader(self._socket.fileno(), self._read)
        self._told_switches = loop.time()
        return True

    async def _until_it_fails(self) -> None:
        """Watch for our own messages, which the kernel hands back as long as the group works."""
        loop = asyncio.get_running_loop()
        while not self._failed.is_set():
            try:
                await asyncio.wait_for(self._failed.wait(), LOOK_S)
            except (asyncio.TimeoutError, TimeoutError):
                since = self._unheard_since
                if since is not None and loop.time() - since > ECHO_S:
                    self._fail(f"own messages do not come back on {self._where}; joining again")
                else:
                    self._remind_switches(loop.time())

    def _remind_switches(self, now: float) -> None:
        """Report our membership, which a switch may have forgotten: it then sends us nothing, or
        nothing of those who are on another of its ports."""
        is_missed = self._callers.is_anybody_missed(now)
        if self._socket is None or not is_missed or now - self._told_switches < REMIND_S:
            return
        self._told_switches = now
        try:
            report_membership(self._socket, self._section)
        except OSError as error:
            self._fail(join_fault(self._section, error))

    def _read(self) -> None:
        self.reads += 1
        loop = asyncio.get_running_loop()
        for _ in range(DATAGRAMS_AT_ONCE):
            if self._socket is None:
                return
            try:
                data, sender = self._socket.recvfrom(65_536)
            except BlockingIOError:
                return
            except OSError as error:
                self._fail(f"cannot receive on {self._where}: {error.strerror or error}")
                return
            if self._section.ttl == 0 and not self._is_of_this_host(sender[0]):
                continue  # in both directions
            now = self._clock.now()
            if data in self._recent:
                self._heard_ourselves()
            else:
                self._callers.hear(sender[0], loop.time())
                if not self._admits(data, sender[0], now):
                    continue
            self._deliver(Datagram(now, data, sender[0]))

    def _admits(self, data: bytes, address: str, utime: int) -> bool:
        """Is it within the share of its address? If not, only a robot is heard."""
        if self._shares.takes(address, 1.0, utime) or self._is_news(data):
            return True
        self.flooded += 1
        return False

    def complaint(self) -> str | None:
        """One sentence while the group is flooded."""
        floods = self._shares.over(self._clock.now())
        if not floods:
            return None
        worst = max(floods, key=lambda who: floods[who])
        return (
            f"{worst or 'many addresses'} floods {self._section.group}:{self._section.port} "
            f"({floods[worst]:.0f} datagrams a second too many): robots are heard, most else is "
            "not looked at; find out what runs there, or set another gossip.group"
        )

    def _is_of_this_host(self, address: str) -> bool:
        if address not in self._own_addresses and is_own(address):
            self._own_addresses.add(address)
        return address in self._own_addresses

    def _heard_ourselves(self) -> None:
        self._unheard_since = None
        self._backoff.reset()
        now, is_up = asyncio.get_running_loop().time(), self._last_state and self._last_state[0]
        if is_up and now - self._said_where < LOOK_S:
            return
        self._said_where = now
        address = own_address(self._section)
        at = self._where if address == self._where else f"{self._where} ({address})"
        self._state(True, f"{self._section.group}:{self._section.port} on {at}")

    def _fail(self, why: str) -> None:
        self._close()
        self._state(False, why)
        self._failed.set()

    def _close(self) -> None:
        if self._socket is not None:
            asyncio.get_running_loop().remove_reader(self._socket.fileno())
            self._socket.close()
            self._socket = None

    def _state(self, up: bool, detail: str) -> None:
        if (up, detail) != self._last_state:
            self._last_state = (up, detail)
            self._deliver(NetworkState(self._clock.now(), up, detail))


def join_fault(section: GossipSection, error: OSError) -> str:
    """Why the group cannot be joined."""
    return f"cannot join {section.group} on {_where(section)}: {_reason(section, error)}"


def send_fault(section: GossipSection, error: OSError, sysfs: Path = SYSFS) -> str:
    """Why nothing can be sent to the group."""
    return f"cannot send on {_where(section)}: {_reason(section, error, sysfs)}"


def own_address(section: GossipSection) -> str:
    """The IPv4 address under which this robot sends to its group."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        try:
            if section.interface:
                return address_of(section.interface) or section.interface
            sender.connect((section.group, section.port))
            return str(sender.getsockname()[0])
        except OSError as error:
            return error.strerror or "no address"


def _where(section: GossipSection) -> str:
    return section.interface or "the default interface"


def _reason(section: GossipSection, error: OSError, sysfs: Path = SYSFS) -> str:
    """What the kernel says, and what it does not say of the interface."""
    if not section.interface:
        return f"{error.strerror or error}; name one as gossip.interface"
    return fault_of(section.interface, sysfs) or error.strerror or str(error)


def _member(section: GossipSection) -> bytes:
    """The group on its interface, as `struct ip_mreqn`; errors as of `open_group`."""
    address, index = "0.0.0.0", 0
    if section.interface:
        try:
            address = str(ipaddress.IPv4Address(section.interface))
        except ValueError:
            index = socket.if_nametoindex(section.interface)
            if not address_of(section.interface):
                # the kernel would send under the address of another interface
                raise OSError(errno.EADDRNOTAVAIL, NO_ADDRESS) from None
    return struct.pack("4s4si", *map(socket.inet_aton, (section.group, address)), index)


def open_group(section: GossipSection) -> socket.socket:
    """A non-blocking socket that is in the group, on the interface that is named.

    Raises:
        OSError: no such interface, none of its addresses, no route, port taken.
    """
    member = _member(section)
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
    try:
        udp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        udp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
        # without this a socket hears the group on every interface where any program joined it
        udp.setsockopt(socket.IPPROTO_IP, IP_MULTICAST_ALL, 0)
        udp.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
        udp.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, section.ttl)
        if section.interface:
            udp.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, member)
        udp.bind((section.group, section.port))
        udp.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
    except OSError:
        udp.close()
        raise
    return udp


def report_membership(udp: socket.socket, section: GossipSection) -> None:
    """Make the kernel say that we are in the group, which it says when we join.

    What comes meanwhile, about 30 us, is lost: so this is for when somebody is missed.

    The socket leaves and comes back; by IGMPv3 the kernel then says only that it is there. By
    IGMPv2 it would also say that it left, but that it speaks only where a router asks for members,
    and there no switch forgets.

    Raises:
        OSError: the interface is gone.
    """
    member = _member(section)
    with suppress(OSError):
        udp.setsockopt(socket.IPPROTO_IP, socket.IP_DROP_MEMBERSHIP, member)
    udp.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)


def is_own(address: str) -> bool:
    """Is it an address of this computer? Only such a one can be bound; interfaces come and go."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((address, 0))
        except OSError:
            return False
    return True
