"""A radio on which everything goes wrong: what it does to datagrams, and from when to when.

Each trouble is a function of what would have arrived; several at once are applied one after the
other.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field

import numpy as np

from lab.play.simulator import Network

Way = tuple[int, int]
"""Who speaks and who might hear it."""
Mail = list[tuple[int, bytes]]
"""When copies of a datagram arrive, us, and what is left of each."""
Change = Callable[[np.random.Generator, Way, int, Mail], Mail]

BAD_S = 1.0
"""Mean length of a burst in which nothing arrives."""
HEADER_BYTES = 8
"""LCM's magic and sequence number; damage there is none to what is said."""


@dataclass(frozen=True)
class Trouble:
    """What happens to the mail while it lasts."""

    begin_us: int
    end_us: int
    change: Change


@dataclass
class Radio(Network):
    """A shared channel with troubles.

    Attributes:
        damaged: datagrams under way that are no longer what was sent.
    """

    troubles: list[Trouble] = field(default_factory=list)
    damaged: set[bytes] = field(default_factory=set)

    def deliveries(
        self, rng: np.random.Generator, way: Way, t_us: int, data: bytes
    ) -> list[tuple[int, bytes]]:
        mail = super().deliveries(rng, way, t_us, data)
        for trouble in self.troubles:
            if trouble.begin_us <= t_us < trouble.end_us:
                mail = trouble.change(rng, way, t_us, mail)
        return mail

    def corrupting(self, share: float) -> Change:
        """So many datagrams have one to three bits turned over."""

        def change(rng: np.random.Generator, way: Way, t_us: int, mail: Mail) -> Mail:
            return [
                (at, self._bent(rng, data)) if rng.random() < share else (at, data)
                for at, data in mail
            ]

        return change

    def _bent(self, rng: np.random.Generator, data: bytes) -> bytes:
        out = bytearray(data)
        for _ in range(int(rng.integers(1, 4))):
            out[int(rng.integers(HEADER_BYTES, len(out)))] ^= 1 << int(rng.integers(8))
        if out != data:
            self.damaged.add(bytes(out))
        return bytes(out)


def lossy(share: float) -> Change:
    """Each copy is lost for itself."""
    return lambda rng, way, t_us, mail: [copy for copy in mail if rng.random() >= share]


def bursty(share: float) -> Change:
    """Gilbert and Elliott's channel: each link is good or dead, each for a while."""
    states: dict[Way, tuple[bool, int]] = {}

    def change(rng: np.random.Generator, way: Way, t_us: int, mail: Mail) -> Mail:
        is_dead, until = states.get(way, (rng.random() >= share, t_us))
        while until <= t_us:
            is_dead = not is_dead
            mean_s = BAD_S if is_dead else BAD_S * (1 - share) / share
            until += 1 + int(rng.exponential(mean_s) * 1e6)
        states[way] = is_dead, until
        return [] if is_dead else mail

    return change


def dark(every_s: float, for_s: float) -> Change:
    """Nothing arrives for a while, again and again."""
    every, long = every_s * 1e6, for_s * 1e6
    return lambda rng, way, t_us, mail: [] if t_us % every < long else mail


def late(most_s: float) -> Change:
    """Copies come late by up to so much, so in any order."""
    most = int(most_s * 1e6)
    return lambda rng, way, t_us, mail: [
        (at + int(rng.integers(0, most + 1)), data) for at, data in mail
    ]


def copied(times: int) -> Change:
    """Everything comes so often, the copies within a second."""
    return lambda rng, way, t_us, mail: [
        (at + (int(rng.integers(0, 1_000_000)) if k else 0), data)
        for at, data in mail
        for k in range(times)
    ]


def one_way(ways: Collection[Way]) -> Change:
    """On these ways nothing is heard."""
    return lambda rng, way, t_us, mail: [] if way in ways else mail


def parted(side: Collection[int], flap_s: float = 0.0) -> Change:
    """The team falls in two, for good or in turn with a whole one."""

    def change(rng: np.random.Generator, way: Way, t_us: int, mail: Mail) -> Mail:
        is_whole = flap_s > 0 and t_us // round(flap_s * 1e6) % 2 == 1
        is_cut = (way[0] in side) != (way[1] in side)
        return [] if is_cut and not is_whole else mail

    return change


def short(metres: float, apart_m: Callable[[int, int, float], float]) -> Change:
    """Nobody is heard who is farther away; `apart_m` of two robots and a time, s."""
    return lambda rng, way, t_us, mail: mail if apart_m(*way, t_us / 1e6) <= metres else []
