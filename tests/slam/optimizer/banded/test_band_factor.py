"""A factorised band with a border, against dense matrices."""

from __future__ import annotations

import numpy as np
import pytest
from dense_problems import matrix_of
from scipy.linalg import cholesky_banded
from slam_scenes import Array

from drslamd.slam import headway
from drslamd.slam.lapack.routines import triangular_banded
from drslamd.slam.optimizer.banded import band_factor
from drslamd.slam.optimizer.banded.assembly import System
from drslamd.slam.optimizer.banded.band_factor import (
    MANY,
    ROOM,
    BandFactor,
    _through,
    selected_inverse,
)
from drslamd.slam.optimizer.banded.layout import NOWHERE


def a_system(poses: int, reach: int, border: int, seed: int = 0) -> System:
    """Positive definite, with a band that reaches over so many poses, and so wide a border."""
    rng = np.random.default_rng(seed)
    n, width = 3 * poses, 3 * reach + 3
    band = np.zeros((width, n))
    for d in range(width):
        band[d, : n - d] = rng.normal(size=n - d)
    rows = rng.normal(size=(border, border))
    system = System(band, rng.normal(size=(n, border)), rows + rows.T)
    least = np.linalg.eigvalsh(matrix_of(system))[0]
    band[0] += 1 - least
    system.corner[np.diag_indices(border)] += 1 - least
    return system


def factorised(system: System, damping: float = 0.0) -> BandFactor:
    factor = BandFactor.of(system, damping)
    assert factor is not None
    return factor


SHAPES = [(1, 0, 0), (1, 0, 3), (2, 1, 1), (7, 0, 2), (12, 2, 0), (12, 3, 5), (5, 4, 4)]
"""Poses, reach and border: one pose, no border, a band that is the whole matrix."""


@pytest.mark.parametrize(("poses", "reach", "border"), SHAPES)
def test_solutions_are_those_of_the_dense_matrix(poses: int, reach: int, border: int) -> None:
    system = a_system(poses, reach, border)
    factor, full = factorised(system), matrix_of(system)
    for shape in ((len(full),), (len(full), 4)):
        right = np.random.default_rng(1).normal(size=shape)
        found = factor.solved(right)
        assert found is not None
        assert np.allclose(found, np.linalg.solve(full, right), atol=1e-10)


@pytest.mark.parametrize(("poses", "reach"), [(3, 1), (200, 0), (200, 30), (171, 170)])
@pytest.mark.parametrize("transposed", [False, True])
def test_many_columns_are_solved_in_blocks(poses: int, reach: int, transposed: bool) -> None:
    """Of 256 rows: less than one, some, and rows that reach over two and more."""
    lower = factorised(a_system(poses, reach, 0)).lower
    columns = np.random.default_rng(1).normal(size=(3 * poses, MANY))
    before = columns.copy()
    found = _through(lower, columns, transposed)
    right = triangular_banded(lower, columns, transposed)
    assert np.array_equal(columns, before)
    assert np.abs(found - right).max() < 1e-12 * np.abs(right).max()
    # column by column it would be the same to the last bit
    assert poses < 4 or not np.array_equal(found, right)
    assert np.array_equal(_through(lower, columns[:, 1:], transposed), right[:, 1:])


def test_damping_is_added_to_the_diagonal_relative_to_it() -> None:
    system = a_system(6, 1, 2)
    full = matrix_of(system)
    full[np.diag_indices(len(full))] *= 1.5
    right = np.arange(len(full), dtype=float)
    found = factorised(system, 0.5).solved(right)
    assert found is not None
    assert np.allclose(found, np.linalg.solve(full, right))


@pytest.mark.parametrize(("poses", "reach", "border"), SHAPES)
def test_the_joint_covariance_is_a_block_of_the_dense_inverse(
    poses: int, reach: int, border: int
) -> None:
    system = a_system(poses, reach, border)
    inverse = np.linalg.inv(matrix_of(system))
    some = np.random.default_rng(2).permutation(len(inverse))[: len(inverse) // 2 + 1]
    for unknowns in (some, np.arange(3), np.zeros(0, dtype=int)):
        found = factorised(system).joint_covariance(unknowns)
        assert found is not None
        assert np.allclose(found, inverse[np.ix_(unknowns, unknowns)], atol=1e-10)


def test_the_covariance_of_the_border_alone_is_that_of_its_schur_complement() -> None:
    system = a_system(5, 1, 4)
    border = 15 + np.array([3, 0])
    found = factorised(system).joint_covariance(border)
    inverse = np.linalg.inv(matrix_of(system))
    assert found is not None
    assert np.allclose(found, inverse[np.ix_(border, border)])


def links(system: System, rng: np.random.Generator, poses: int) -> Array:
    """(m, 8) two poses that the band joins, and two unknowns of anywhere, as links have them."""
    n, b = system.border.shape
    reach = len(system.band) // 3 - 1
    first = rng.integers(0, poses, 20)
    second = np.minimum(first + rng.integers(0, reach + 1, 20), poses - 1)
    ends = np.hstack([3 * k[:, None] + np.arange(3) for k in (first, second)])
    outside = n + rng.integers(0, b, (20, 2)) if b else ends[:, :2]
    return np.hstack([ends, outside])


@pytest.mark.parametrize(("poses", "reach", "border"), SHAPES)
def test_covariances_of_links_are_blocks_of_the_dense_inverse(
    poses: int, reach: int, border: int
) -> None:
    system = a_system(poses, reach, border)
    inverse = np.linalg.inv(matrix_of(system))
    unknowns = links(system, np.random.default_rng(3), poses)
    found = factorised(system).covariance_blocks(unknowns)
    assert found is not None
    for block, at in zip(found, unknowns, strict=True):
        assert np.allclose(block, inverse[np.ix_(at, at)], atol=1e-10)


def test_links_whose_one_end_is_at_the_border_are_among_them() -> None:
    system = a_system(6, 1, 5)
    inverse = np.linalg.inv(matrix_of(system))
    at = np.array([[18, 19, 20, 3, 4, 5, 21, 22], [0, 1, 2, 18, 19, 20, 22, 21]])
    found = factorised(system).covariance_blocks(at)
    assert found is not None
    for block, unknowns in zip(found, at, strict=True):
        assert np.allclose(block, inverse[np.ix_(unknowns, unknowns)])


def test_what_is_known_covaries_with_nothing() -> None:
    """A link whose last sensor is no unknown, one that ends at the border, and one that depends on
    nothing."""
    system = a_system(6, 1, 5)
    inverse = np.linalg.inv(matrix_of(system))
    at = np.array(
        [[0, 1, 2, 3, 4, 5, 21, NOWHERE], [18, 19, 20, 3, 4, 5, NOWHERE, 22], [NOWHERE] * 8]
    )
    found = factorised(system).covariance_blocks(at)
    assert found is not None
    for block, unknowns in zip(found, at, strict=True):
        is_known = unknowns == NOWHERE
        expected = inverse[np.ix_(unknowns, unknowns)]
        expected[is_known] = 0
        expected[:, is_known] = 0
        assert np.allclose(block, expected)


@pytest.mark.parametrize("reach", [0, 1, 4])
@pytest.mark.parametrize("poses", [1, 2, ROOM - 1, ROOM, ROOM + 1, 2 * ROOM, 2 * ROOM + 1])
def test_the_inverse_is_selected_however_many_poses_there_are(poses: int, reach: int) -> None:
    """The window moves after so many poses as there is room for."""
    system = a_system(poses, min(reach, poses - 1), 0)
    inverse = np.linalg.inv(matrix_of(system))
    found = selected_inverse(cholesky_banded(system.band, lower=True))
    assert found.shape == system.band.shape
    n = 3 * poses
    for d in range(len(found)):
        assert np.allclose(found[d, : n - d], np.diag(inverse, -d), atol=1e-12)


# where there is no solution


def test_long_computations_leave_marks_of_headway(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some columns or rows at a time, and to the same end."""
    system = a_system(12, 2, 9)
    whole = factorised(system)
    right = np.random.default_rng(1).normal(size=(45, 7))
    expected = whole.solved(right)
    monkeypatch.setattr(band_factor, "AT_ONCE", 2)
    monkeypatch.setattr(band_factor, "ROWS_AT_ONCE", 5)
    before = headway.marks()
    factor = factorised(system)
    # nine columns of the border, 36 rows
    assert headway.marks() - before == 5 + 8
    assert np.allclose(factor.schur, whole.schur)
    assert np.array_equal(factor.halfway, whole.halfway)
    found = factor.solved(right)
    assert found is not None
    assert expected is not None
    assert np.allclose(found, expected)
    assert headway.marks() - before == 5 + 8 + 4 + 4


@pytest.mark.row("O12")
def test_a_band_that_is_not_positive_definite_has_no_factor() -> None:
    system = a_system(4, 1, 2)
    system.band[0, 5] = -1.0
    assert BandFactor.of(system) is None


@pytest.mark.parametrize(("corner", "is_one"), [(1.001, True), (0.999, False)])
def test_a_border_that_nothing_holds_has_no_factor(corner: float, is_one: bool) -> None:
    """Of 1 at the corner the band takes all."""
    band = np.zeros((3, 3))
    band[0] = 1.0
    border = np.array([[1.0], [0.0], [0.0]])
    factor = BandFactor.of(System(band, border, np.array([[corner]])))
    assert (factor is not None) is is_one


def test_numbers_that_are_none_have_no_factor() -> None:
    system = a_system(4, 1, 2)
    system.border[3, 1] = np.nan
    assert BandFactor.of(system) is None


@pytest.mark.row("O12")
def test_a_border_that_cannot_be_told_apart_has_neither_solution_nor_covariance() -> None:
    """Two unknowns that are only known together."""
    band = np.zeros((3, 3))
    band[0] = 1.0
    factor = factorised(System(band, np.zeros((3, 2)), np.ones((2, 2))))
    assert factor.solved(np.ones(5)) is None
    assert factor.joint_covariance(np.array([0, 3])) is None
    assert factor.covariance_blocks(np.array([[0, 1, 2]])) is None
