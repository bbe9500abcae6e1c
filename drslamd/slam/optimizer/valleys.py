"""Other valleys of the same cost: where a solution may have been led to that is not the best one.

Whose heading is wrong by half a turn drives as it did if its way counts backwards: ranges tell one
from the other no better than the prior of the scale does. Two groups that only a standing point or
a few ranges join may be put together so. Where a valley leads nowhere again and again, another is
looked for as well.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from drslamd.conventions import GRID_HZ
from drslamd.slam.graph.estimate import TeamEstimate

POSES = 500
"""What stays unexplained is begun anew each second where there are fewer, every other one up to
twice as many, and so on: a beginning costs some solutions."""
BACKWARDS = 1.0
"""A scale beyond that: the way is longer the other way round."""

HARDLY_WORSE = 10.0
"""Of cost: by so little more a solution may fit, for it to be taken because it came to rest."""


def other_starts(
    found: TeamEstimate, previous: TeamEstimate | None
) -> Iterator[TeamEstimate | None]:
    """What to begin with once more, None at the closures, as a newcomer does.

    Args:
        found: a solution; previous: what it began with.
    """
    if previous is not None and previous.leads_nowhere and not found.converged:
        yield None
    elif not found.is_explained and previous is not None:
        second = int(found.trajectories[found.frame.robot].n[-1]) // GRID_HZ
        period = 1 + sum(len(path.n) for path in found.trajectories.values()) // POSES
        if previous.is_explained or second % period == 0:
            yield None
    backwards = {r for r, scale in found.scale.items() if scale.value > BACKWARDS}
    backwards &= found.trajectories.keys() - {found.frame.robot}
    if backwards:
        yield _turned_about(found, backwards)


def is_better(other: TeamEstimate, found: TeamEstimate) -> bool:
    """Of two solutions of one graph."""
    if other.is_explained != found.is_explained:
        return other.is_explained
    if other.converged != found.converged:
        # (what does not come to rest is no end, and nothing that others would come to)
        return other.converged and other.cost < found.cost + HARDLY_WORSE
    return other.cost < found.cost


def _turned_about(found: TeamEstimate, robots: set[int]) -> TeamEstimate:
    """Some robots head the other way, and count forwards."""
    half = np.array([0.0, 0.0, np.pi])
    paths = {
        robot: replace(path, poses=path.poses + half) if robot in robots else path
        for robot, path in found.trajectories.items()
    }
    scale = {
        robot: one._replace(value=2 - one.value) if robot in robots else one
        for robot, one in found.scale.items()
    }
    return replace(found, trajectories=paths, scale=scale, kept=None)
