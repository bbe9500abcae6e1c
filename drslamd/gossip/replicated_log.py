"""One robot's log as another holds it: which entries are here, and which are known to lack.

What others say of the log is believed only as long as they say it: the owner's word replaces its
last one, and what somebody else has heard of counts only so far ahead of what is held. So a false
word costs nothing that the next true one does not give back.

A chapter (`drslamd.slam.graph.chapters`) whose parts are here stands for the entries that it
replaces: they are kept no longer, nor waited for.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from drslamd.slam.graph.chapters.replaced_entries import ReplacedEntries, Span, merged_spans
from drslamd.slam.graph.measurements import Chapter

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
    _replaced: ReplacedEntries = field(default_factory=ReplacedEntries)
    _told: dict[int, int] = field(default_factory=dict)
    """Of each part of a chapter, the first entry for which that stands."""

    def put(self, seq: int, sealed: bytes, chapter: Chapter | None = None) -> None:
        self.sealed[seq] = sealed
        if chapter is not None:
            for part in range(seq + 1 - chapter.parts, seq + 1):
                self._told[part] = chapter.replaces[0][0]
            for first, end in self._replaced.take(seq, chapter):
                self._drop_between(first, end)
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
        self._drop_between(self.first, first)
        self._replaced.forget_before(first)
        self.first = first
        self.start, self.complete = max(self.start, first), max(self.complete, first)
        self._advance()

    def _drop_between(self, first: int, end: int) -> None:
        # never count through more numbers than there are entries
        few = end - first <= len(self.sealed)
        for seq in range(first, end) if few else [s for s in self.sealed if first <= s < end]:
            self.sealed.pop(seq, None)
            self.aired.pop(seq, None)
            self._told.pop(seq, None)

    def _advance(self) -> None:
        while True:
            if self.complete in self.sealed:
                self.complete += 1
                continue
            end = self._replaced.end_of(self.complete)
            if end is None:
                return
            self.complete = end

    def is_held(self, seq: int) -> bool:
        """Is it here, to be said again?"""
        return seq in self.sealed

    def is_known(self, seq: int) -> bool:
        """Is it here, or a chapter that stands for it?"""
        return seq in self.sealed or self._replaced.has(seq)

    def _known_from(self, seq: int) -> list[Span]:
        """What is known from an entry on."""
        held = [(one, one + 1) for one in self.sealed if one >= seq]
        return merged_spans([*held, *self._replaced.spans_from(seq)])

    def stretches(self) -> list[Span]:
        """What is known beyond `complete`: from where to where."""
        return self._known_from(self.complete) if self.complete < self.end else []

    def is_of_chapter(self, seq: int) -> bool:
        """Is an entry part of a chapter of which the last part is here?"""
        return seq in self._told

    def held_from(self, start: int) -> list[int]:
        """Numbers of what is held from `start` on, in the order of what is told: chapters come in
        the place of what they stand for, so that whoever hears them has few gaps."""
        held = [seq for seq in self.sealed if seq >= start] if start < self.end else []
        return sorted(held, key=lambda seq: (self._told.get(seq, seq), seq))

    @property
    def lacking(self) -> int:
        """Entries that we know of, wait for and do not know."""
        known = sum(end - first for first, end in self._known_from(self.start))
        return max(0, self.newest - self.start - known)
