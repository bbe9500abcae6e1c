"""Coordinates in which a team that turns as a whole goes straight on.

What only a long way holds turns at hardly any cost, but not along a straight line in x and y: a
team that went on by 0.1 rad along the tangent would grow by half a percent, which its ranges do not
allow. So a step v of all poses is made from each to the next in time, z = x + iy, turned by phi,
the mean of what v_theta is thereabouts:

    z_k+1 - z_k  =  exp(i phi_k) (way_k (1 - i phi_k) + v_k+1 - v_k)        way_k as it was

To first order that is z + v, and what it is beyond that is summed from the gauge on.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drslamd.slam import se2
from drslamd.slam.se2 import Array, Index

AROUND = 4
"""Poses before and after, over the number of robots, whose mean turn counts: headings also move
without their team, and each would turn all that is beyond it."""


@dataclass(frozen=True)
class TurningChart:
    """
    Attributes:
        origin: (k, 3) poses in the order of time, which are at step zero.
        gauge: the pose that the others turn about.
        around: so many poses before and after are in the mean turn.
    """

    origin: Array
    gauge: int
    around: int = 0

    def poses(self, step: Array) -> Array:
        """(k, 3) after a step (k, 3)."""
        turn, moved = self._taken_apart(step)
        straight = self.way + moved
        # exp(i turn) (way (1 - i turn) + moved) beyond way + moved
        more = straight - complex_of(0.0, turn) * self.way
        more *= complex_of(np.cos(turn), np.sin(turn))
        more -= straight
        before = np.zeros(len(step), dtype=complex)
        np.cumsum(more, out=before[1:])
        before -= before[self.gauge]
        out = self.origin + step
        out[:, 0] += before.real
        out[:, 1] += before.imag
        return np.asarray(out)

    def step(self, poses: Array) -> Array:
        """(k, 3) the step that leads to poses (k, 3), the inverse of `poses`."""
        out = poses - self.origin
        out[:, 2] = se2.wrap(out[:, 2])
        turn = self._turn(out[:, 2])
        back = complex_of(np.cos(turn), -np.sin(turn))
        moved = back * np.diff(complex_of(poses[:, 0], poses[:, 1]))
        moved -= self.way - complex_of(0.0, turn) * self.way
        place = np.zeros(len(out), dtype=complex)
        np.cumsum(moved, out=place[1:])
        place += complex(*out[self.gauge, :2]) - place[self.gauge]
        out[:, 0], out[:, 1] = place.real, place.imag
        return np.asarray(out)

    def pulled(self, gradient: Array, step: Array) -> Array:
        """(k, 3) derivative of a cost by the step (k, 3), of that by the poses after it (k, 3)."""
        turn, moved = self._taken_apart(step)
        pulls = complex_of(gradient[:, 0], gradient[:, 1])
        along = complex_of(np.cos(turn), -np.sin(turn)) * beyond(pulls, self.gauge)
        pull = np.zeros(len(step), dtype=complex)
        pull[1:] += along
        pull[:-1] -= along
        pull[self.gauge] += pulls.sum()
        # (the real part of conj(along) (turn way + i moved))
        lever = along.real * (turn * self.way.real - moved.imag)
        lever += along.imag * (turn * self.way.imag + moved.real)
        return np.column_stack([pull.real, pull.imag, gradient[:, 2] + self._shared(lever)])

    def own_size(self, step: Array) -> float:
        """m and rad by which a step (k, 3) moves poses beside those before them at most."""
        turn, moved = self._taken_apart(step)
        places = np.abs(moved - complex_of(0.0, turn) * self.way)
        headings = np.abs(np.diff(step[:, 2]))
        return float(max(places.max(initial=0.0), headings.max(initial=0.0)))

    @cached_property
    def way(self) -> Array:
        """(k - 1,) from each pose to the next, x + iy."""
        return np.asarray(np.diff(complex_of(self.origin[:, 0], self.origin[:, 1])))

    @cached_property
    def _window(self) -> tuple[Index, Index]:
        """(k - 1,) first of the poses around each, and the one behind the last."""
        at, count = np.arange(len(self.origin) - 1), len(self.origin)
        return np.maximum(at - self.around, 0), np.minimum(at + self.around + 1, count)

    def _taken_apart(self, step: Array) -> tuple[Array, Array]:
        """(k - 1,) phi, and how each place moves beside the one before, x + iy."""
        return self._turn(step[:, 2]), np.diff(complex_of(step[:, 0], step[:, 1]))

    def _turn(self, headings: Array) -> Array:
        """(k - 1,) phi of steps of headings (k,)."""
        begin, end = self._window
        sums = np.zeros(len(headings) + 1)
        np.cumsum(headings, out=sums[1:])
        return np.asarray((sums[end] - sums[begin]) / (end - begin))

    def _shared(self, levers: Array) -> Array:
        """(k,) pulls by v_theta, of those by phi (k - 1,)."""
        begin, end = self._window
        each = levers / (end - begin)
        count = len(self.origin) + 1
        edges = np.bincount(begin, each, count) - np.bincount(end, each, count)
        return np.asarray(np.cumsum(edges)[:-1])


def beyond(pulls: Array, gauge: int) -> Array:
    """(k - 1,) sums of the pulls (k,) of all that lies beyond each way, seen from the gauge."""
    before = np.cumsum(pulls)
    after = before[-1] - before
    after[:gauge] = -before[:gauge]
    return np.asarray(after[:-1])


def complex_of(real: Array | float, imaginary: Array) -> Array:
    """(k,) x + iy; what numpy makes of `x + 1j * y` takes several times as long."""
    out = np.empty(len(imaginary), dtype=complex)
    out.real, out.imag = real, imaginary
    return out
