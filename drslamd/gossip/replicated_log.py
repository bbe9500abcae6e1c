"""One robot's log as another holds it: which entries are here, and which are known to lack.

What others say of the log is believed only as long as they say it: the owner's word replaces its
last one, and what somebody else has heard of counts only so far ahead of what is held. So a false
word costs nothing that the next true one does not give back.

Of chapters (`drslamd.slam.graph.chapters`) only the parts that still count are kept. A chapter
whose parts are here covers the entries that it says again: they are kept no longer, nor waited for.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from dataclasses import dataclass, field
from typing import NamedTuple

from drslamd.slam.graph.chapters import counts
from drslamd.slam.graph.measurements import Chapter

MAX_ENTRIES = 36_000
"""Of one log: ten hours at one entry a second, 12 to 17 MB; the oldest go first."""
AHEAD = 1_024
"""How far beyond what its owner spoke of an entry may be: a quarter of an hour at one a second. An
entry farther ahead would cost others their place; if it is true, it comes again."""


class _Cover(NamedTuple):
    """What a chapter covers: from `first` to `last`, its last part."""

    first: int
    last: int
    parts: tuple[int, int, int]

    def numbered(self) -> list[tuple[int, range]]:
        """The parts of each layer, by number."""
        out, begin = [], self.last + 1 - sum(self.parts)
        for layer, count in zip((2, 1, 0), self.parts, strict=True):
            out.append((layer, range(begin, begin + count)))
            begin += count
        return out


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
    latest: int = -1
    """The entry with which the latest chapter ends that is held."""
    _open: list[_Cover] = field(default_factory=list)
    """Of chapters whose parts are not yet here."""
    _covers: list[_Cover] = field(default_factory=list)
    """In order."""

    def put(self, seq: int, sealed: bytes, chapter: Chapter | None = None) -> None:
        self.sealed[seq] = sealed
        if chapter is not None and any(chapter.parts):
            self._open.append(_Cover(chapter.first, seq, chapter.parts))
            self.latest = max(self.latest, seq)
            self._fade()
        if self._open:
            self._cover()
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
            self._drop(seq)
        if self._covers and self._covers[0].last < first:
            self._covers = [cover for cover in self._covers if cover.last >= first]
        self._open = [cover for cover in self._open if cover.last >= first]
        self.first = first
        self.start, self.complete = max(self.start, first), max(self.complete, first)
        self._advance()

    def _drop(self, seq: int) -> None:
        self.sealed.pop(seq, None)
        self.aired.pop(seq, None)

    def _cover(self) -> None:
        """Which chapters are here, as far as they count?"""
        for cover in list(self._open):
            parts = cover.numbered()
            lasting = [
                seq
                for layer, seqs in parts
                if counts(layer, cover.last, self.latest)
                for seq in seqs
            ]
            if all(seq in self.sealed for seq in lasting):
                self._open.remove(cover)
                insort(self._covers, cover)
                for seq in set(range(cover.first, cover.last)) - set(lasting):
                    self._drop(seq)

    def _fade(self) -> None:
        """Drop the parts that count no more."""
        for cover in self._covers:
            for layer, seqs in cover.numbered():
                if not counts(layer, cover.last, self.latest):
                    for seq in seqs:
                        self._drop(seq)

    def _advance(self) -> None:
        while True:
            if self.complete in self.sealed:
                self.complete += 1
                continue
            last = self._covered_to(self.complete)
            if last is None:
                return
            self.complete = last + 1

    def _covered_to(self, seq: int) -> int | None:
        """The last entry of the chapter that covers an entry, None if none does."""
        at = bisect_right(self._covers, (seq, 1 << 32))
        cover = self._covers[at - 1] if at else None
        return cover.last if cover is not None and seq <= cover.last else None

    def is_held(self, seq: int) -> bool:
        """Is it here, to be said again?"""
        return seq in self.sealed

    def is_known(self, seq: int) -> bool:
        """Is it here, or what a chapter says of it?"""
        return seq in self.sealed or self._covered_to(seq) is not None

    def stretches(self, most: int) -> list[tuple[int, int]]:
        """What is known beyond `complete`: from where to where, the first ones."""
        if self.complete >= self.end:
            return []
        pieces = [(seq, seq + 1) for seq in self.sealed if seq > self.complete]
        pieces += [(c.first, c.last + 1) for c in self._covers if c.first > self.complete]
        out: list[tuple[int, int]] = []
        for first, end in sorted(pieces):
            if out and first <= out[-1][1]:
                out[-1] = out[-1][0], max(end, out[-1][1])
            elif len(out) == most:
                break
            else:
                out.append((first, end))
        return out

    def held_from(self, start: int) -> list[int]:
        """Numbers of what is held from `start` on, in order."""
        return sorted(seq for seq in self.sealed if seq >= start) if start < self.end else []

    @property
    def lacking(self) -> int:
        """Entries that we know of, wait for and do not know."""
        known = sum(seq >= self.start and self._covered_to(seq) is None for seq in self.sealed)
        for cover in self._covers:
            known += max(0, cover.last + 1 - max(cover.first, self.start))
        return max(0, self.newest - self.start - known)
