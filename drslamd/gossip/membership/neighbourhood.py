"""Who is within UWB range of a robot: asked again and again in one moment, looked up once in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from drslamd.conventions import Chain
from drslamd.gossip.peer import Peer
from drslamd.slam.peer_in_range import PeerInRange


class Neighbourhood:
    """Of one robot."""

    def __init__(
        self,
        own: Chain,
        living: Callable[[int], Mapping[int, Peer]],
        ranged: Callable[[int], list[int]],
    ) -> None:
        """
        Args:
            living: peers at a time, us, by robot; ranged: UWB ids to which ranges came in of late.
        """
        self._own, self._living, self._ranged = own, living, ranged
        self._found: dict[int, list[PeerInRange]] | None = None
        """By time, us; None while what is found must not be kept."""

    def at(self, utime: int) -> list[PeerInRange]:
        """Living peers within UWB range of us, as either side measures it."""
        if self._found is None:
            return self._look(utime)
        if utime not in self._found:
            self._found[utime] = self._look(utime)
        return self._found[utime]

    @contextmanager
    def held(self) -> Iterator[None]:
        """Nothing is heard or measured meanwhile, so what was found stays right."""
        self._found = {}
        try:
            yield
        finally:
            self._found = None

    def look_again(self) -> None:
        """Something about peers has changed all the same."""
        if self._found:
            self._found.clear()

    def _look(self, utime: int) -> list[PeerInRange]:
        mine = set(self._ranged(utime))
        peers = (peer.neighbour(self._own, utime) for peer in self._living(utime).values())
        return [peer for peer in peers if peer.ranges_to_us or peer.uwb_id in mine]
