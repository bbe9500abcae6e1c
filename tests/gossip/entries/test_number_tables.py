"""Tables of numbers as bits: what is packed comes back, and even columns cost next to nothing."""

from __future__ import annotations

import random

import numpy as np
import pytest

from drslamd.gossip.entries.number_tables import MAX_NUMBERS, Shape, Table, packed, unpacked
from drslamd.slam.se2 import Index

LEAST, MOST = -(2**31), 2**31 - 1


def table(*rows: tuple[int, ...], groups: tuple[int, ...] | None = None) -> Table:
    return Table(np.array(rows, dtype=np.int64), groups or (len(rows),))


def back(*tables: Table) -> list[Index]:
    shapes = [Shape(t.rows.shape[1], t.groups) for t in tables]
    return unpacked(packed(tables), shapes)


@pytest.mark.parametrize(
    "said",
    [
        table((5,)),
        table((LEAST, MOST), (MOST, LEAST), (0, -1)),
        table((0, 3), (10, 3), (20, 3), (30, 4)),
        table((1,), (2,), (90,), (100,), (110,), (7,), groups=(2, 3, 1)),
        table((LEAST,), (MOST,), (LEAST,), (MOST,), groups=(1, 1, 2)),
        table(*((k * k * 40_000 - 2**31,) for k in range(300))),
    ],
)
def test_what_is_packed_comes_back(said: Table) -> None:
    (rows,) = back(said)
    assert rows.tolist() == said.rows.tolist()


def test_many_tables_of_chance_come_back_together() -> None:
    chance = random.Random(3)
    for _ in range(60):
        tables = []
        for _ in range(3):
            groups = tuple(chance.randrange(1, 9) for _ in range(chance.randrange(4)))
            wide = chance.choice([1, 3, 200, 2**16, 2**31])
            rows = [[chance.randrange(-wide, wide) for _ in range(4)] for _ in range(sum(groups))]
            tables.append(Table(np.array(rows, dtype=np.int64).reshape(-1, 4), groups))
        for said, found in zip(tables, back(*tables), strict=True):
            assert found.tolist() == said.rows.tolist()


def test_columns_that_stand_or_step_evenly_cost_a_few_bytes_however_long() -> None:
    even = table(*((7, 10 * k, -250 * (k % 50)) for k in range(1_000)), groups=(50,) * 20)
    # (a number of each group says where it begins)
    assert len(packed([even])) < 60


def test_a_common_divisor_is_said_once() -> None:
    chance = random.Random(1)
    steps = [chance.randrange(4_000) for _ in range(800)]
    fine, coarse = (table(*((scale * k,) for k in steps)) for scale in (1, 1_000))
    assert len(packed([coarse])) <= len(packed([fine])) + 3


def test_a_middle_costs_the_fewer_bits_the_coarser_it_is() -> None:
    """Numbers of 31 binary digits, of which the last 14 are as good as none."""
    chance = random.Random(2)
    steps = [chance.randrange(64) << 14 for _ in range(20)]
    coarse, fine = (table(*((2**30 + last + k,) for k in steps)) for last in (0, 8_191))
    # (one bit says that nothing is beyond, 25 say what is)
    assert len(packed([fine])) - len(packed([coarse])) == 3
    assert back(fine)[0].tolist() == fine.rows.tolist()
    # six bits each, a bit or two that say so; kind, middle of 17 bits and divisor
    assert len(packed([coarse])) <= (20 * 8 + 9 + 18 + 8 + 1) / 8


def test_columns_of_noughts_cost_three_bits_and_one() -> None:
    nothing = table(*((0,) * 12 for _ in range(50)))
    assert len(packed([nothing])) == 12 * (3 + 1) // 8


def test_noise_costs_its_entropy_and_a_twentieth_more() -> None:
    """Of a normal distribution: log2 of 4.13 sigma, in steps."""
    noise = np.random.default_rng(1).normal(5_000, 300, (4_000, 1)).round().astype(np.int64)
    bits = 4_000 * np.log2(4.13 * 300)
    assert bits < 8 * len(packed([Table(noise, (4_000,))])) < 1.07 * bits


def test_an_empty_table_has_no_bits() -> None:
    nothing = Table(np.zeros((0, 5), np.int64), ())
    assert packed([nothing]) == b""
    assert back(nothing)[0].shape == (0, 5)


@pytest.mark.parametrize(("rows", "fits"), [(MAX_NUMBERS, True), (MAX_NUMBERS + 1, False)])
def test_few_bits_cannot_hold_many_numbers(rows: int, fits: bool) -> None:
    data = packed([table(*((1,) for _ in range(rows)))])
    if fits:
        assert len(unpacked(data, [Shape(1, (rows,))])[0]) == rows
        return
    with pytest.raises(ValueError, match="more than"):
        unpacked(data, [Shape(1, (rows,))])


def test_bits_that_are_too_few_too_many_or_of_chance_are_refused_or_read() -> None:
    said = table((0, 3), (10, -70_000), (25, 3), (30, 4))
    data, shape = packed([said]), [Shape(2, (4,))]
    for wrong in (*(data[:size] for size in range(len(data))), data + b"\x00", data + b"\x80"):
        with pytest.raises(ValueError):
            unpacked(wrong, shape)
    chance, read = random.Random(5), 0
    for _ in range(3_000):
        try:
            (rows,) = unpacked(chance.randbytes(chance.randrange(1, 60)), shape)
        except ValueError:
            continue
        read += 1
        assert rows.shape == (4, 2)
        assert rows.min() >= LEAST
        assert rows.max() <= MOST
    assert read >= 5
