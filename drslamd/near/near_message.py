"""`Near`: what is told to whoever steers, and its passage to LCM bytes and back.

It is no gossip: no robot listens to it. On the local socket it bears no seal; on LCM it is sealed
as everything is, and the nearest peers have room in it. A reader takes what a robot can have said,
and nothing else.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from functools import lru_cache
from io import BytesIO
from typing import Any, cast

import numpy as np

from drslamd import lcmtypes
from drslamd.conventions import LAST_UTIME, MAX_ROBOT_ID
from drslamd.gossip import bounds
from drslamd.gossip.message_types import UNKNOWN_CLOCK, PoseState
from drslamd.gossip.messages import NEAR_PREFIX
from drslamd.gossip.seal import TAG_BYTES, Header
from drslamd.slam import se2
from drslamd.slam.se2 import Array

FINGERPRINT: bytes = lcmtypes.near_t._get_packed_fingerprint()
MOST_ON_AIR = 20
"""Peers in one datagram, which with these has 1,340 bytes."""
UNKNOWN_UNCERTAINTY = -1
LAST_UTC_US = 2**53
"""The year 2255; also how far any clock is from UTC at most."""
LONGEST_US = 2**31 - 1
_FAULTS = (ValueError, struct.error, IndexError)


Wall = tuple[int, int]
"""To be added to a time of our clock to get UTC, us, and how wrong that is at most."""
NO_WALL = (UNKNOWN_CLOCK, UNKNOWN_UNCERTAINTY)


@dataclass(frozen=True)
class Neighbours:
    """m peers.

    Attributes:
        robots: (m,) ids; states: what the pose of each is worth.
        utimes: (m,) when each was there, us on our clock; uncertainties: how wrong at most, us.
        a_T_b: (m, 3) seen from us; covariance: (6, m) xx xy xt yy yt tt in our axes.
        speeds, turn_rates: (m,) then, m/s and rad/s.
    """

    robots: tuple[int, ...]
    states: tuple[PoseState, ...]
    utimes: tuple[int, ...]
    uncertainties: tuple[int, ...]
    a_T_b: Array
    covariance: Array
    speeds: tuple[float, ...]
    turn_rates: tuple[float, ...]

    def __len__(self) -> int:
        return len(self.robots)

    def nearest(self, most: int) -> Neighbours:
        """The nearest of them."""
        if len(self) <= most:
            return self
        away = np.hypot(self.a_T_b[:, 0], self.a_T_b[:, 1])
        at = np.sort(np.argsort(away, kind="stable")[:most]).tolist()
        rows = (self.robots, self.states, self.utimes, self.uncertainties)
        robots, states, utimes, uncertainties = (tuple(row[k] for k in at) for row in rows)
        speeds, turns = (tuple(row[k] for k in at) for row in (self.speeds, self.turn_rates))
        moved = self.a_T_b[at], self.covariance[:, at]
        return Neighbours(robots, states, utimes, uncertainties, *moved, speeds, turns)


NOBODY = Neighbours((), (), (), (), np.zeros((0, 3)), np.zeros((6, 0)), (), ())


@dataclass(frozen=True)
class Near:
    """Where a robot is and who is around it.

    Attributes:
        utime: of the odometry that it rests on, us.
        odom: (3,) o_T_a, which never jumps; theta counts on.
        speed_mps, turn_radps: of the body.
        utc_minus_clock_us: to be added to a time of our clock to get UTC; `UNKNOWN_CLOCK`.
        utc_uncertainty_us: how wrong that is at most; `UNKNOWN_UNCERTAINTY`.
        state: what the pose in the frame of the team is worth; without one the rest is zero.
        frame, frame_epoch: whose first pose is the origin of that frame.
        correction: (3,) w_T_o; the pose in w is the product of both.
        covariance: (6,) of that pose.
        resets: how often it jumped by more than it was uncertain, or changed its frame.
        peers: who is around.
    """

    utime: int
    odom: tuple[float, float, float]
    speed_mps: float
    turn_radps: float
    utc_minus_clock_us: int = UNKNOWN_CLOCK
    utc_uncertainty_us: int = UNKNOWN_UNCERTAINTY
    state: PoseState = PoseState.NOT_LOCALISED
    frame: int = 0
    frame_epoch: int = 0
    correction: tuple[float, float, float] = (0.0, 0.0, 0.0)
    covariance: tuple[float, ...] = (0.0,) * 6
    resets: int = 0
    peers: Neighbours = NOBODY

    @property
    def pose(self) -> Array:
        """(3,) w_T_a."""
        pose = se2.compose(np.array(self.correction), np.array(self.odom))
        return np.append(pose[:2], se2.wrap(pose[2]))

    def on_air(self) -> Near:
        """As it fits one datagram."""
        return replace(self, peers=self.peers.nearest(MOST_ON_AIR))


def near_channel(robot: int) -> str:
    return f"{NEAR_PREFIX}{robot:03d}"


NEAR_CHANNELS = {near_channel(robot): robot for robot in range(MAX_ROBOT_ID + 1)}


def encode(header: Header, near: Near) -> bytes:
    """LCM bytes with an empty tag.

    It is told fifty times a second, so whole rows of numbers are packed at once and not, as
    generated code does, one field after the other.
    """
    peers = near.peers
    whole, floats = _packings(len(peers))
    own = _OWN.pack(
        FINGERPRINT,
        *(header.version, header.origin, header.epoch, header.counter, header.utime),
        *(near.state, near.frame, near.frame_epoch),
        *(near.utime, near.utc_minus_clock_us, near.utc_uncertainty_us),
        *near.odom,
        *(near.speed_mps, near.turn_radps),
        *near.correction,
        *near.covariance,
        *(near.resets, len(peers)),
    )
    rows = (
        own,
        whole.pack(*peers.robots, *peers.states, *peers.utimes, *peers.uncertainties),
        peers.a_T_b.T.astype(_SINGLE).tobytes(),
        floats.pack(*peers.speeds, *peers.turn_rates),
        peers.covariance.T.astype(_SINGLE).tobytes(),
    )
    return b"".join(rows)


_OWN = struct.Struct(f">8s bhqiq {TAG_BYTES}x bhqqqq 3d ff 3d 6f ih")
"""All of a `near_t` before its peers."""
_SINGLE = ">f4"


@lru_cache(maxsize=MAX_ROBOT_ID + 1)
def _packings(n: int) -> tuple[struct.Struct, struct.Struct]:
    """Of the whole numbers of n peers, and of their speeds."""
    return struct.Struct(f">{n}h{n}b{n}q{n}i"), struct.Struct(f">{2 * n}f")


def decode(payload: bytes) -> Near | str:
    """What was said, or one phrase that says what is wrong with it."""
    stream = BytesIO(payload)
    try:
        raw = cast(Any, lcmtypes.near_t).decode(stream)
        if stream.read(1):
            return "bytes left over"
        return _read(raw)
    except _FAULTS as error:
        return str(error) or type(error).__name__


def _read(raw: Any) -> Near:
    bounds.bounded("peers", raw.n, 0, MAX_ROBOT_ID)
    utc = raw.utc_minus_clock
    if utc != UNKNOWN_CLOCK:
        bounds.bounded("UTC", utc, -LAST_UTC_US, LAST_UTC_US)
    near = Near(
        utime=bounds.bounded("time", raw.near_utime, 0, LAST_UTIME),
        odom=_triple(raw.odom),
        speed_mps=raw.speed,
        turn_radps=raw.turn_rate,
        state=bounds.pose_state(raw.state),
        frame=bounds.robot(raw.frame),
        frame_epoch=bounds.epoch(raw.frame_epoch),
        correction=_triple(raw.correction),
        covariance=tuple(raw.covariance),
        resets=bounds.bounded("resets", raw.resets, 0, LONGEST_US),
        peers=_read_peers(raw),
        utc_minus_clock_us=utc,
        utc_uncertainty_us=bounds.bounded(
            "uncertainty", raw.utc_uncertainty, UNKNOWN_UNCERTAINTY, LAST_UTC_US
        ),
    )
    if not is_near(near):
        raise ValueError("pose, speed or covariance that is none")
    return near


def _triple(values: list[float]) -> tuple[float, float, float]:
    x, y, theta = values
    return x, y, theta


def _read_peers(raw: Any) -> Neighbours:
    if not raw.n:
        return NOBODY
    return Neighbours(
        robots=tuple(bounds.robot(robot) for robot in raw.peers),
        states=tuple(bounds.pose_state(state) for state in raw.states),
        utimes=tuple(bounds.bounded("time", t, -LAST_UTIME, LAST_UTIME) for t in raw.utimes),
        uncertainties=tuple(bounds.bounded("time", t, 0, LONGEST_US) for t in raw.uncertainties),
        a_T_b=np.array([raw.x, raw.y, raw.theta], dtype=float).T,
        covariance=np.array(raw.covariances, dtype=float).T,
        speeds=tuple(raw.speeds),
        turn_rates=tuple(raw.turn_rates),
    )


def is_near(near: Near) -> bool:
    """Can a robot be there, and so fast? What a solver makes up may be beyond all bounds."""
    place, angle = bounds.MAX_PLACE_M, 2 * np.pi * bounds.MAX_PLACE_M
    peers = near.peers
    of_peers = np.concatenate([peers.a_T_b.T, [peers.speeds, peers.turn_rates]])
    variances = np.concatenate(
        [
            np.array(near.covariance)[[*bounds.VARIANCES], None],
            peers.covariance[[*bounds.VARIANCES]],
        ],
        axis=1,
    )
    covariances = (near.covariance, peers.covariance)
    return bool(
        _within((*near.odom, *near.correction), angle)
        and _within((near.speed_mps, near.turn_radps), place)
        and _within(of_peers, place)
        and all(_within(each, bounds.MAX_VARIANCE) for each in covariances)
        and (variances >= 0).all()
    )


def _within(values: Any, most: float) -> bool:
    return bool((np.abs(np.asarray(values)) <= most).all())
