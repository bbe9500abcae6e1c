"""When it is asked how others lie to this robot by what stands, and what is told of the answer.

Of two robots that are in no common group the one with the lower id asks. Two answers that agree are
told as a closure; as soon as module 2 has closures of its own for that pair it is withdrawn.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from drslamd.conventions import SECOND_US, Chain
from drslamd.slam import se2
from drslamd.slam.graph.estimate import TeamEstimate
from drslamd.slam.graph.measurements import ClosureMeasurement
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.points.join_question import JoinQuestion, join_question, points_told
from drslamd.slam.points.joining import Joined
from drslamd.slam.points.point_tracker import Sensors

FIRST_NUMBER = 3 << 28
"""Of its closures: above those that tell a place, below those of a hole in odometry."""
EVERY_US = 3 * SECOND_US
"""Between two questions, each about one robot in turn."""
AGREE_M, AGREE_RAD = 0.5, 0.15
"""Two answers that differ by less are one."""


class JoinAnswer(NamedTuple):
    """What came out for a peer."""

    peer: Chain
    found: Joined | str


class Joiner:
    """Of one robot.

    Attributes:
        told: the closure that joins a peer, by its robot.
    """

    def __init__(self, own: Chain, sensors: Sensors) -> None:
        self._own, self._sensors = own, sensors
        self.told: dict[int, ClosureMeasurement] = {}
        self._before: dict[int, tuple[Chain, Joined]] = {}
        self._closures: list[ClosureMeasurement] = []
        self._number, self._asked, self._latest = FIRST_NUMBER, 0, -1

    def look(
        self,
        graph: PoseGraph,
        estimate: TeamEstimate | None,
        connected: Collection[int],
        utime: int,
    ) -> Callable[[], JoinAnswer] | None:
        """A question that is due.

        Args:
            connected: peers for whom module 2 has closures.
        """
        for robot in [robot for robot in self.told if robot in connected]:
            self._closures.append(replace(self.told.pop(robot), kept=False))
        if utime - self._asked < EVERY_US:
            return None
        self._asked = utime
        whole = set() if estimate is None else estimate.trajectories.keys() - estimate.points
        others = [
            data.chain
            for robot, data in graph.chains.items()
            if robot > self._own.robot and robot not in whole and robot not in self.told
        ]
        mine = points_told(graph, self._own) if others else set()
        others = [chain for chain in others if mine & points_told(graph, chain)] if mine else []
        if not others:
            return None
        others.sort()
        peer = next((chain for chain in others if chain.robot > self._latest), others[0])
        self._latest = peer.robot
        question = join_question(graph, self._own, peer, self._sensors)
        return None if question is None else partial(_answer, peer, question)

    def on_found(self, answer: JoinAnswer, utime: int) -> bool:
        """It was computed: is there a closure to tell?"""
        peer, found = answer
        before = self._before.pop(peer.robot, None)
        if isinstance(found, str) or peer.robot in self.told:
            return False
        self._before[peer.robot] = peer, found
        if before is None or before[0] != peer or not _agree(before[1], found):
            return False
        self._number += 1
        x, y, theta = found.a_T_b.tolist()
        self.told[peer.robot] = ClosureMeasurement(
            number=self._number,
            kept=True,
            a_n=found.a_n,
            peer=peer,
            b_n=found.b_n,
            a_T_b=(x, y, float(se2.wrap(theta))),
            covariance=se2.packed(found.covariance),
        )
        self._closures.append(self.told[peer.robot])
        return True

    def tell(self) -> list[ClosureMeasurement]:
        """Closures and withdrawals for our log."""
        out, self._closures = self._closures, []
        return out


def _answer(peer: Chain, question: JoinQuestion) -> JoinAnswer:
    return JoinAnswer(peer, question.answer())


def _agree(one: Joined, other: Joined) -> bool:
    """Both are of one time to some seconds, in which keyframes move on: where both robots' ways
    since then lead is compared, by what the second answer names of the first one's keyframes."""
    step = se2.between(one.a_T_b, other.earlier(one))
    return float(np.hypot(*step[:2])) < AGREE_M and abs(float(se2.wrap(step[2]))) < AGREE_RAD
