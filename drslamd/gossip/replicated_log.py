"""One robot's log as another holds it: which entries are here, and which are known to lack.

What others say of the log is believed only as long as they say it: the owner's word replaces its
last one, and what somebody else has heard of counts only so far ahead of what is held. So a false
word costs nothing that the next true one does not give back.
"""

from __future__ import annotations

from dataclasses import dataclass, field

MAX_ENTRIES = 36_000
"""Of one log: ten hours at one entry a second, 12 to 17 MB; the oldest go first."""
AHEAD = 1_024
"""How far beyond what its owner spoke of an entry may be: a quarter of an hour at one a second. An
entry farther ahead would cost others their place; if it is true, it comes again."""


@dataclass
class ReplicatedLog:
    """Sealed entries by number, and when each was last on the air."""

    epoch: int
    sealed: dict[int, bytes] = field(default_factory=dict)
    aired: dict[int, int] = field(default_factory=dict)
    first: int = 0
    """What lies before it is forgotten and refused."""
    start: int = 0
    """From here on the log is waited for: `first`, or later when the owner holds no more than
    that."""
    complete: int = 0
    """The first that is missing from `start` on."""
    end: int = 0
    """One past the last that is held."""
    newest: int = 0
    """One past the last that was heard of."""

    def put(self, seq: int, sealed: bytes) -> None:
        self.sealed[seq] = sealed
        self.end = max(self.end, seq + 1)
        self.newest = max(self.newest, self.end)
        self._forget_before(self.end - MAX_ENTRIES)
        self._advance()

    def on_owner(self, first: int, newest: int) -> None:
        """The owner says from where to where its log goes; what it said before counts no more."""
        self.newest = max(self.end, newest)
        if self.start > max(first, self.first):
            self.start = self.complete = self.first
            self._advance()
        if first > self.complete:
            # the owner itself no longer holds what we lack
            self.start = self.complete = first
            self._advance()

    def on_hearsay(self, newest: int) -> None:
        """Somebody else has heard of entries before `newest`."""
        self.newest = max(self.newest, min(newest, self.end + AHEAD))

    def _forget_before(self, first: int) -> None:
        """Give up what is older, whether it was held or not."""
        if first <= self.first:
            return
        # never count through more numbers than there are entries
        few = first - self.first <= len(self.sealed)
        for seq in range(self.first, first) if few else [s for s in self.sealed if s < first]:
            self.sealed.pop(seq, None)
            self.aired.pop(seq, None)
        self.first = first
        self.start, self.complete = max(self.start, first), max(self.complete, first)
        self._advance()

    def _advance(self) -> None:
        while self.complete in self.sealed:
            self.complete += 1

    def is_held(self, seq: int) -> bool:
        return seq in self.sealed

    @property
    def lacking(self) -> int:
        """Entries that we know of, wait for and do not hold."""
        held = len(self.sealed)
        if self.start > self.first:
            held = sum(seq >= self.start for seq in self.sealed)
        return max(0, self.newest - self.start - held)
