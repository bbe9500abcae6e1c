"""What is cut into several messages is all said, and each part fits."""

from __future__ import annotations

import numpy as np
from message_builders import HEADER, kinds

from drslamd.gossip import messages
from drslamd.gossip.bounds import Measurement
from drslamd.gossip.envelopes.splitting import (
    MEASUREMENTS_PER_ENTRY,
    MODEL_EVERY,
    entries_of,
    parts_of,
)
from drslamd.gossip.lc02 import MAX_PAYLOAD
from drslamd.slam.graph.measurements import GraphEntry, Keyframe
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.robot_model import UNTOLD


def test_measurements_are_said_in_order_in_entries_of_twenty() -> None:
    keyframes = [Keyframe(n, 0, n, 0, 0) for n in range(2 * MEASUREMENTS_PER_ENTRY + 1)]
    entries = list(entries_of(UNTOLD, keyframes, MODEL_EVERY - 1, is_news=False))
    assert [entry.seq for entry in entries] == [63, 64, 65]
    assert [len(entry.keyframes) for entry in entries] == [20, 20, 1]
    assert [k for entry in entries for k in entry.keyframes] == keyframes
    assert [entry.model for entry in entries] == [None, UNTOLD, None]


def test_a_model_that_is_news_is_said_with_the_first_entry() -> None:
    keyframes = [Keyframe(n, 0, n, 0, 0) for n in range(2 * MEASUREMENTS_PER_ENTRY)]
    entries = list(entries_of(UNTOLD, keyframes, 1, is_news=True))
    assert [entry.model for entry in entries] == [UNTOLD, None]


def test_each_measurement_stays_of_its_kind() -> None:
    entry = kinds()["GRAPH"]
    assert isinstance(entry, GraphEntry)
    mixed: list[Measurement] = [*entry.closures, *entry.ranges, *entry.keyframes]
    (said,) = entries_of(UNTOLD, mixed, 1, is_news=False)
    assert (said.keyframes, said.ranges, said.closures) == (
        entry.keyframes,
        entry.ranges,
        entry.closures,
    )


def test_lifted_poses_of_any_number_fit_datagrams_and_are_all_said() -> None:
    for rank, count in ((2, 1), (5, 200), (20, 99)):
        values = np.ones((count + 1, 2 * rank), dtype=complex)
        public = PublicPoses(3, 11, rank, tuple(range(count)), values)
        parts = list(parts_of(public))
        assert [n for part in parts for n in part.keyframes] == list(range(count))
        assert all(len(messages.encode(HEADER, part)) <= MAX_PAYLOAD for part in parts)
