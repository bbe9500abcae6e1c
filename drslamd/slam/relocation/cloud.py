"""Where a robot may be that drives without odometry: places, weighed by ranges.

Each of a few thousand places has a velocity that forgets itself within seconds and is no faster
than the robot drives. There is no chance in it: what looks like noise is a sequence that fills
space evenly, so the same ranges give the same cloud.
"""

from __future__ import annotations

import numpy as np

from drslamd.slam.range_model import RangeModel
from drslamd.slam.relocation.sightings import Sightings
from drslamd.slam.se2 import Array

PLACES = 2_000
FORGETS_S = 2.0
"""Who drives about turns within so long."""
STEP_S = 0.2
"""One step of the cloud."""
MEMORY_S = 2.0
"""What was ranged so long ago says little of now: a constant error of a range counts once in it."""
LEAST_M = 1e-6
"""Peers that stand on each other have no line between them."""
NEAR_M = 0.5
"""Who is nearer to the line between two peers may be on its other side ..."""
OTHER_SIDE = 0.02
"""... and so may be of whom such a share of the places is there."""
OFF_LINE_M = 1.0
"""A third peer so far from the line of two others tells the sides."""
FEWEST = 0.5
"""Share of places that must carry weight."""
WEYL = 1.1673039782614187 ** -np.arange(1.0, 5.0)
"""Steps that fill four dimensions evenly: powers of the root of x^5 = x + 1, as the golden ratio,
the root of x^2 = x + 1, does in one (Roberts)."""


class Cloud:
    """Places in the frame of the team."""

    def __init__(self, place: Array, covariance: Array, speed: float) -> None:
        """
        Args:
            place: (2,) m; covariance: (2, 2) of it.
            speed: how fast the robot drives, m/s.
        """
        self._drawn = 0
        self._speed = max(speed, 0.05)
        self._log_weights = np.zeros(PLACES)
        normal = self._normal()
        root = np.linalg.cholesky(covariance + 1e-6 * np.eye(2))
        self._places = place + normal[:, :2] @ root.T
        self._velocities = self._speed / np.sqrt(2) * normal[:, 2:]
        self._line: tuple[Array, Array] | None = None
        """A point of the line between two peers, and the unit vector across it."""
        self._has_sides = True

    def carry(self, seconds: float) -> None:
        """Let time pass."""
        keep = float(np.exp(-seconds / FORGETS_S))
        new = self._speed / np.sqrt(2) * np.sqrt(1 - keep**2)
        self._velocities = keep * self._velocities + new * self._normal()[:, :2]
        self._places = self._places + self._velocities * seconds

    def weigh(self, seen: Sightings, model: RangeModel, arm_m: float) -> None:
        """Take the sightings of one step.

        Args:
            arm_m: from the middle of the robot to its antenna.
        """
        slow = model.correlated_ratio(STEP_S) / 2
        for place, metres, sigma, bias in zip(
            seen.place, seen.range_m, seen.sigma_m, seen.bias_m, strict=True
        ):
            off = np.hypot(*(self._places - place).T) - metres
            constant = (bias**2 + arm_m**2 / 2) * MEMORY_S / STEP_S
            wide = np.sqrt((slow * sigma) ** 2 + constant + self._spacing() ** 2)
            c = model.cauchy_sigmas
            self._log_weights -= c**2 / 2 * np.log1p((off / (c * wide)) ** 2)
        if self._share() < FEWEST:
            self._choose()
        self._look_for_sides(seen)

    def moments(self) -> tuple[Array, Array]:
        """Mean place (2,), and covariance (2, 2), with the other side of a line between two peers
        in it where nobody knows on which one the robot is."""
        mean, covariance = self._spread()
        if not self._has_sides and self._line is not None:
            point, across = self._line
            apart = 2 * float((mean - point) @ across) * across
            covariance = covariance + np.outer(apart, apart) / 2
        return mean, covariance

    def _spread(self) -> tuple[Array, Array]:
        """Of the places as they are."""
        weights = self._weights()
        mean = weights @ self._places
        off = self._places - mean
        return mean, (off * weights[:, None]).T @ off

    def _weights(self) -> Array:
        weights = np.exp(self._log_weights - self._log_weights.max())
        return np.asarray(weights / weights.sum())

    def _share(self) -> float:
        return float(1 / (self._weights() ** 2).sum() / PLACES)

    def _spacing(self) -> float:
        """How far places are from each other, m: nothing finer is known."""
        _, covariance = self._spread()
        area = 2 * np.pi * np.sqrt(max(float(np.linalg.det(covariance)), 0.0))
        return float(np.sqrt(area / PLACES))

    def _choose(self) -> None:
        """Places by their weight, each as heavy as any other."""
        edges = np.cumsum(self._weights())
        at = np.searchsorted(edges, (np.arange(PLACES) + 0.5) / PLACES * edges[-1])
        at = np.minimum(at, PLACES - 1)
        self._places, self._velocities = self._places[at], self._velocities[at]
        self._log_weights = np.zeros(PLACES)

    def _look_for_sides(self, seen: Sightings) -> None:
        """Ranges to two peers do not tell on which side of the line between them the robot is; who
        came near that line may have gone on on either."""
        peers = seen.peer.tolist()
        places = [seen.place[peers.index(peer)] for peer in sorted(set(peers))]
        if len(places) < 2:
            return
        along = places[1] - places[0]
        across = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), LEAST_M)
        self._line = (places[0], across)
        beyond = [abs(float((place - places[0]) @ across)) for place in places[2:]]
        if max(beyond, default=0.0) > OFF_LINE_M:
            self._has_sides = True
            return
        off = (self._places - places[0]) @ across
        left = float(self._weights()[off > 0].sum())
        mean = abs(float(self._weights() @ off))
        if mean < NEAR_M or min(left, 1 - left) > OTHER_SIDE:
            self._has_sides = False

    def _normal(self) -> Array:
        """(PLACES, 4) values of Gauss's distribution, others each time."""
        k = np.arange(self._drawn, self._drawn + PLACES)[:, None]
        self._drawn += PLACES
        even = (0.5 + k * WEYL) % 1.0
        radius = np.sqrt(-2 * np.log(1 - even[:, ::2]))
        angle = 2 * np.pi * even[:, 1::2]
        return np.concatenate([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
