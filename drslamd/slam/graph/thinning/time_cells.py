"""How old each time of each chain is: where its cells of time are, and how long they are.

The last minutes keep every keyframe. Before them, each time the age doubles, cells of time are four
times longer; the first keyframe of each cell stands for it. Cells nest, lie at fixed times of the
clock of their robot, and count only when they are wholly old: between two steps of time nothing
old changes.

Time steps for all robots that have measured each other at once, so that whoever keeps old times as
they were solved begins anew once in a while and not for each robot. What a robot says of a time
that nobody else is near ages nobody but itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from drslamd.conventions import GRID_HZ
from drslamd.slam.graph.timed_rows import NEVER

RECENT_S = 300
"""Keyframes of the last five minutes all stay ..."""
FULL_TEAM = 10
"""... unless the team has more robots: then it is half as long each time their number doubles."""
STEP = 16 * GRID_HZ
"""Samples between two steps of time."""
LAG_STEPS = 2
"""So many steps after the team's newest keyframe chains grow old: its entries came from everybody
by then, unless some were lost several times."""


EDGE = 2 * STEP
"""Samples behind the oldest that all stay: what is measured there may end in a peer's time that is
thinned, because cells lie on the clock of each. Newer measurements end where all stay."""
Kind = tuple[int, bool]
"""The level of a stretch, and whether it is the newest of all."""


class Stretch(NamedTuple):
    """Samples first .. end - 1 of a chain, in cells of 4^level seconds; at level 0 all stay."""

    level: int
    first: int
    end: int

    @property
    def kind(self) -> Kind:
        """Each chain has one of each at most."""
        return self.level, self.end == NEVER


def recent_s(robots: int, most: int = RECENT_S) -> int:
    """How long all keyframes stay in a team of so many robots, s.

    Args:
        most: in a small team.
    """
    halvings = 0
    while robots > FULL_TEAM << halvings:
        halvings += 1
    return most >> halvings


def ages(newest: Mapping[int, int], teams: Iterable[Mapping[int, float]]) -> dict[int, int]:
    """The step of time, on its own clock, at which each chain is.

    Args:
        newest: keyframe of each robot.
        teams: see `clocks.shifts`.
    """
    out: dict[int, int] = {}
    for shifts in teams:
        own = {robot: newest[robot] // STEP for robot in shifts if robot in newest}
        ahead = {robot: round(shifts[robot] / STEP) for robot in own}
        now = max((own[robot] - ahead[robot] for robot in own), default=0) - LAG_STEPS
        # (a robot that stands makes no keyframes, and its chain grows no more)
        out |= {robot: min(now + ahead[robot], own[robot]) for robot in own}
    return out


def stretches(step: int, recent: int) -> list[Stretch]:
    """All time of a chain, newest first.

    Args:
        step: see `ages`; recent: see `recent_s`.
    """
    out, end, level, seconds = [], NEVER, 0, step * STEP // GRID_HZ
    while end > 0:
        cell = 4 ** (level + 1)
        first = max((seconds - recent * 2**level) // cell * cell * GRID_HZ, 0)
        if first < end:
            out.append(Stretch(level, first, end))
        level, end = level + 1, first
    return out


def with_edge(found: list[Stretch]) -> list[Stretch]:
    """The same, with the edge of what stays whole in a stretch of its own: it rarely changes."""
    level, first, end = found[0]
    if not first:
        return found
    edge = Stretch(level, first, first + EDGE)
    return [Stretch(level, edge.end, end), edge, *found[1:]]
