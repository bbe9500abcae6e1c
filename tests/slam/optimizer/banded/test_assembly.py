"""Sums of the blocks of factors against dense products."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dense_problems import matrix_of
from slam_problems import team_problem

from drslamd.slam.optimizer.banded.assembly import (
    SPARSE,
    AllEntries,
    Assembly,
    FewEntries,
    System,
    entries_of,
)
from drslamd.slam.optimizer.banded.layout import NOWHERE, BandLayout
from drslamd.slam.optimizer.banded.linearised import Linearised
from drslamd.slam.se2 import Array, Index


def a_layout(band: int, border: int, width: int) -> BandLayout:
    layout = BandLayout.of(team_problem(0, robots=1, count=4)[0])
    return replace(layout, band=band, border=border, width=width)


def factors(unknowns: Index, rows: int, seed: int) -> Linearised:
    rng = np.random.default_rng(seed)
    m, c = unknowns.shape
    half = rng.normal(size=(m, rows, rows))
    information = half @ np.swapaxes(half, 1, 2)
    return Linearised(rng.normal(size=(m, rows, c)), information, rng.normal(size=(m, rows)))


def summed(size: int, sets: list[tuple[Index, Linearised]]) -> tuple[Array, Array]:
    """J' W J and J' f, factor by factor."""
    matrix, gradient = np.zeros((size, size)), np.zeros(size)
    for unknowns, found in sets:
        for at, jacobian, weight, pull in zip(unknowns, *found, strict=True):
            known = at != NOWHERE
            j = np.zeros((len(pull), size))
            for column, by in zip(at[known], jacobian[:, known].T, strict=True):
                j[:, column] += by
            matrix += j.T @ weight @ j
            gradient += j.T @ pull
    return matrix, gradient


TWO_SETS = (
    # in the band; in band and border; all over; with one that is no unknown
    np.array([[0, 3, 8], [2, 4, 9], [5, 6, 10], [7, 6, NOWHERE]]),
    # the last column belongs to no unknown in any factor
    np.array([[9, 1, NOWHERE], [10, 11, NOWHERE]]),
)


@pytest.mark.parametrize(("band", "is_sparse"), [(8, False), (100, True)])
def test_all_sets_are_summed_where_their_unknowns_stand(band: int, is_sparse: bool) -> None:
    """In a system that is nearly full, and in one that is nearly empty."""
    layout = a_layout(band, 4, 8)
    sets = []
    for seed, (unknowns, rows) in enumerate(zip(TWO_SETS, (3, 1), strict=True)):
        there = np.where(unknowns < 8, unknowns, unknowns + band - 8)
        sets.append((there, factors(there, rows, seed)))
    products = 6 * len(TWO_SETS[0]) + 3 * len(TWO_SETS[1])
    assert (products < entries_of(layout) // SPARSE) is is_sparse
    assembly = Assembly(layout, [unknowns for unknowns, _ in sets])
    found = [each for _, each in sets]
    matrix, gradient = summed(band + 4, sets)
    assert np.allclose(matrix_of(assembly.matrix(found)), matrix, rtol=1e-12, atol=1e-12)
    assert np.allclose(assembly.gradient(found), gradient, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("band", [8, 100])
def test_a_lean_system_is_the_same_to_the_last_bit(band: int) -> None:
    layout = a_layout(band, 4, 8)
    there = [np.where(unknowns < 8, unknowns, unknowns + band - 8) for unknowns in TWO_SETS]
    # each factor twice: several entries are for one place
    there = [np.concatenate([unknowns, unknowns]) for unknowns in there]
    found = [factors(unknowns, rows, rows) for unknowns, rows in zip(there, (3, 1), strict=True)]
    full, few = Assembly(layout, there).matrix(found), Assembly(layout, there).lean_matrix(found)
    kind = FewEntries if band == 100 else AllEntries
    assert isinstance(few.band, kind)
    assert isinstance(few.border, kind)
    for system in (few, full):
        system.add_prior(np.array([3, band]), np.array([0.3, 0.7]))
    assert np.array_equal(few.corner, full.corner)
    assert full.border.any()
    for first, end in ((0, band), (3, band), (3, 7), (band, band)):
        assert np.array_equal(few.columns(first, end), full.band[:, first:end])
        assert np.array_equal(few.border.rows(first, end), full.border[first:end])


def test_a_row_is_as_long_as_its_last_entry_that_is_not_zero() -> None:
    rows, columns = np.array([2, 0, 0, 3]), np.array([1, 4, 2, 3])
    few = FewEntries.of(rows, columns, np.array([1.0, 0.0, 5.0, 0.0]), (4, 6))
    assert few.lengths().tolist() == [3, 6, 2, 6]
    assert AllEntries(few.rows(0, 4)).lengths().tolist() == [3, 6, 2, 6]


def test_of_no_factors_there_is_nothing() -> None:
    layout = a_layout(6, 2, 3)
    none = np.zeros((0, 4), dtype=np.int64)
    found = [factors(none, 3, 0)]
    assembly = Assembly(layout, [none])
    assert not matrix_of(assembly.matrix(found)).any()
    assert assembly.gradient(found).tolist() == [0.0] * 8


def test_what_is_added_later_is_the_systems_own() -> None:
    """Parts of a system share no number."""
    layout = a_layout(6, 2, 3)
    system = System.empty(layout)
    system.band += 1
    system.border += 10
    system.corner += 100
    assert (system.band == 1).all()
    assert (system.border == 10).all()
    assert (system.corner == 100).all()
    assert system.band.size + system.border.size + system.corner.size == entries_of(layout)


def test_priors_are_added_where_their_unknowns_stand() -> None:
    system = System(np.zeros((3, 6)), np.zeros((6, 4)), np.zeros((4, 4)))
    system.add_prior(np.array([2, 7]), np.array([5.0, 3.0]))
    assert system.band[0].tolist() == [0, 0, 5, 0, 0, 0]
    assert np.diag(system.corner).tolist() == [0, 3, 0, 0]
    assert not system.band[1:].any()
    assert not system.border.any()


def test_groups_of_unknowns_of_the_border_are_held_each_by_its_own_matrix() -> None:
    system = System(np.zeros((3, 3)), np.zeros((3, 5)), np.ones((5, 5)))
    blocks = np.array([[[4.0, 1.0], [1.0, 3.0]], [[5.0, 2.0], [2.0, 6.0]]])
    system.add_blocks(np.array([[3, 7], [4, 5]]), blocks)
    expected = np.ones((5, 5))
    expected[np.ix_([0, 4], [0, 4])] += blocks[0]
    expected[np.ix_([1, 2], [1, 2])] += blocks[1]
    assert np.array_equal(system.corner, expected)
    assert not system.band.any()


def test_unknowns_are_held_beside_one_other() -> None:
    """x' K x of differences, with K of two unknowns and the other one behind them."""
    system = System(np.zeros((3, 3)), np.zeros((3, 4)), np.zeros((4, 4)))
    stiffness = np.array([[4.0, 1.0], [1.0, 3.0]])
    system.add_difference(np.array([3, 5]), np.array([6]), stiffness)
    for values in np.random.default_rng(9).normal(size=(5, 4)):
        apart = values[[0, 2]] - values[3]
        expected = float(apart @ stiffness @ apart)
        assert float(values @ system.corner @ values) == pytest.approx(expected)
