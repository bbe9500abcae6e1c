"""Well-formed messages without any truth in them, sealed by a member of the team."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from drslamd.conventions import Chain
from drslamd.gossip import messages
from drslamd.gossip.message_types import (
    Heard,
    Hypotheses,
    LogState,
    Message,
    OdometryBatch,
    Pose,
    PoseState,
    Status,
)
from drslamd.gossip.seal import Seal
from drslamd.slam.graph.chapters.books import PER_ENTRY
from drslamd.slam.graph.measurements import (
    Chapter,
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.hypotheses.places_left import PossiblePlace
from drslamd.slam.odometry.noise import OdometryNoise
from drslamd.slam.robot_model import RobotModel

ROBOTS = 6
"""Ids that lies name."""
ALL_UWB = 2**32
SAMPLES = 2**31 - 2


class Liar:
    """Robot `robot` of a team; never says anything true but that it hears the others.

    Its own chain is nonsense, its closures and ranges to others are, its clock jumps. The UWB
    modules that it names are carried by nobody: where two robots claim one, both are told.
    """

    def __init__(self, robot: int, key: bytes, epoch: int = 1, seed: int = 0) -> None:
        self.robot, self._seal = robot, Seal(key, robot, epoch, {})
        self._epochs = dict.fromkeys(range(ROBOTS), 1)
        self._rng = np.random.default_rng(seed)
        self._seq = 0
        self._kinds: tuple[Callable[[], Message], ...] = (
            self._status,
            self._odometry,
            self._pose,
            self._entry,
            self._entry,
            self._chapter,
            self._public,
            self._hypotheses,
        )

    def hears(self, robot: int, epoch: int) -> None:
        """Whoever began again is answered under its new start."""
        self._epochs[robot] = epoch

    def lie(self, utime: int) -> tuple[str, bytes]:
        """One message, stamped by a clock that it makes up: channel, payload."""
        message = self._kinds[int(self._rng.integers(len(self._kinds)))]()
        stamp = utime if self._rng.random() < 0.9 else self._int(0, SAMPLES)
        channel = messages.channel(messages.kind_of(message), self.robot)
        payload = messages.encode(self._seal.header(stamp), message)
        return channel, self._seal.close(channel, payload)

    def _int(self, least: int, most: int) -> int:
        """Any number, often a border, often a small one."""
        draw = self._rng.random()
        if draw < 0.1:
            return least if draw < 0.05 else most
        if draw < 0.5:
            return int(self._rng.integers(max(least, -1000), min(most, 1000) + 1))
        return int(self._rng.integers(least, most + 1))

    def _chain(self) -> Chain:
        other = self._int(0, ROBOTS - 1)
        return Chain(
            other, self._epochs[other] if self._rng.random() < 0.9 else self._int(0, 2**60)
        )

    def _status(self) -> Status:
        known = range(self._int(0, 5))
        heard = tuple(Heard(*self._chain(), self._int(-(2**40), 2**40)) for _ in known)
        if self._rng.random() < 0.5:
            # who wants to be believed answers everybody's present start
            heard = tuple(Heard(*chain, 0) for chain in self._epochs.items())
        logs = {chain: self._rows(chain) for chain in (self._chain() for _ in known)}
        return Status(
            state=PoseState(self._int(0, 3)),
            frame=self._int(0, ROBOTS - 1),
            leaving=False,
            uwb_id=self._int(1000, ALL_UWB - 1) if self._rng.random() < 0.5 else 1000,
            uwb_clock_us=self._int(-(2**40), 2**40),
            graph_hash=self._int(-(2**63), 2**63 - 1),
            heard=heard,
            ranged=tuple({self._int(0, ROBOTS - 1) for _ in known}),
            logs=tuple(row for rows in logs.values() for row in rows),
        )

    def _rows(self, chain: Chain) -> list[LogState]:
        """What it holds of a log: up to its first gap, and often beyond."""
        first = self._int(0, SAMPLES)
        longest = max(1, (SAMPLES - first) // 9)
        steps = [self._int(k > 0, longest) for k in range(2 * self._int(0, 3) + 1)]
        edges = [int(edge) for edge in np.minimum(np.cumsum([first, *steps]), SAMPLES)]
        newest = edges[-1] + self._int(0, SAMPLES - edges[-1])
        pairs = [pair for pair in zip(edges[::2], edges[1::2], strict=True) if pair[0] < pair[1]]
        return [LogState(*chain, *pair, newest) for pair in pairs or [(first, first)]]

    def _odometry(self) -> OdometryBatch:
        n0, count = self._int(0, 2**30), self._int(1, 100)
        steps = self._rng.integers(-30_000, 30_001, (count, 3)).astype(float)
        return OdometryBatch(max(n0 - 5, 0), n0, np.cumsum(steps, axis=0))

    def _pose(self) -> Pose:
        place = self._rng.normal(0, 10.0 ** self._int(0, 4), 2).astype(np.float32).tolist()
        sigma = float(np.float32(10.0 ** self._int(-3, 5)))
        return Pose(
            PoseState(self._int(0, 3)),
            *self._chain(),
            self._int(0, SAMPLES),
            (place[0], place[1], float(np.float32(self._rng.uniform(-3, 3)))),
            (sigma, 0.0, 0.0, sigma, 0.0, sigma),
        )

    def _entry(self) -> GraphEntry:
        self._seq += 1
        return GraphEntry(
            self._seq - 1,
            None,
            tuple(self._keyframe() for _ in range(self._int(0, 3))),
            tuple(self._range() for _ in range(self._int(0, 3))),
            tuple(self._closure() for _ in range(self._int(0, 3))),
        )

    def _chapter(self) -> GraphEntry:
        """What it says that it said before."""
        self._seq += 1
        return GraphEntry(self._seq - 1, chapter=self.chapter(self._seq - 1))

    def chapter(self, seq: int) -> Chapter:
        """Entry `seq` of a log, which says again what no other entry said."""
        first = max(0, seq - int(self._rng.integers(65)))
        is_last = seq - first >= 2 and self._rng.random() < 0.5
        parts = int(self._rng.integers(1, seq - first + 1)) if is_last else 0
        end = int(self._rng.integers(first + 1, seq + 2 - parts)) if is_last else first
        models = ((first, RobotModel(OdometryNoise(0.5, 0.5, 0.5, 0.5))),)
        return Chapter(
            parts,
            ((first, end),) if is_last else (),
            models[: self._int(0, 1)],
            tuple(self._keyframe() for _ in range(self._int(0, 5))),
            self._placed(self._range, first, seq),
            self._placed(self._closure, first, seq),
        )

    def _placed(self, make: Callable[[], Any], first: int, seq: int) -> tuple[Any, ...]:
        """Up to four of them at places of these entries, by their peer."""
        places = self._rng.integers(first * PER_ENTRY, (seq + 1) * PER_ENTRY, self._int(0, 4))
        found = {int(place): make() for place in places}
        return tuple(sorted(found.items(), key=lambda entry: (entry[1].peer, entry[0])))

    def _keyframe(self) -> Keyframe:
        places = [self._int(-(2**20), 2**20) for _ in range(3)]
        return Keyframe(self._int(0, SAMPLES), self._int(0, 100), *places)

    def _range(self) -> RangeMeasurement:
        metres, sigma = self._int(0, 1000) * 0.1, self._int(1, 3000) * 1e-3
        ends = self._int(0, SAMPLES), self._chain(), self._int(0, SAMPLES)
        return RangeMeasurement(*ends, (0.0, 0.0), (0.0, 0.0), metres, sigma, 0.0, 0.0)

    def _closure(self) -> ClosureMeasurement:
        x, y = (self._int(-100_000, 100_000) * 1e-4 for _ in range(2))
        variance = float(np.float32(2.0 ** self._int(-10, 8)))
        return ClosureMeasurement(
            number=self._int(0, 1000),
            kept=self._rng.random() < 0.8,
            a_n=self._int(0, SAMPLES),
            peer=self._chain(),
            b_n=self._int(0, SAMPLES),
            a_T_b=(x, y, self._int(-31_000, 31_000) * 1e-4),
            covariance=(variance, 0.0, 0.0, variance, 0.0, variance),
        )

    def _hypotheses(self) -> Hypotheses:
        x, y = (self._int(-10_000, 10_000) * 1e-2 for _ in range(2))
        known = (1.0, 0.0, 0.0, 1.0, 0.0, 1.0)
        place = PossiblePlace(self._int(0, ROBOTS), self._int(0, SAMPLES), 1.0, (x, y, 0.0), known)
        return Hypotheses(self._int(0, SAMPLES), (y, x, 0.0), (place,))

    def _public(self) -> PublicPoses:
        count = self._int(0, 4)
        numbers = sorted({self._int(0, SAMPLES) for _ in range(count)})
        parts = self._rng.normal(0, 100.0, (2, len(numbers) + 1, 10)).astype(np.float32)
        lifted = parts[0].astype(float) + 1j * parts[1].astype(float)
        return PublicPoses(*self._chain(), 5, tuple(numbers), lifted)
