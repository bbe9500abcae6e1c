"""Chapters: what a robot says again of its older log entries, together and with less.

A log is said twice. Its entries come one by one; of 64 of them the owner then makes a chapter, in
three layers: what lasts, what counts for forty minutes, and what counts for ten. All keyframes
last, and whatever was said of a closure after its first word; of ranges and closures as many as the
graph still uses when it is thinned (`thinning`). A layer that no longer counts is not kept, not
sent and not asked for, and a graph drops what only that layer said.

How old a layer is, is counted in entries up to the owner's latest chapter, so that it follows from
the log alone: who holds the same chapters drops the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from drslamd.conventions import GRID_HZ, Chain
from drslamd.slam.graph.measurements import (
    Chapter,
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    Placed,
    RangeMeasurement,
)
from drslamd.slam.robot_model import RobotModel

PER_ENTRY = 4_096
"""Above the number of measurements that any one entry of a log can hold."""
SPAN = 256
"""Entries of which one chapter is made: four minutes. Shorter ones have more bytes: each message
has a hundred of its own, and each column of numbers two."""
COUNTS_FOR = (1 << 31, 2_688, 704)
"""Entries after which each layer counts no more: cells of time are 256 s long after forty minutes,
16 s after ten (`thinning.time_cells`), and there may be a little more than one entry a second."""
RAW = len(COUNTS_FOR) - 1
"""Layer of what no chapter has said yet."""
MINUTE, QUARTER = 64, 16
"""Entries of which few last, and of which few more count for forty minutes."""
FEW_RANGES = (1, 4)
"""Of one pair: so many of a minute last, so many more of a quarter of it count for forty
minutes."""
FEW_CLOSURES = (1, 2)
"""The same of closures."""
GOLDEN = 2_654_435_769
"""2^32 over the golden ratio: multiples of it, modulo 2^32, lie evenly however many are taken."""

Item = TypeVar("Item", RangeMeasurement, ClosureMeasurement)
Said = TypeVar("Said")


def counts(layer: int, seq: int, latest: int) -> bool:
    """Does what a layer said in or of entry `seq` still count?

    Args:
        latest: number of the owner's latest chapter.
    """
    return latest - seq < COUNTS_FOR[layer]


@dataclass
class Layer:
    """What one layer of a chapter says."""

    models: list[tuple[int, RobotModel]] = field(default_factory=list)
    keyframes: list[Keyframe] = field(default_factory=list)
    ranges: list[Placed[RangeMeasurement]] = field(default_factory=list)
    closures: list[Placed[ClosureMeasurement]] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.models or self.keyframes or self.ranges or self.closures)

    def halves(self) -> tuple[Layer, Layer]:
        """The same in two parts, each smaller."""
        one, other = Layer(), Layer()
        one.models, other.models = _cut(self.models)
        one.keyframes, other.keyframes = _cut(self.keyframes)
        one.ranges, other.ranges = _cut(self.ranges)
        one.closures, other.closures = _cut(self.closures)
        return one, other

    def __len__(self) -> int:
        parts = self.models, self.keyframes, self.ranges, self.closures
        return sum(len(part) for part in parts)


def _cut(items: list[Said]) -> tuple[list[Said], list[Said]]:
    middle = (len(items) + 1) // 2
    return items[:middle], items[middle:]


class Sorter:
    """Sorts what one robot said into layers.

    It remembers the highest closure number of each peer: closures are numbered as they are found,
    so a word of a lower one, or a withdrawal, changes an earlier word.
    """

    def __init__(self) -> None:
        self._told: dict[Chain, int] = {}

    def layers(self, entries: Sequence[GraphEntry]) -> tuple[Layer, Layer, Layer]:
        """What the layers of a chapter say of consecutive entries: lasting first."""
        out = Layer(), Layer(), Layer()
        out[0].models += [(entry.seq, entry.model) for entry in entries if entry.model][-1:]
        out[0].keyframes += [keyframe for entry in entries for keyframe in entry.keyframes]
        ranges: list[Placed[RangeMeasurement]] = []
        first_words: list[Placed[ClosureMeasurement]] = []
        for entry in entries:
            start = entry.seq * PER_ENTRY
            ranges += [(start + k, item) for k, item in enumerate(entry.ranges)]
            for k, seen in enumerate(entry.closures):
                highest = self._told.get(seen.peer, -1)
                self._told[seen.peer] = max(seen.number, highest)
                is_first = seen.kept and seen.number > highest
                (first_words if is_first else out[0].closures).append((start + k, seen))
        begin = entries[0].seq
        for layer, few in zip(out, _layered(ranges, FEW_RANGES, begin), strict=True):
            layer.ranges += few
        for layer, fewer in zip(out, _layered(first_words, FEW_CLOSURES, begin), strict=True):
            layer.closures += fewer
        return out


def _layered(
    items: list[Placed[Item]], few: tuple[int, int], begin: int
) -> list[list[Placed[Item]]]:
    """Items of a chapter that begins with entry `begin`, by the layer that says them."""

    def stretch(placed: Placed[Item], entries: int) -> tuple[Chain, int]:
        return placed[1].peer, (placed[0] // PER_ENTRY - begin) // entries

    ranked = sorted(items, key=_rank)
    lasting = _first_of_each(ranked, few[0], lambda placed: stretch(placed, MINUTE))
    taken = {place for place, _ in lasting}
    rest = [placed for placed in ranked if placed[0] not in taken]
    longer = _first_of_each(rest, few[1], lambda placed: stretch(placed, QUARTER))
    taken |= {place for place, _ in longer}
    return [lasting, longer, [placed for placed in rest if placed[0] not in taken]]


def _rank(placed: Placed[Item]) -> tuple[int, int, int]:
    """As `thinning.pair_view` ranks: what is doubted less first, then evenly over time."""
    place, item = placed
    doubt = int(np.frexp(item.sigma_m)[1]) if isinstance(item, RangeMeasurement) else 0
    return doubt, item.a_n // GRID_HZ * GOLDEN % 2**32, place


def _first_of_each(
    items: Iterable[Placed[Item]], most: int, group: Callable[[Placed[Item]], object]
) -> list[Placed[Item]]:
    found: dict[object, int] = {}
    out = []
    for placed in items:
        key = group(placed)
        found[key] = found.get(key, 0) + 1
        if found[key] <= most:
            out.append(placed)
    return out


def part(layer: Layer, number: int, first: int, parts: tuple[int, int, int]) -> Chapter:
    """One part of a chapter, in the order in which it is packed.

    Args:
        number: of the layer; first, parts: see `Chapter`.
    """

    def order(placed: Placed[Item]) -> tuple[Chain, int]:
        return placed[1].peer, placed[0]

    return Chapter(
        layer=number,
        first=first,
        parts=parts,
        models=tuple(layer.models),
        keyframes=tuple(layer.keyframes),
        ranges=tuple(sorted(layer.ranges, key=order)),
        closures=tuple(sorted(layer.closures, key=order)),
    )
