"""Elimination in blocks, against dense matrices."""

from __future__ import annotations

import numpy as np
import pytest
from dense_problems import lean, matrix_of
from slam_scenes import Array

from drslamd.slam.optimizer.banded.assembly import System
from drslamd.slam.optimizer.kept import elimination
from drslamd.slam.optimizer.kept.elimination import Elimination, Rest, eliminated


def a_system(poses: int, reach: int, border: int) -> System:
    """Positive definite; the second half of it reaches half as far."""
    rng = np.random.default_rng(5)
    n, width = 3 * poses, 3 * reach + 3
    band = np.zeros((width, n))
    for d in range(width):
        end = n - d if 2 * d < width else min(n - d, n // 2)
        band[d, :end] = rng.normal(size=end)
    rows = rng.normal(size=(border, border))
    system = System(band, rng.normal(size=(n, border)), rows + rows.T)
    least = np.linalg.eigvalsh(matrix_of(system))[0]
    band[0] += 1 - least
    system.corner[np.diag_indices(border)] += 1 - least
    return system


def left_of(system: System, count: int) -> Array:
    """What elimination of the first unknowns leaves, by a dense inverse."""
    full = matrix_of(system)
    gone, stays = np.arange(count), np.arange(count, len(full))
    across = full[np.ix_(gone, stays)]
    inverse = np.linalg.inv(full[np.ix_(gone, gone)])
    return np.asarray(full[np.ix_(stays, stays)] - across.T @ inverse @ across)


def whole(rest: Rest) -> Array:
    return np.block([[rest.matrix, rest.border], [rest.border.T, rest.corner]])


def solved(blocks: list[Elimination], rest: Rest, right: Array, count: int, n: int) -> Array:
    inner, outer = right[:n].copy(), right[n:].copy()
    for block in blocks:
        block.forward(inner, outer)
    top = np.linalg.solve(whole(rest), np.concatenate([inner[count:], outer]))
    inner[count:], outer = top[: n - count], top[n - count :]
    for block in reversed(blocks):
        block.backward(inner, outer)
    return np.concatenate([inner, outer])


SHAPES = [(90, 4, 5, 240), (90, 4, 5, 270), (50, 4, 0, 129), (5, 3, 4, 0), (3, 2, 0, 9)]
"""Poses, reach, border, and how many unknowns are eliminated: none, some, all."""


@pytest.mark.parametrize(("poses", "reach", "border", "count"), SHAPES)
def test_what_is_left_is_the_schur_complement_and_solutions_are_those_of_the_whole(
    poses: int, reach: int, border: int, count: int
) -> None:
    system = a_system(poses, reach, border)
    parts = eliminated(lean(system), count)
    assert parts is not None
    blocks, rest = parts
    assert np.allclose(whole(rest), left_of(system, count), atol=1e-9)
    full = matrix_of(system)
    for shape in ((len(full),), (len(full), 2)):
        right = np.random.default_rng(1).normal(size=shape)
        found = solved(blocks, rest, right, count, 3 * poses)
        assert np.allclose(found, np.linalg.solve(full, right), atol=1e-5)


def test_what_the_border_loses_is_the_same_however_many_rows_are_multiplied_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of so large a team that not all of them are held."""
    system = a_system(200, 3, 6)
    at_once = eliminated(lean(system), 560)
    monkeypatch.setattr(elimination, "AT_ONCE", 6 * 256)
    in_parts = eliminated(lean(system), 560)
    assert at_once is not None
    assert in_parts is not None
    assert len(in_parts[0]) > 2
    assert np.allclose(whole(in_parts[1]), left_of(system, 560), atol=1e-9)
    assert np.allclose(whole(in_parts[1]), whole(at_once[1]), atol=1e-12)


def test_the_rest_is_the_same_where_no_solutions_are_wanted() -> None:
    system = lean(a_system(90, 4, 5))
    parts, alone = eliminated(system, 240), eliminated(system, 240, with_blocks=False)
    assert parts is not None
    assert alone is not None
    assert np.array_equal(whole(parts[1]), whole(alone[1]))
    assert alone[0] == []


def test_a_rest_can_be_eliminated_further() -> None:
    system = a_system(40, 3, 4)
    parts = eliminated(lean(system), 90)
    assert parts is not None
    blocks, rest = parts
    own, below = np.array([1, 4, 5]), np.setdiff1d(np.arange(30), [1, 4, 5])
    more = rest.without(own, below, 90 + np.arange(30))
    assert more is not None
    block, last = more
    stays = np.setdiff1d(np.arange(len(left_of(system, 90))), own)
    dense = left_of(system, 90)
    gone = dense[np.ix_(own, stays)]
    expected = dense[np.ix_(stays, stays)] - gone.T @ np.linalg.solve(dense[np.ix_(own, own)], gone)
    assert np.allclose(whole(last), expected, atol=1e-9)
    assert block.own.tolist() == [91, 94, 95]  # type: ignore[union-attr]
    assert len(blocks) == 1


def test_what_is_not_positive_definite_has_no_factor() -> None:
    system = a_system(30, 2, 1)
    system.band[0, 50] = -1e6
    assert eliminated(lean(system), 90) is None
    assert eliminated(lean(system), 32) is not None
    assert (
        Rest(-np.eye(3), np.zeros((3, 0)), np.zeros((0, 0))).without(
            np.arange(2), np.array([2]), np.arange(3)
        )
        is None
    )
