"""Which start of each robot is the present one, and whether a later one of ours is known.

What one message can do is bounded, whoever made it:

* While a start of a robot speaks, no other start takes its place: a message under a later epoch is
  refused until the robot was silent for `SPEAKS_US`. A robot that really began again loses at most
  that long; one that said goodbye loses nothing.
* An epoch above all clocks is believed in steps (`drslamd.gossip.epochs`).
* That a later start of ours is known counts only when one peer says the very same twice,
  `CONFIRM_US` apart, and does not say that it hears us. Then our memory was lost, or a lie is
  believed: we begin again above it, and are heard again. Likewise when it holds entries of our log
  that we never made.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from drslamd.conventions import SECOND_US, Chain
from drslamd.gossip.epochs import EPOCH_STEP, FIRST_EPOCH, LAST_KEPT_EPOCH, highest_believed
from drslamd.gossip.message_types import Status
from drslamd.gossip.peer import Peer

SPEAKS_US = 3 * SECOND_US
"""A robot says something about every second: at 30 % loss a living one stays silent so long in 3 %
of cases. To end and come back takes a daemon about as long."""
CONFIRM_US = 2 * SECOND_US
"""Between the first word of a peer and the one that counts: not two copies of one lie."""


class StartFault(Enum):
    ANOTHER_SPEAKS = "of another start than the one that speaks"
    BEYOND_CLOCKS = "of a start later than any clock can say"


class _Claim(NamedTuple):
    """What a peer says that it knows of us, since when the very same, and when it last did.

    Attributes:
        said: the start, and up to where it holds a log of ours that we did not say.
        epoch: the start above which we would have to begin again.
    """

    said: tuple[int, int]
    epoch: int
    since: int
    latest: int


class Starts:
    """The starts of all robots as one robot, `own`, knows them."""

    def __init__(self, own: Chain, epochs: dict[int, int]) -> None:
        """
        Args:
            epochs: the latest known epoch of each robot, kept up to date by the caller.
        """
        self._own, self._epochs = own, epochs
        self._believed: dict[int, int] = {}
        """By robot: up to where its epochs are believed, where that is more than at first."""
        self._claims: dict[int, _Claim] = {}
        """By the peer that says so."""
        self._was_silent = True

    def judge(self, origin: Chain, peer: Peer | None, utime: int) -> StartFault | None:
        """A proven message of a start that is not past: may it speak?

        Args:
            peer: the robot as we know it.
        """
        latest = self._epochs.get(origin.robot, FIRST_EPOCH)
        if origin.epoch == latest:
            return None
        if peer is not None and peer.chain.epoch < origin.epoch and peer.speaks(utime, SPEAKS_US):
            return StartFault.ANOTHER_SPEAKS
        believed = max(self._believed.get(origin.robot, 0), highest_believed(latest))
        if origin.epoch > believed:
            self._believed[origin.robot] = believed + EPOCH_STEP
            return StartFault.BEYOND_CLOCKS
        return None

    def on_status(self, sender: int, status: Status, said: int | None, utime: int) -> None:
        """A peer says which starts it knows: is there one of ours that we do not?

        Args:
            said: how many entries our log has; None while this start has not said a word, so that
                whoever knows it knows another of the same number.
        """
        if said is not None and self._was_silent:
            self._claims.clear()  # of what was known before our first word
        self._was_silent = said is None
        own = self._own
        heard = {h.epoch for h in status.heard if h.id == own.robot}
        logs = [log for log in status.logs if log.id == own.robot]
        later = heard | {log.epoch for log in logs}
        # who hears this start has not taken a later one for ours
        named = set() if own.epoch in heard else {e for e in later if e > own.epoch}
        if said is None:
            named = {e for e in later if e >= own.epoch}
        unsaid = [
            log.complete
            for log in logs
            if log.epoch == own.epoch and log.first < log.complete > (said or 0)
        ]
        if unsaid:
            named.add(own.epoch)  # it holds what we never said: this epoch was used before
        # whoever was lied high and lost its memory comes back there step by step
        most = min(highest_believed(own.epoch), LAST_KEPT_EPOCH - 2 * SECOND_US)
        latest = max(named, default=-1)
        if min(latest, most) < own.epoch:
            self._claims.pop(sender, None)
            return
        claim, known = (latest, max(unsaid, default=0)), self._claims.get(sender)
        since = known.since if known is not None and known.said == claim else utime
        self._claims[sender] = _Claim(claim, min(latest, most), since, utime)

    def superseded_by(self) -> int | None:
        """The epoch above which we have to begin again to be heard by all; None as it should be."""
        sure = [c.epoch for c in self._claims.values() if c.latest - c.since >= CONFIRM_US]
        return max(sure, default=None)
