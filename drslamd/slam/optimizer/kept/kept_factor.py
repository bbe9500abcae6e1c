"""What the old part of a team's system came to, and the newest seconds on top of it.

The head are all poses but those of the newest seconds. Most of its poses are eliminated once, from
the factors between them at the point of that time; what is left is the rest: the front, which the
newest seconds hang on, and the border. Each second the tail and the priors are added to the rest
as they are now, and tails that grew are eliminated in their turn.

All of it stays where it was made: poses that follow are laid over it, beside the newest ones of the
head as they are beside these now. A matrix whose parts were made of teams that stand turned towards
each other would hold turns that nothing holds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drslamd.slam import se2
from drslamd.slam.lapack.routines import cholesky_solved
from drslamd.slam.optimizer.banded.layout import NOWHERE, BandLayout, border_poses
from drslamd.slam.optimizer.kept.believed import Believed
from drslamd.slam.optimizer.kept.border import Border
from drslamd.slam.optimizer.kept.elimination import SINGLE, Elimination, Rest, eliminated
from drslamd.slam.optimizer.kept.head import Flags, Head, Pair, Places, keys_of, tail_of
from drslamd.slam.optimizer.problem import Problem
from drslamd.slam.se2 import Array, Index

NEWEST = 4
"""Poses of a head, over its robots, that say how it is turned where the tail follows."""
AT_ONCE = 128
"""Right-hand sides that are solved together: a large team has hundreds."""


@dataclass(frozen=True)
class KeptFactor:
    """
    Attributes:
        blocks: what was eliminated, in this order; none where solutions are not wanted.
        rest: of the front and the border.
        border: what it came to with a tail on top, some seconds ago.
        origin: (h + d, 3) poses of the head, then of `Head.far`, where all of that was made.
    """

    head: Head
    blocks: tuple[Elimination, ...]
    rest: Rest
    origin: Array
    border: Border | None = None

    def laid_over(self, poses: Array, places: Places) -> Array:
        """(k, 3) poses of a problem: those of the head where the factor was made, the tail beside
        them as it is beside the newest of them in `poses` (k, 3)."""
        out: Array = poses.copy()
        out[np.concatenate([places.inside, places.far])] = self.origin
        newest = np.sort(places.inside)[-NEWEST * len(places.flat.scale) :]
        turn = float(se2.wrap(out[newest, 2] - poses[newest, 2]).mean())
        last, tail = newest[-1], places.tail
        moved = (poses[tail, :2] - poses[last, :2]) @ [1, 1j] * np.exp(1j * turn)
        out[tail, 0], out[tail, 1] = out[last, 0] + moved.real, out[last, 1] + moved.imag
        out[tail, 2] += turn
        return out

    def on_top(self, believed: Believed, places: Places) -> Current | None:
        """With the tail of a problem, laid over it; None where that is not positive definite."""
        problem = believed.problem
        poses = self.laid_over(believed.point.poses, places)
        layout, numbers = places.dense(places.tail)
        i, j = problem.ends
        is_tail = np.zeros(len(problem.n), dtype=bool)
        is_tail[places.tail] = True
        system = believed.of_factors(is_tail[i] | is_tail[j], layout, poses)
        size, pairs = len(numbers) - len(places.outer), places.head.pairs
        border, is_claimed = self.border, believed.claims is not None
        if border and not border.holds(problem, pairs, is_claimed):
            border = None
        _add(system.corner, self.rest, 3 * len(places.tail), with_border=border is None)
        own, across = system.corner[:size, :size], system.corner[:size, size:]
        try:
            if border is None:
                believed.add_priors(system, layout)
                whole = np.linalg.cholesky(system.corner)
                lower, border = whole[:size, :size], Border.of(problem, pairs, whole[size:, size:])
            else:
                lower = np.linalg.cholesky(own)
        except np.linalg.LinAlgError:
            return None
        return Current(
            self,
            places,
            poses,
            layout,
            numbers,
            lower=np.ascontiguousarray(lower),
            across=np.ascontiguousarray(across),
            border=border,
        )

    def grown(self, believed: Believed, places: Places) -> KeptFactor | None:
        """With all but the newest poses of the tail in the head as well, laid over it."""
        problem = believed.problem
        poses = self.laid_over(believed.point.poses, places)
        more = places.tail[~tail_of(problem)[places.tail]]
        layout, numbers = places.dense(more)
        is_head = np.zeros(len(problem.n), dtype=bool)
        is_head[np.concatenate([places.inside, places.far, more])] = True
        is_more = np.zeros(len(problem.n), dtype=bool)
        is_more[more] = True
        i, j = problem.ends
        which = is_head[i] & is_head[j] & (is_more[i] | is_more[j])
        system = believed.of_factors(which, layout, poses)
        _add(system.corner, self.rest, 3 * len(more))
        apart = np.concatenate([places.front, more])
        needed = _needed(problem, is_head)[apart]
        count = len(self.head.keys)
        numbers = np.concatenate([self.head.front, count + np.arange(len(more))])
        size = 3 * len(apart)
        whole = Rest(
            system.corner[:size, :size], system.corner[:size, size:], system.corner[size:, size:]
        )
        parts = whole.without(_three(~needed), _three(needed), _unknowns(numbers))
        if parts is None:
            return None
        block, rest = parts
        head = replace(
            places.head,
            keys=np.concatenate([self.head.keys, keys_of(problem)[more]]),
            front=numbers[needed],
        )
        origin = poses[np.concatenate([places.inside, more, places.far])]
        return KeptFactor(head, (*self.blocks, block) if self.blocks else (), rest, origin)


def _add(corner: Array, rest: Rest, tail: int, with_border: bool = True) -> None:
    """Add a rest to the system of front, tail and border, whose border may be larger.

    Args:
        with_border: also its last rows?
    """
    f, b = rest.border.shape
    corner[:f, :f] += rest.matrix
    outer = slice(f + tail, f + tail + b)
    corner[:f, outer] += rest.border
    if not with_border:
        return
    corner[outer, :f] += rest.border.T
    corner[outer, outer] += rest.corner


def _three(which: Flags) -> Index:
    """Numbers of the unknowns of those poses."""
    return np.flatnonzero(np.repeat(which, 3))


def _unknowns(poses: Index) -> Index:
    return np.asarray((3 * poses[:, None] + np.arange(3)).ravel())


def _newest(problem: Problem) -> Flags:
    """(k,) the last pose of each robot."""
    found = np.zeros(len(problem.n), dtype=bool)
    backwards = problem.robot_id[::-1]
    found[len(found) - 1 - np.unique(backwards, return_index=True)[1]] = True
    return found


def _needed(problem: Problem, is_head: Flags) -> Flags:
    """(k,) poses of the head that others hang on, or will: a robot may stand on its newest."""
    i, j = problem.ends
    across = is_head[i] != is_head[j]
    needed = _newest(problem)
    needed[i[across]] = needed[j[across]] = True
    return needed & is_head


def build(
    believed: Believed, pairs: list[Pair], tail: Flags, with_blocks: bool, is_curved: bool = False
) -> KeptFactor | None:
    """Eliminate the head at the point where it is; None where that is not positive definite.

    Args:
        tail: (k,) the poses that are not in it.
    """
    problem = believed.problem
    is_head = ~tail
    i, j = problem.ends
    which = is_head[i] & is_head[j]
    needed = _needed(problem, is_head)
    # in the order of time, what is needed last
    inside = np.concatenate([np.flatnonzero(is_head & ~needed), np.flatnonzero(needed)])
    place = np.full(len(problem.n), NOWHERE)
    place[inside] = np.arange(len(inside))
    narrow = 8 + 4 * len(problem.priors.scale)
    far = inside[border_poses(place[i[which]], place[j[which]], narrow)]
    inside = inside[~np.isin(inside, far)]
    place = np.full(len(problem.n), NOWHERE)
    place[inside] = np.arange(len(inside))
    both = which & (place[i] != NOWHERE) & (place[j] != NOWHERE)
    reach = int(np.abs(place[i] - place[j])[both].max(initial=0))
    place[far] = len(inside) + np.arange(len(far))
    poses = np.where(place[:, None] == NOWHERE, NOWHERE, 3 * place[:, None] + np.arange(3))
    layout = BandLayout.placed(problem, poses, 3 * len(inside), 3 * len(far), 3 * reach + 3)
    system = believed.of_head(which, layout, is_curved)
    front = int(np.count_nonzero(needed[inside]))
    parts = eliminated(system, 3 * (len(inside) - front), with_blocks)
    if parts is None:
        return None
    blocks, rest = parts
    keys = keys_of(problem)
    head = Head(
        keys=keys[inside],
        front=np.arange(len(inside) - front, len(inside)),
        far=keys[far],
        pairs=tuple(pairs),
        paired=len(pairs),
        doubted=problem.doubted,
    )
    return KeptFactor(head, tuple(blocks), rest, believed.point.poses[np.append(inside, far)])


@dataclass(frozen=True)
class Current:
    """
    Attributes:
        poses: (k, 3) where it was made, however the team has been turned since.
        layout: of front, tail and border; numbers: in `places.flat`.
        lower: (t, t) Cholesky's factor of A_TT; across: (t, b) A_TB.
    """

    kept: KeptFactor
    places: Places
    poses: Array
    layout: BandLayout
    numbers: Index
    lower: Array
    across: Array
    border: Border

    def solved(self, right: Array) -> Array:
        """For right-hand sides (n,) or (n, c) in the order of `BandLayout.flat`."""
        columns = right.reshape(len(right), -1)
        inside = self.places.flat.poses[self.places.inside].ravel()
        inner = columns[inside].astype(SINGLE)
        outer = columns[self.places.outer].astype(SINGLE)
        for block in self.kept.blocks:
            block.forward(inner, outer)
        front = _unknowns(self.kept.head.front)
        newest, border = columns[self.numbers[: len(self.lower)]], np.asarray(outer, dtype=float)
        newest[: len(front)] = inner[front]
        newest, border = self._top(newest, border)
        inner[front], outer = newest[: len(front)], border.astype(SINGLE)
        for block in reversed(self.kept.blocks):
            block.backward(inner, outer)
        out = np.empty_like(columns)
        out[inside] = inner
        out[self.numbers] = np.concatenate([newest, border])
        return out.reshape(right.shape)

    def _top(self, newest: Array, border: Array) -> tuple[Array, Array]:
        """For right-hand sides of T and B when all else is eliminated."""
        alone = cholesky_solved(self.lower, newest)
        border = cholesky_solved(self.border.lower, border - self.across.T @ alone)
        return alone - cholesky_solved(self.lower, self.across @ border), border

    def covariance(self, at: Index) -> Array:
        """(k, k) of unknowns (k,) in `layout`."""
        unit = np.zeros((len(self.numbers), len(at)))
        unit[at, np.arange(len(at))] = 1
        newest, border = np.split(unit, [len(self.lower)])
        alone = cholesky_solved(self.lower, newest)
        pull = border - self.across.T @ alone
        return np.asarray(newest.T @ alone + pull.T @ cholesky_solved(self.border.lower, pull))

    def squared(self, right: Array) -> Array:
        """See `Solver.squared`."""
        columns = range(0, right.shape[1], AT_ONCE)
        solved = [right.T @ self.solved(right[:, k : k + AT_ONCE]) for k in columns]
        return np.concatenate(solved, axis=1)
