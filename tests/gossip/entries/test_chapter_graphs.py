"""Who heard all of a log and who hears what is left of it hold one graph."""

from __future__ import annotations

import random
from functools import partial

import numpy as np
import pytest
from message_builders import HEADER

from drslamd.conventions import Chain
from drslamd.gossip import messages
from drslamd.gossip.entries.chapter_writer import Audience, ChapterWriter
from drslamd.slam.graph.chapters.named_keyframes import named_keyframes
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.pose_graph import PoseGraph
from drslamd.slam.robot_model import UNTOLD

SECOND = 1_000_000
COVARIANCE = (0.013, 0.001, 0.0002, 0.021, -0.003, 0.0077)
LATER = 7_003
"""Samples by which the clock of the second robot is ahead."""
STANDS = range(300, 400)
RECENT_S = 75
"""For so long nothing is thinned: a quarter of what is usual, so that half an hour is old."""
Said = tuple[Chain, GraphEntry]


class Pair:
    """Two robots that drive about; one ranges to the other, which stands for a while."""

    def __init__(self) -> None:
        self.chains = Chain(0, 1), Chain(1, 1)
        self.graph, self.said = PoseGraph(RECENT_S), list[Said]()
        self._left: list[dict[int, GraphEntry]] = [{}, {}]
        self._seq, self._chance = [0, 0], random.Random(8)
        self._writers = ChapterWriter(), ChapterWriter()
        self._place, self._last_n = np.zeros((2, 3)), [0, 0]
        self._number = 0

    @property
    def left(self) -> list[Said]:
        """For which no chapter stands."""
        pairs = zip(self.chains, self._left, strict=True)
        return [(chain, entry) for chain, entries in pairs for entry in entries.values()]

    def _say(self, robot: int, said: GraphEntry) -> None:
        entry = messages.decode("GRAPH", messages.encode(HEADER, said))
        assert isinstance(entry, GraphEntry)
        self._left[robot][entry.seq] = entry
        for first, end in entry.chapter.replaces if entry.chapter else ():
            for seq in range(first, end):
                self._left[robot].pop(seq, None)
        self.said.append((self.chains[robot], entry))
        self.graph.insert(self.chains[robot], entry)
        self._writers[robot].take(entry, self._utime)
        self._seq[robot] = entry.seq + 1

    def second(self, k: int) -> None:
        self._utime, chance = k * SECOND, self._chance
        for robot in (1, 0):
            frames: tuple[Keyframe, ...] = ()
            if robot == 0 or k not in STANDS:
                self._place[robot] += chance.gauss(4_000, 900), chance.gauss(0, 900), 700
                n = 10 * k + chance.randrange(2) + LATER * robot
                self._last_n[robot] = n
                frames = (Keyframe(n, int(k > 500), *(int(v) for v in self._place[robot])),)
            ranges, closures = [], []
            if robot == 0:
                ends = self._last_n[0], self.chains[1], self._last_n[1]
                arms = [(round(chance.gauss(0.1, 0.05), 3), 0.25) for _ in "ab"]
                metres, sigma = round(chance.uniform(2, 30), 4), chance.choice((0.1, 0.2))
                ranges.append(RangeMeasurement(*ends, arms[0], arms[1], metres, sigma, 0.05, 0.0))
                if k % 7 == 0:
                    kept = chance.random() < 0.9
                    self._number += kept
                    pose = (round(metres, 4), round(chance.gauss(0, 1), 4), 0.5)
                    seen = ClosureMeasurement(self._number, kept, *ends, pose, COVARIANCE)
                    closures.append(seen)
            seq = self._seq[robot]
            model = UNTOLD if k % 64 == 0 else None
            self._say(robot, GraphEntry(seq, model, frames, tuple(ranges), tuple(closures)))
            audience = Audience(
                RECENT_S, 5, partial(named_keyframes, self.graph, self.chains[robot])
            )
            for chapter in self._writers[robot].due(self._seq[robot], self._utime, audience):
                self._say(robot, chapter)


def graph_of(said: list[Said], recent_s: int = RECENT_S) -> PoseGraph:
    graph = PoseGraph(recent_s)
    for origin, entry in said:
        graph.insert(origin, entry)
    return graph


def digest(said: list[Said]) -> int:
    return graph_of(said).digest({0, 1})


@pytest.fixture(scope="module")
def talk() -> Pair:
    found = Pair()
    for k in range(1, 1_500):
        found.second(k)
    return found


def test_in_any_order_the_graph_of_all_that_was_said_is_that_of_what_is_left(talk: Pair) -> None:
    assert len(talk.left) < len(talk.said) / 4
    known = talk.graph.digest({0, 1})
    assert digest(talk.left) == known
    for seed in range(2):
        shuffled = list(talk.left)
        random.Random(seed).shuffle(shuffled)
        assert digest(shuffled) == known
    late = sorted(talk.said, key=lambda said: (said[1].chapter is None, -said[1].seq))
    assert digest(late) == known


def test_old_measurements_still_end_in_keyframes(talk: Pair) -> None:
    """All that the owner kept of a time, although the clocks of the two differ and one stood; and
    nearly as much of it is used as if chapters had left nothing out."""
    pair = talk.graph.pairs[0, 1]
    frames = [set(talk.graph.chains[robot].keyframes.n.tolist()) for robot in (0, 1)]
    for table in (pair.ranges, pair.closures):
        ends = zip(table.a_n.astype(int).tolist(), table.b_n.astype(int).tolist(), strict=True)
        there = [a in frames[0] and b in frames[1] for a, b in ends]
        assert sum(there) >= 0.98 * len(there)
    assert len(frames[0]) < 0.7 * 1_500
    whole = graph_of([said for said in talk.said if said[1].chapter is None])
    assert len(whole.chains[0].keyframes) == 1_499
    for what in ("ranges", "closures"):
        used, all_used = (len(getattr(g.view.pairs[0], what)) for g in (talk.graph, whole))
        assert 0.9 * all_used <= used <= 1.02 * all_used


def test_how_a_way_grew_is_known_as_before(talk: Pair) -> None:
    """What module 2 asks for: the same between keyframes that stay, whatever went between."""
    data = talk.graph.chains[0]
    whole = graph_of([said for said in talk.said if said[1].chapter is None], 10**6)
    at, there = whole.chains[0].keyframes.find(data.keyframes.rows[:, 0])
    assert there.all()
    known = whole.chains[0].sums[at]
    assert data.sums[:, 12] == pytest.approx(known[:, 12], abs=0.02)
