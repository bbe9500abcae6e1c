"""For which entries of a log its chapters stand."""

from __future__ import annotations

from bisect import bisect_right

from drslamd.slam.graph.measurements import Chapter

Span = tuple[int, int]
"""Entries first .. end - 1."""


class ReplacedEntries:
    """Of one log; they follow from which chapters are here, in any order of arrival."""

    def __init__(self) -> None:
        self._spans: list[Span] = []
        """In order; none touches the next one."""
        self._parts: set[int] = set()
        """Of chapters that are not wholly here."""
        self._open: dict[int, Chapter] = {}
        """Their last parts."""

    def take(self, seq: int, chapter: Chapter) -> tuple[Span, ...]:
        """A part of a chapter is entry `seq`: what is replaced now that was not yet."""
        if self.has(seq):
            return ()
        self._parts.add(seq)
        if chapter.parts:
            self._open[seq] = chapter
        found: list[Span] = []
        for last, said in list(self._open.items()):
            of = range(last + 1 - said.parts, last + 1)
            if all(part in self._parts for part in of):
                del self._open[last]
                self._parts.difference_update(of)
                found += said.replaces
        if found:
            self._spans = merged_spans([*self._spans, *found])
            # a chapter that another one stands for is not waited for
            self._open = {last: said for last, said in self._open.items() if not self.has(last)}
            self._parts = {part for part in self._parts if not self.has(part)}
        return tuple(found)

    def has(self, seq: int) -> bool:
        """Does a chapter stand for this entry?"""
        return self.end_of(seq) is not None

    def end_of(self, seq: int) -> int | None:
        """One past the last entry of the span in which this one is, None if it is in none."""
        at = bisect_right(self._spans, (seq, 1 << 62))
        if not at or self._spans[at - 1][1] <= seq:
            return None
        return self._spans[at - 1][1]

    def spans_from(self, seq: int) -> list[Span]:
        """What is replaced from this entry on."""
        return [(max(first, seq), end) for first, end in self._spans if end > seq]

    def forget_before(self, seq: int) -> None:
        """What lies before this entry is asked for no more."""
        self._spans = self.spans_from(seq)
        self._open = {last: said for last, said in self._open.items() if last >= seq}
        self._parts = {part for part in self._parts if part >= seq}


def merged_spans(spans: list[Span]) -> list[Span]:
    """The same entries in order, in as few spans as there can be."""
    out: list[Span] = []
    for first, end in sorted(spans):
        if out and first <= out[-1][1]:
            out[-1] = out[-1][0], max(end, out[-1][1])
        else:
            out.append((first, end))
    return out
