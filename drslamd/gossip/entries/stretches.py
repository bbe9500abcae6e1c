"""What a peer holds of logs beyond their first gaps, in few bytes of its status.

Of each log in turn how many stretches follow, then of each how many entries lie between the last
one and it, and how many it has: numbers of seven bits in a byte, the lowest first, of which the
eighth says that more follow.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from drslamd.gossip.message_types import LogState

MOST_BITS = 35


def packed(states: Sequence[LogState]) -> tuple[list[LogState], bytes]:
    """The first row of each log, and what the other rows say.

    Raises:
        ValueError: they do not follow each other.
    """
    rows: dict[tuple[int, int], list[LogState]] = {}
    for state in states:
        rows.setdefault((state.id, state.epoch), []).append(state)
    first = [of[0] for of in rows.values()]
    return first, b"".join(map(_said, rows.values()))


def _said(rows: Sequence[LogState]) -> bytes:
    numbers, end = [len(rows) - 1], rows[0].complete
    for row in rows[1:]:
        numbers += [row.first - end, row.complete - row.first]
        end = row.complete
    return b"".join(map(_coded, numbers))


def _coded(number: int) -> bytes:
    if number < 0:
        raise ValueError("stretches of a log out of order")
    out = bytearray()
    while number >> 7:
        out.append(number & 127 | 128)
        number >>= 7
    return bytes([*out, number])


def size(rows: Sequence[LogState]) -> int:
    """Bytes of all that is said of one log beyond its first row."""
    return len(_said(rows))


def unpacked(first: Sequence[LogState], data: bytes) -> tuple[LogState, ...]:
    """All rows again, those of one log side by side.

    Raises:
        ValueError: no status has such bytes.
    """
    if len({(row.id, row.epoch) for row in first}) < len(first):
        raise ValueError("log that is named twice")
    out: list[LogState] = []
    numbers = _numbers(data)
    for row in first:
        out.append(row)
        end = row.complete
        for _ in range(_next(numbers)):
            gap, length = _next(numbers), _next(numbers)
            if not gap or not length or end + gap + length > row.newest:
                raise ValueError("stretch of a log that is none")
            end += gap + length
            out.append(LogState(row.id, row.epoch, end - length, end, row.newest))
    if next(numbers, None) is not None:
        raise ValueError("stretches of no log")
    return tuple(out)


def _next(numbers: Iterator[int]) -> int:
    for number in numbers:
        return number
    raise ValueError("stretches that end too soon")


def _numbers(data: Iterable[int]) -> Iterator[int]:
    number = shift = 0
    for byte in data:
        number |= (byte & 127) << shift
        shift += 7
        if shift > MOST_BITS or (shift > 7 and not byte):
            raise ValueError("number that nobody says so")
        if byte < 128:
            yield number
            number = shift = 0
    if shift:
        raise ValueError("stretches that end too soon")
