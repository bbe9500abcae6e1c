"""A living peer as the front end sees it."""

from __future__ import annotations

from dataclasses import dataclass

from drslamd.conventions import Chain
from drslamd.slam.odometry.track import Track


@dataclass(frozen=True)
class PeerInRange:
    """One start of one robot within UWB range.

    Attributes:
        uwb_id: of its module.
        ranges_to_us: does it measure ranges to us?
        track: its odometry of the last minutes.
        ahead_us: its clock minus ours; None while that is not known well enough.
        frame: robot in whose frame it says that it is localised, None while it does not.
        is_lost: does it say that it has a hole in its odometry, or had one and is not back?
        wanted_n: first sample of our odometry that it lacked and needed when it last said so, at
            wanted_at, us; -1 when it needs none.
        clocks_since_us: from when on our clock that holds; either clock jumped before.
    """

    chain: Chain
    uwb_id: int
    ranges_to_us: bool
    track: Track
    ahead_us: int | None
    wanted_n: int = -1
    wanted_at: int = 0
    clocks_since_us: int = 0
    frame: int | None = None
    is_lost: bool = False
