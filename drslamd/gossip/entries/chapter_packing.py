"""A chapter as few bytes: columns of whole numbers, of which only the differences are kept.

What a robot says from second to second is alike, so the columns of a minute deflate to a sixth of
the entries: about six bytes a keyframe and nine a range.

A head (`_HEAD`), peers, models, then all columns: of each number the difference from the one above
it, the sign in the lowest bit, the four bytes of all rows one plane after the other; all of it
deflated. Whatever could not have been packed is refused.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Sequence
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np

from drslamd import lcmtypes
from drslamd.conventions import Chain
from drslamd.gossip.bounds import bounded
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
from drslamd.slam.graph.chapters import COUNTS_FOR, PER_ENTRY
from drslamd.slam.graph.measurements import Chapter
from drslamd.slam.robot_model import BY_GYRO
from drslamd.slam.se2 import Index

MAX_UNPACKED = 1 << 16
"""Bytes; what fits one datagram has far less unless it was made to swell."""
LONGEST_SPAN = 256
"""Entries from the first that a chapter says again to its last part: 64, and its parts."""
MOST_PARTS = 127
SHORT = 2**15 - 1
"""Of what has 16 bits in an entry."""
_HEAD = struct.Struct(">b3bi5H")
"""Layer, parts, first, then how many peers, models, keyframes, ranges and closures."""
_PEER = struct.Struct(">hq")
_MODEL = struct.Struct(">ib")
"""Entry and number of traits, which follow."""
_KEYFRAME, _RANGE, _CLOSURE = 5, 12, 19
"""Columns of each."""


def packed(chapter: Chapter) -> bytes:
    """The bytes of a chapter."""
    named = {item.peer for _, item in chapter.ranges}
    peers = sorted(named | {item.peer for _, item in chapter.closures})
    number = {peer: k for k, peer in enumerate(peers)}
    begin = chapter.first * PER_ENTRY
    keyframes = [[k.n, k.segment, k.x, k.y, k.theta] for k in chapter.keyframes]
    ranges = []
    for place, item in chapter.ranges:
        r = filled_range(item, number[item.peer])
        ends = [*r.qa, *r.qb, r.range, r.sigma, *r.turn]
        ranges.append([place - begin, r.peer, r.a_n, r.b_n, *ends])
    closures = []
    for place, seen in chapter.closures:
        c = filled_closure(seen, number[seen.peer])
        doubt = np.array(c.covariance, dtype="<f4").view("<i4").tolist()
        ends = [c.number, c.kept, c.x, c.y, c.theta, *c.corrected]
        closures.append([place - begin, c.peer, c.a_n, c.b_n, *ends, *doubt])
    counts = map(len, (peers, chapter.models, keyframes, ranges, closures))
    out = [_HEAD.pack(chapter.layer, *chapter.parts, chapter.first, *counts)]
    out += [_PEER.pack(*said_peer(peer)) for peer in peers]
    out += [_model(seq, traits_of(model)) for seq, model in chapter.models]
    out += [_planes(keyframes), _planes(ranges), _planes(closures)]
    return zlib.compress(b"".join(out), 9)


def _model(seq: int, traits: Sequence[float]) -> bytes:
    return _MODEL.pack(seq, len(traits)) + struct.pack(f">{len(traits)}f", *traits)


def _planes(rows: Sequence[Sequence[int]]) -> bytes:
    if not rows:
        return b""
    table = np.array(rows, dtype=np.int64)
    step = np.diff(table, axis=0, prepend=0).astype("<u4")
    signed = step.view("<i4")
    folded = (step << np.uint32(1)) ^ (signed >> 31).view("<u4")
    planes = np.ascontiguousarray(folded.T).view(np.uint8).reshape(table.shape[1], -1, 4)
    return np.ascontiguousarray(planes.transpose(0, 2, 1)).tobytes()


def _rows(planes: bytes, count: int, columns: int) -> Index:
    """What `_planes` was made of, (count, columns) within 32 bits."""
    bytes_of = np.frombuffer(planes, np.uint8).reshape(columns, 4, count)
    folded = np.ascontiguousarray(bytes_of.transpose(0, 2, 1)).view("<u4")[..., 0]
    step = (folded >> np.uint32(1)) ^ (np.uint32(0) - (folded & np.uint32(1)))
    table = np.cumsum(step, axis=1, dtype=np.uint32).view(np.int32)
    return np.asarray(table.T.astype(np.int64))


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

    def rows(self, count: int, columns: int) -> list[list[int]]:
        rows: list[list[int]] = _rows(self.take(4 * count * columns), count, columns).tolist()
        return rows

    @property
    def is_at_end(self) -> bool:
        return self._at == len(self._data)


def unpacked(data: bytes, seq: int) -> Chapter:
    """The chapter that entry `seq` of a log is.

    Raises:
        ValueError, IndexError: no chapter has such bytes.
    """
    reader = _Reader(_inflated(data))
    layer, two, one, lasting, first, *counts = _HEAD.unpack(reader.take(_HEAD.size))
    n_peers, n_models, n_keyframes, n_ranges, n_closures = counts
    parts = two, one, lasting
    bounded("layer", layer, 0, len(COUNTS_FOR) - 1)
    bounded("first entry of a chapter", first, max(0, seq - LONGEST_SPAN), seq)
    if any(parts) and (layer or min(parts) < 0 or not lasting or sum(parts) > seq - first):
        raise ValueError("parts that a chapter cannot have")
    peers = [
        read_peer(SimpleNamespace(id=robot, epoch=epoch))
        for robot, epoch in reader.structs(_PEER, n_peers)
    ]
    models = [
        (bounded("entry", at, first, seq), read_model(traits))
        for at, traits in (reader.model() for _ in range(n_models))
    ]
    names = lcmtypes.keyframe_t.__slots__
    keyframes = [
        read_keyframe(SimpleNamespace(**dict(zip(names, row, strict=True))))
        for row in reader.rows(n_keyframes, _KEYFRAME)
    ]
    start, end = first * PER_ENTRY, (seq + 1) * PER_ENTRY

    def place_of(row: list[int]) -> int:
        return bounded("place in the log", start + row[0], start, end - 1)

    ranges = [(place_of(row), _range(row, peers)) for row in reader.rows(n_ranges, _RANGE)]
    closures = [(place_of(row), _closure(row, peers)) for row in reader.rows(n_closures, _CLOSURE)]
    said = {item.peer for _, item in [*ranges, *closures]}
    if not reader.is_at_end or peers != sorted(said):
        raise ValueError("bytes or peers left over")
    for placed in (ranges, closures):
        order = [(item.peer, place) for place, item in placed]
        if any(before >= after for before, after in pairwise(order)):
            raise ValueError("measurements out of order")
    return Chapter(
        layer, first, parts, tuple(models), tuple(keyframes), tuple(ranges), tuple(closures)
    )


def _inflated(data: bytes) -> bytes:
    inflate = zlib.decompressobj()
    try:
        out = inflate.decompress(data, MAX_UNPACKED)
    except zlib.error as error:
        raise ValueError(str(error)) from None
    if not inflate.eof or inflate.unused_data:
        raise ValueError("chapter that does not end where its bytes do")
    return out


def _fits_short(values: Iterable[int]) -> bool:
    return all(-SHORT - 1 <= value <= SHORT for value in values)


def _range(row: list[int], peers: list[Chain]) -> Any:
    _, peer, a_n, b_n, qa0, qa1, qb0, qb1, metres, sigma, turn_a, turn_b = row
    if not _fits_short((qa0, qa1, qb0, qb1, sigma, turn_a, turn_b)):
        raise ValueError("range beyond its 16 bits")
    return read_range(
        SimpleNamespace(
            a_n=a_n,
            peer=peer,
            b_n=b_n,
            qa=(qa0, qa1),
            qb=(qb0, qb1),
            range=metres,
            sigma=sigma,
            turn=(turn_a, turn_b),
        ),
        peers,
    )


def _closure(row: list[int], peers: list[Chain]) -> Any:
    _, peer, a_n, b_n, number, kept, x, y, theta, *rest = row
    return read_closure(
        SimpleNamespace(
            number=number,
            kept=kept,
            a_n=a_n,
            peer=peer,
            b_n=b_n,
            x=x,
            y=y,
            theta=theta,
            covariance=np.array(rest[4:], dtype="<i4").view("<f4").tolist(),
            corrected=rest[:4],
        ),
        peers,
    )
