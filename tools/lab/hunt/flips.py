"""Two bits turned over in frames of a LinkTrack module: how many wrong ranges come out of them?

The checksum of a frame is the sum of its bytes, so every fifteenth pair of damaged bits passes it.
A module prints frames with four peers, fifty a second, whose ranges change as those of robots that
drive; in every second frame two bits are turned over. A range is wrong if it is not the one that
was measured, by however little; it is harmful if it is more than `HARMFUL_M` off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from drslamd.conventions import SECOND_US
from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput
from lab.play.emulators import LinkTrackEmulator

HARMFUL_M = 0.25
"""More than a range is noisy by."""
FRAME_S = 0.02
PEERS = 4
KINDS = (2, 3, 5)
ONE_IN = 100_000


class Flipped(NamedTuple):
    """What came of so many damaged frames.

    Attributes:
        wrong, harmful: ranges that were believed and were not measured.
        lost: of each hundred whole frames, those that gave no ranges.
    """

    many: int
    wrong: int
    harmful: int
    lost: float

    @property
    def is_kept(self) -> bool:
        """Fewer than one of 100,000 damaged frames may do harm."""
        return self.harmful * ONE_IN <= self.many

    def line(self) -> str:
        return (
            f"{self.many:.3g} frames with two bits turned over: {self.wrong} wrong ranges believed,"
            f" {self.harmful} of them off by more than {HARMFUL_M} m;"
            f" {self.lost:.2f} % of whole frames lost"
        )


def double_flips(many: int, seed: int = 0, told: Callable[[float], None] = print) -> Flipped:
    """Half of the frames are damaged, so that each follows one that is whole."""
    rng = np.random.default_rng(seed)
    wrong = harmful = given = whole = 0
    each = -(-many // len(KINDS))
    for place, kind in enumerate(KINDS):
        module, uwb = LinkTrackEmulator(0, kind), LinkTrackInput(0, max_range_m=120.0)
        for k in range(2 * each):
            t = FRAME_S * k
            metres = 8 + 5 * np.sin(0.1 * t + np.arange(PEERS)) + rng.normal(0, 0.05, PEERS)
            data = bytearray(module.frame(t, list(enumerate(metres.tolist(), start=1))))
            is_damaged = k % 2 == 1
            for bit in rng.choice(8 * len(data), 2, replace=False) if is_damaged else ():
                data[bit // 8] ^= 1 << bit % 8
            came = uwb.feed(bytes(data), SECOND_US + round(t * 1e6))
            # a frame that has to wait for the next one comes with it
            now = [sample for sample in came if sample.utime > SECOND_US + (t - 0.015) * 1e6]
            off = [abs(s.range_m - _said(metres, s.peer_uwb_id)) for s in now]
            wrong += sum(e > 0.0006 for e in off)
            harmful += sum(e > HARMFUL_M for e in off)
            whole += not is_damaged
            given += not is_damaged and bool(now)
        told((place + 1) * each)
    return Flipped(len(KINDS) * each, wrong, harmful, 100 * (1 - given / whole))


def _said(metres: np.ndarray[tuple[int], np.dtype[np.float64]], uwb_id: int) -> float:
    """The range to a module, infinite if there is none of this id."""
    return float(metres[uwb_id - 1]) if 1 <= uwb_id <= PEERS else float("inf")
