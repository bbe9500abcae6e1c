"""Tables of whole numbers in few bits.

Of each column either the numbers themselves or the steps from row to row are near one number: their
middle and their common divisor are said once, then how far each is from there, in an
exponential-Golomb code (Teuhola 1978) whose size is the column's own. A column that steps evenly
costs nothing but its head: its kind and its middle.

Rows come in groups, of one peer each, and steps do not go from one group to the next: the first
numbers of the groups are said as steps of their own.

Bits, most significant first: of all columns their kinds, then their middles, of those that do not
step evenly their divisors (how often two divides them, what is left, and what middles have beyond a
multiple), then what they hold; of each of these six, the lengths of all numbers come before their
digits, so that all are read at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.se2 import Array, Index

Bits = NDArray[np.uint8]

MAX_NUMBERS = 1 << 14
"""In all tables of one message; columns that step evenly could hold any number of them."""
LARGEST = 30
"""Size of a code."""
EVEN = LARGEST + 1
"""In its place: nothing follows, all are the middle."""
MOST_BITS = 32
KIND_SIZE = 2
"""Code of the first number of a head: it is small where a column steps evenly."""
WIDTHS = np.array([0, 8, 16, 24])
"""Codes of middles: that in which it has the fewest bits."""


class Table(NamedTuple):
    """Rows (n, columns) within 32 bits, and how many each group has."""

    rows: Index
    groups: tuple[int, ...]


class Shape(NamedTuple):
    """Of a table that is to be read."""

    columns: int
    groups: tuple[int, ...]


class _Head(NamedTuple):
    """How a column is said: itself or its steps, the size of the code, middle and divisor."""

    is_steps: bool
    size: int
    middle: int
    divisor: int


def _wrapped(values: Array | Index) -> Index:
    """The same modulo 2^32, signed."""
    return np.asarray(values, np.int64).astype(np.int32).astype(np.int64)


def _folded(values: Index | int) -> Index:
    """Near 0 are small numbers: 0, -1, 1, -2 ... as 0, 1, 2, 3 ..."""
    signed = np.asarray(values, np.int64)
    return np.asarray(np.where(signed < 0, -2 * signed - 1, 2 * signed))


def _unfolded(values: Index) -> Index:
    return np.asarray(np.where(values % 2, -(values // 2) - 1, values // 2))


def _bit_length(values: Index) -> Index:
    # exact: what is below 2^53 has all its digits in a float
    return np.asarray(np.frexp(values.astype(float))[1].astype(np.int64))


def _starts(groups: Sequence[int]) -> Index:
    """Rows at which groups begin."""
    return np.asarray(np.cumsum(groups, dtype=np.int64) - groups)


def _cost(folded: Index) -> tuple[int, int]:
    """Bits of the best code for these numbers, and its size."""
    if not folded.any():
        return 0, EVEN
    # the best one is near the length of a usual number
    usual = int(folded.mean()).bit_length()
    sizes = np.arange(max(0, usual - 3), min(LARGEST, usual + 1) + 1)
    zeros = _bit_length(folded[:, None] + (1 << sizes)) - 1 - sizes
    bits = (2 * zeros + 1 + sizes).sum(axis=0)
    best = int(np.argmin(bits))
    return int(bits[best]), int(sizes[best])


def _bits_of(numbers: Index, sizes: Index) -> Index:
    """How many bits numbers have in codes of these sizes."""
    return np.asarray(2 * (_bit_length(numbers + (1 << sizes)) - 1) - sizes + 1)


def _near(values: Index) -> tuple[int, int, Index]:
    """Middle, divisor, and how far off the middle these numbers are, folded."""
    if not len(values):
        return 0, 1, values
    middle = int(np.sort(values)[len(values) // 2])
    off = _wrapped(values - middle)
    divisor = max(1, int(np.gcd.reduce(off)))
    return middle, divisor, _folded(off // divisor)


def _firsts(values: Index, starts: Index) -> Index:
    """The first number of each group, as steps."""
    firsts = values[starts]
    firsts[1:] -= values[starts[:-1]]
    return _folded(_wrapped(firsts))


def _column(values: Index, starts: Index) -> tuple[_Head, list[tuple[Index, int]]]:
    """The head of a column, and what it holds: numbers and the size of their code."""
    if (values == values[0]).all():
        return _Head(False, EVEN, int(values[0]), 1), []
    middle, divisor, off = _near(values)
    bits, size = _cost(off)
    plain = _Head(False, size, middle, divisor)
    step = values.copy()
    step[1:] -= values[:-1]
    middle, divisor, off_step = _near(_wrapped(np.delete(step, starts)))
    bits_of_steps, size = _cost(off_step)
    firsts = _firsts(values, starts)
    if bits <= bits_of_steps + int((2 * _bit_length(firsts + 1) - 1).sum()):
        return plain, [(off, plain.size)]
    return _Head(True, size, middle, divisor), [(firsts, 0), (off_step, size)]


def packed(tables: Sequence[Table]) -> bytes:
    """The bits of tables, filled up to whole bytes."""
    heads, numbers, sizes = list[_Head](), list[Index](), list[Index]()
    for table in tables:
        starts = _starts(table.groups)
        for values in table.rows.T if len(table.rows) else ():
            head, parts = _column(values, starts)
            heads.append(head)
            for part, size in parts:
                if size != EVEN:
                    numbers.append(part)
                    sizes.append(np.full(len(part), size))
    empty = [np.zeros(0, np.int64)]
    bits = _code_of_heads(heads)
    bits += _code(np.concatenate(numbers or empty), np.concatenate(sizes or empty))
    return np.packbits(np.concatenate(bits)).tobytes()


def _code_of_heads(heads: list[_Head]) -> list[Bits]:
    steps, sizes, middles, divisors = np.array(heads, np.int64).reshape(-1, 4).T
    uneven = np.flatnonzero(sizes != EVEN)
    divisor = divisors[uneven]
    twos = _bit_length(divisor & -divisor) - 1
    beyond = middles[uneven] % divisor
    middles[uneven] //= divisor
    middles = _folded(middles)
    width = np.argmin(_bits_of(middles[:, None], WIDTHS), axis=1)
    kinds = 2 * (len(WIDTHS) * (EVEN - sizes) + width) + steps
    plain = np.zeros(len(uneven), np.int64)
    return [
        *_code(kinds, np.full(len(heads), KIND_SIZE)),
        *_code(middles, WIDTHS[width]),
        *_code(twos, plain),
        *_code((divisor >> twos) // 2, plain),
        *_code(beyond, plain),
    ]


def _code(numbers: Index, sizes: Index) -> tuple[Bits, Bits]:
    """Bits of numbers: how long they are, and their digits."""
    raised = numbers + (1 << sizes)
    digits = _bit_length(raised) - 1
    ends = np.cumsum(digits - sizes + 1)
    lengths = np.zeros(int(ends[-1]) if len(ends) else 0, np.uint8)
    lengths[ends - 1] = 1
    below = np.repeat(np.cumsum(digits), digits) - 1 - np.arange(digits.sum())
    return lengths, np.asarray(np.repeat(raised, digits) >> below & 1, np.uint8)


class _Bits:
    """Reads numbers from the front.

    Raises:
        ValueError: there are not as many, or one has more than 32 bits.
    """

    def __init__(self, data: bytes) -> None:
        self._bits = np.unpackbits(np.frombuffer(data, np.uint8))
        self._bytes = np.frombuffer(data + bytes(8), np.uint8).astype(np.int64)
        self._at = 0

    def numbers(self, sizes: Index) -> Index:
        ends = np.flatnonzero(self._bits[self._at :])[: len(sizes)]
        if len(ends) < len(sizes):
            raise ValueError("table that ends too soon")
        digits = np.diff(ends, prepend=-1) - 1 + sizes
        if (digits > MOST_BITS).any():
            raise ValueError("number of more than 32 bits")
        begin = self._at + (int(ends[-1]) + 1 if len(ends) else 0)
        at = begin + np.cumsum(digits) - digits
        self._at = begin + int(digits.sum())
        if self._at > len(self._bits):
            raise ValueError("table that ends too soon")
        # five bytes hold 32 bits wherever they begin
        window = np.zeros(len(at), np.int64)
        for k in range(5):
            window = window << 8 | self._bytes[(at >> 3) + k]
        low = window >> (40 - (at & 7) - digits) & ((1 << digits) - 1)
        return np.asarray(low + (1 << digits) - (1 << sizes))

    @property
    def is_at_end(self) -> bool:
        """Is nothing left but what fills the last byte?"""
        rest = self._bits[self._at :]
        return len(rest) < 8 and not rest.any()


def unpacked(data: bytes, shapes: Sequence[Shape]) -> list[Index]:
    """Rows of tables of these shapes, int64 within 32 bits.

    Raises:
        ValueError: `packed` makes no such bytes.
    """
    if sum(shape.columns * sum(shape.groups) for shape in shapes) > MAX_NUMBERS:
        raise ValueError(f"more than {MAX_NUMBERS} numbers")
    bits = _Bits(data)
    said = [shape for shape in shapes if sum(shape.groups)]
    heads = _heads(bits, sum(shape.columns for shape in said))
    parts = [_sizes(head, shape) for head, shape in zip(heads, _each(said), strict=True)]
    flat = [part for column in parts for part in column]
    numbers = bits.numbers(np.concatenate([*flat, np.zeros(0, np.int64)]))
    if not bits.is_at_end:
        raise ValueError("bits left over")
    cut = iter(np.split(numbers, np.cumsum([len(part) for part in flat])))
    columns = iter(
        _values(head, shape, [next(cut) for _ in sizes_of])
        for head, shape, sizes_of in zip(heads, _each(said), parts, strict=True)
    )
    return [
        np.stack([next(columns) for _ in range(shape.columns)], axis=1)
        if sum(shape.groups)
        else np.zeros((0, shape.columns), np.int64)
        for shape in shapes
    ]


def _each(shapes: Sequence[Shape]) -> list[Shape]:
    """The shape of each column's table."""
    return [shape for shape in shapes for _ in range(shape.columns)]


def _heads(bits: _Bits, columns: int) -> list[_Head]:
    kinds = bits.numbers(np.full(columns, KIND_SIZE))
    sizes = EVEN - kinds // (2 * len(WIDTHS))
    if (sizes < 0).any():
        raise ValueError("column that is said in no known way")
    middles = _unfolded(bits.numbers(WIDTHS[kinds // 2 % len(WIDTHS)]))
    uneven, divisors = np.flatnonzero(sizes != EVEN), np.ones(columns, np.int64)
    plain = np.zeros(len(uneven), np.int64)
    twos, odd, beyond = (bits.numbers(plain) for _ in range(3))
    if (twos >= MOST_BITS).any() or (odd >= 1 << MOST_BITS - 1 - twos).any():
        raise ValueError("divisor of more than 32 bits")
    divisors[uneven] = 2 * odd + 1 << twos
    if (beyond >= divisors[uneven]).any():
        raise ValueError("middle beyond its divisor")
    middles[uneven] = _wrapped(middles[uneven] * divisors[uneven] + beyond)
    rows = zip(kinds & 1, sizes, middles, divisors, strict=True)
    return [_Head(bool(steps), *(int(number) for number in rest)) for steps, *rest in rows]


def _sizes(head: _Head, shape: Shape) -> list[Index]:
    """The code of each number that a column holds."""
    count = sum(shape.groups)
    firsts = len(shape.groups) if head.is_steps else 0
    rest = 0 if head.size == EVEN else count - firsts
    return [np.zeros(firsts, np.int64), np.full(rest, head.size, np.int64)]


def _values(head: _Head, shape: Shape, numbers: list[Index]) -> Index:
    firsts, off = numbers
    count = sum(shape.groups) - len(firsts)
    if head.size == EVEN:
        values = np.full(count, head.middle)
    else:
        # (products of two numbers of 32 bits may wrap in 64, which leaves their last 32 bits alone)
        values = _wrapped(_unfolded(off) * head.divisor + head.middle)
    if not head.is_steps:
        return _wrapped(values)
    starts = _starts(shape.groups)
    steps = np.zeros(sum(shape.groups), np.int64)
    is_first = np.zeros(len(steps), bool)
    is_first[starts] = True
    steps[~is_first] = values
    total = np.cumsum(steps)
    group = np.cumsum(is_first) - 1
    first = np.cumsum(_unfolded(firsts))
    return _wrapped(total - total[starts][group] + first[group])
