"""One robot's log as another holds it: which entries are here, and which are known to lack."""

from __future__ import annotations

from dataclasses import dataclass, field

MAX_ENTRIES = 36_000
"""Of one log: ten hours at one entry a second, 12 to 17 MB; the oldest go first."""


@dataclass
class ReplicatedLog:
    """Sealed entries by number, and when each was last on the air."""

    epoch: int
    sealed: dict[int, bytes] = field(default_factory=dict)
    aired: dict[int, int] = field(default_factory=dict)
    first: int = 0
    """What lies before it is forgotten and refused."""
    complete: int = 0
    """The first that is missing."""
    end: int = 0
    """One past the last that is held."""
    newest: int = 0
    """One past the last that was heard of."""

    def put(self, seq: int, sealed: bytes) -> None:
        self.sealed[seq] = sealed
        self.end = max(self.end, seq + 1)
        self.newest = max(self.newest, self.end)
        self.forget_before(self.end - MAX_ENTRIES)
        self._advance()

    def forget_before(self, first: int) -> None:
        """Give up what is older, whether it was held or not."""
        if first <= self.first:
            return
        # never count through more numbers than there are entries: `first` comes from outside
        few = first - self.first <= len(self.sealed)
        for seq in range(self.first, first) if few else [s for s in self.sealed if s < first]:
            self.sealed.pop(seq, None)
            self.aired.pop(seq, None)
        self.first = first
        self.complete, self.end = max(self.complete, first), max(self.end, first)
        self.newest = max(self.newest, first)
        self._advance()

    def _advance(self) -> None:
        while self.complete in self.sealed:
            self.complete += 1

    def is_held(self, seq: int) -> bool:
        return seq in self.sealed
