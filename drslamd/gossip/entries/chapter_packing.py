"""A chapter as few bytes: a head, peers, models, then columns of whole numbers (`number_tables`).

What a robot says from second to second is alike, so a minute has an eighth of the bytes of its
entries: about five bytes a keyframe and four a range, most of it noise. What follows from something
else is said as the difference: the other sample from ours, the entry from the time. Whatever could
not have been packed is refused.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, TypeVar

import numpy as np

from drslamd import lcmtypes
from drslamd.conventions import GRID_HZ, Chain
from drslamd.gossip.bounds import bounded
from drslamd.gossip.entries import number_tables
from drslamd.gossip.entries.measurement_codecs import (
    filled_closure,
    filled_range,
    read_closure,
    read_keyframe,
    read_model,
    read_peer,
    read_range,
    said_peer,
    traits_of,
)
from drslamd.gossip.entries.number_tables import Shape, Table
from drslamd.slam.graph.chapters.books import PER_ENTRY
from drslamd.slam.graph.measurements import (
    Chapter,
    ClosureMeasurement,
    Placed,
    RangeMeasurement,
)
from drslamd.slam.robot_model import BY_GYRO
from drslamd.slam.se2 import Index

Item = TypeVar("Item", RangeMeasurement, ClosureMeasurement)
MOST_LAG = 1 << 15
"""Entries from the first that a chapter says again to its last part: 4,096 that are 45 minutes old
or older, of a robot that makes five a second."""
MOST_PARTS = 127
MOST_SPANS = 64
"""Stretches of entries for which a chapter stands: between them lie chapters for which it does not,
a few for each hour."""
SHORT = 2**15 - 1
"""Of what has 16 bits in an entry."""
_HEAD = struct.Struct(">bBi3H")
"""Parts, spans, the first entry that is spoken of, then how many peers, models and keyframes."""
_SPAN = struct.Struct(">2H")
"""Entries since the end of the last span, and its length."""
_PEER = struct.Struct(">hq2H")
"""Robot, epoch, how many ranges and closures."""
_MODEL = struct.Struct(">ib")
"""Entry and number of traits, which follow."""
_COLUMNS = _KEYFRAME, _RANGE, _CLOSURE = 5, 12, 19
"""Of each."""


def packed(chapter: Chapter) -> bytes:
    """The bytes of a chapter."""
    ranged = Counter(item.peer for _, item in chapter.ranges)
    seen = Counter(item.peer for _, item in chapter.closures)
    peers = sorted(ranged.keys() | seen.keys())
    keyframes = [[k.n, k.segment, k.x, k.y, k.theta] for k in chapter.keyframes]
    first = min(_spoken_of(chapter), default=0)
    ranges = []
    for place, item in chapter.ranges:
        r = filled_range(item, 0)
        ends = [*r.qa, *r.qb, r.range, r.sigma, *r.turn]
        ranges.append([*_when(place, r, first), *ends])
    closures = []
    for place, closure in chapter.closures:
        c = filled_closure(closure, 0)
        doubt = np.array(c.covariance, dtype="<f4").view("<i4").tolist()
        ends = [c.number, c.kept, c.x, c.y, c.theta, *c.corrected, *doubt]
        closures.append([*_when(place, c, first), *ends])
    counts = map(len, (peers, chapter.models, keyframes))
    out = [_HEAD.pack(chapter.parts, len(chapter.replaces), first, *counts)]
    ends = [first, *(end for _, end in chapter.replaces)]
    out += [_SPAN.pack(a - end, b - a) for end, (a, b) in zip(ends, chapter.replaces, strict=False)]
    out += [_PEER.pack(*said_peer(peer), ranged[peer], seen[peer]) for peer in peers]
    out += [_model(seq, traits_of(model)) for seq, model in chapter.models]
    tables = [
        _table(keyframes, _KEYFRAME, [len(keyframes)]),
        _table(ranges, _RANGE, [ranged[peer] for peer in peers]),
        _table(closures, _CLOSURE, [seen[peer] for peer in peers]),
    ]
    return b"".join([*out, number_tables.packed(tables)])


def _spoken_of(chapter: Chapter) -> set[int]:
    """Entries of which a chapter speaks, the first ones of its spans among them."""
    places = [place for place, _ in (*chapter.ranges, *chapter.closures)]
    seqs = [*(seq for seq, _ in chapter.models), *(first for first, _ in chapter.replaces)]
    return {*seqs, *(place // PER_ENTRY for place in places)}


def _model(seq: int, traits: Sequence[float]) -> bytes:
    return _MODEL.pack(seq, len(traits)) + struct.pack(f">{len(traits)}f", *traits)


def _when(place: int, item: Any, first: int) -> list[int]:
    """Of a measurement: entry, place in there, both samples; what follows from others is near 0."""
    seq, at = divmod(place, PER_ENTRY)
    return [seq - first - item.a_n // GRID_HZ, at, item.a_n, item.b_n - item.a_n]


def _table(rows: Sequence[Sequence[int]], columns: int, groups: Iterable[int]) -> Table:
    said = np.array(rows, dtype=np.int64).reshape(-1, columns)
    return Table(said, tuple(count for count in groups if count))


def numbers_in(chapter: Chapter) -> int:
    """How many a chapter holds in its tables."""
    counts = len(chapter.keyframes), len(chapter.ranges), len(chapter.closures)
    return sum(n * columns for n, columns in zip(counts, _COLUMNS, strict=True))


class _Reader:
    """Takes bytes from the front.

    Raises:
        ValueError: there are not as many.
    """

    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    def take(self, size: int) -> bytes:
        if self._at + size > len(self._data):
            raise ValueError("chapter that ends too soon")
        self._at += size
        return self._data[self._at - size : self._at]

    def structs(self, kind: struct.Struct, count: int) -> list[tuple[Any, ...]]:
        return [kind.unpack(self.take(kind.size)) for _ in range(count)]

    def model(self) -> tuple[int, tuple[float, ...]]:
        """An entry, and the traits that it tells."""
        seq, count = _MODEL.unpack(self.take(_MODEL.size))
        traits = struct.Struct(f">{bounded('number of traits', count, 0, BY_GYRO)}f")
        return seq, traits.unpack(self.take(traits.size))

    def rest(self) -> bytes:
        return self._data[self._at :]


def unpacked(data: bytes, seq: int) -> Chapter:
    """The chapter that entry `seq` of a log is.

    Raises:
        ValueError, IndexError: no chapter has such bytes.
    """
    reader = _Reader(data)
    parts, n_spans, first, n_peers, n_models, n_keyframes = _HEAD.unpack(reader.take(_HEAD.size))
    bounded("number of parts", parts, 0, MOST_PARTS)
    bounded("number of spans", n_spans, 0, MOST_SPANS)
    replaces = _replaces(first, reader.structs(_SPAN, n_spans))
    if (parts > 0) != (n_spans > 0) or (parts and replaces[-1][1] > seq + 1 - parts):
        raise ValueError("chapter that stands for what it cannot stand for")
    peers, ranged, seen = list[Chain](), list[int](), list[int]()
    for robot, epoch, n_ranges, n_closures in reader.structs(_PEER, n_peers):
        peers.append(read_peer(SimpleNamespace(id=robot, epoch=epoch)))
        ranged.append(n_ranges)
        seen.append(n_closures)
        if not n_ranges and not n_closures:
            raise ValueError("peer of whom nothing is said")
    if any(before >= after for before, after in pairwise(peers)):
        raise ValueError("peers out of order")
    models = [
        (bounded("entry", at, first, seq), read_model(traits))
        for at, traits in (reader.model() for _ in range(n_models))
    ]
    groups = ([n_keyframes] if n_keyframes else []), ranged, seen
    shapes = [
        Shape(columns, tuple(count for count in counts if count))
        for columns, counts in zip(_COLUMNS, groups, strict=True)
    ]
    of_keyframes, of_ranges, of_closures = number_tables.unpacked(reader.rest(), shapes)
    names = lcmtypes.keyframe_t.__slots__
    keyframes = [
        read_keyframe(SimpleNamespace(**dict(zip(names, row, strict=True))))
        for row in of_keyframes.tolist()
    ]
    span = range(first, seq + 1)
    ranges = list(_placed(of_ranges, _each_of(peers, ranged), span, _range))
    closures = list(_placed(of_closures, _each_of(peers, seen), span, _closure))
    chapter = Chapter(
        parts, replaces, tuple(models), tuple(keyframes), tuple(ranges), tuple(closures)
    )
    spoken_of = _spoken_of(chapter)
    if first != min(spoken_of, default=0):
        raise ValueError("first entry of a chapter that is not its first")
    if spoken_of:
        bounded("first entry of a chapter", first, max(0, seq - MOST_LAG), seq)
    return chapter


def _replaces(first: int, rows: Iterable[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    """Spans of entries in order, none of which touches the next one."""
    out: list[tuple[int, int]] = []
    end = first
    for gap, length in rows:
        if not length or (out and not gap):
            raise ValueError("spans that touch or are empty")
        out.append((end + gap, end + gap + length))
        end = out[-1][1]
    return tuple(out)


def _each_of(peers: list[Chain], counts: list[int]) -> list[Chain]:
    return [peer for peer, count in zip(peers, counts, strict=True) for _ in range(count)]


def _placed(
    rows: Index, peers: list[Chain], span: range, read: Callable[[list[int], Chain], Item]
) -> Iterator[Placed[Item]]:
    """Measurements with their places, which ascend with each peer."""
    before: tuple[Chain, int] | None = None
    for (of_seq, at, a_n, to_b, *ends), peer in zip(rows.tolist(), peers, strict=True):
        seq = of_seq + span.start + a_n // GRID_HZ
        bounded("entry", seq, span.start, span.stop - 1)
        place = seq * PER_ENTRY + bounded("place in an entry", at, 0, PER_ENTRY - 1)
        if before is not None and before >= (peer, place):
            raise ValueError("measurements out of order")
        before = peer, place
        yield place, read([a_n, a_n + to_b, *ends], peer)


def _fits_short(values: Iterable[int]) -> bool:
    return all(-SHORT - 1 <= value <= SHORT for value in values)


def _range(row: list[int], peer: Chain) -> RangeMeasurement:
    a_n, b_n, qa0, qa1, qb0, qb1, metres, sigma, turn_a, turn_b = row
    if not _fits_short((qa0, qa1, qb0, qb1, sigma, turn_a, turn_b)):
        raise ValueError("range beyond its 16 bits")
    return read_range(
        SimpleNamespace(
            a_n=a_n,
            peer=0,
            b_n=b_n,
            qa=(qa0, qa1),
            qb=(qb0, qb1),
            range=metres,
            sigma=sigma,
            turn=(turn_a, turn_b),
        ),
        [peer],
    )


def _closure(row: list[int], peer: Chain) -> ClosureMeasurement:
    a_n, b_n, number, kept, x, y, theta, *rest = row
    return read_closure(
        SimpleNamespace(
            number=number,
            kept=kept,
            a_n=a_n,
            peer=0,
            b_n=b_n,
            x=x,
            y=y,
            theta=theta,
            covariance=np.array(rest[4:], dtype="<i4").view("<f4").tolist(),
            corrected=rest[:4],
        ),
        [peer],
    )
