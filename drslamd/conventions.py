"""The one place for time, frames, angles, covariance order, identities and units.

Time      An integer number of microseconds, called ``utime`` as in LCM. Inside a robot it is the
          monotonic clock of that robot; clocks of different robots are never compared without the
          offset that `drslamd.gossip.peer_clock` measured.
Frames    ``a_T_b`` takes coordinates of b into a; neighbours cancel: ``w_T_a @ a_T_b == w_T_b``.
          A robot's body frame has x forward and y to the left, its origin midway between the
          wheels; ``o`` is the frame in which its odometry counts, ``w`` the frame of the team.
Poses     SE(2) as ``[x, y, theta]``: metres, metres, radians. Arrays of poses have shape (..., 3).
          theta is in (-pi, pi] wherever a pose is shown; only an odometry track counts on.
Noise     Covariances are 3 x 3 in the order x, y, theta; scalars are sigmas, never variances.
Identity  A robot is its configured ``robot.id``; one start of its daemon is an ``epoch`` that never
          repeats; a place in its trajectory is the index ``n`` of a sample on its 10 Hz grid.
"""

from __future__ import annotations

from typing import NamedTuple

SECOND_US = 1_000_000
MILLISECOND_US = 1_000

GRID_HZ = 10
"""Rate of the odometry grid on which the paper counts tau (section IV-A: odometry at 10 Hz)."""
GRID_US = SECOND_US // GRID_HZ

LAST_N = 2**31 - 2
"""The last sample of the grid that messages can name: one past it still fits their 32 bits."""
LAST_UTIME = LAST_N * GRID_US
"""Its time. No clock that began with its robot shows more: 6.8 years."""

MAX_ROBOT_ID = 254
"""LinkTrack keeps 255 for "no entry" (protocol sheet, NodeFrame2)."""
ROBOT_NAMES = frozenset(str(robot) for robot in range(MAX_ROBOT_ID + 1))
"""Ids as keys of a JSON object."""

TRANSLATION_STEP_M = 1e-4
"""Resolution of every position that is sent: 0.1 mm, far below the noise of any wheel."""
ROTATION_STEP_RAD = 1e-4
"""Resolution of every angle that is sent: 0.1 mrad."""


class Chain(NamedTuple):
    """One robot's trajectory between two starts of its daemon."""

    robot: int
    epoch: int


FIRST_NODE = 1 << 16
"""Modules that no robot of the team carries are numbered by their UWB id from here on."""
NODE_EPOCH = 1
"""They never start."""


def node_chain(uwb_id: int) -> Chain:
    """The name of a module that stands without a robot; its samples are the places where it stood,
    counted from 0."""
    return Chain(FIRST_NODE + uwb_id, NODE_EPOCH)


def is_node(number: int) -> bool:
    """Is it such a module, where robots are named?"""
    return number >= FIRST_NODE


class Segment(NamedTuple):
    """A part of a chain without a break in its odometry."""

    robot: int
    epoch: int
    segment: int

    @property
    def chain(self) -> Chain:
        return Chain(self.robot, self.epoch)


def grid_index(utime: int) -> int:
    """Index of the last grid sample at or before `utime`."""
    return utime // GRID_US


def grid_utime(n: int) -> int:
    """Time of grid sample `n` on the clock of the robot that owns it."""
    return n * GRID_US
