"""Relative poses in full precision: as LCM bytes and back, and what is refused."""

from __future__ import annotations

import math
from typing import Any

import pytest
from message_builders import HEADER, a_seal

from drslamd import lcmtypes
from drslamd.conventions import Chain
from drslamd.gossip import messages
from drslamd.gossip.lc02 import MAX_PAYLOAD
from drslamd.gossip.team import Team
from drslamd.slam.graph.measurements import GraphEntry, RelativePoses


def some(count: int, robot: int = 7) -> RelativePoses:
    numbers = tuple(range(count))
    values = tuple(math.pi / (k + 1) for k in numbers)
    return RelativePoses(
        Chain(robot, 3), numbers, numbers[::-1], values, values, values, values, values
    )


@pytest.mark.parametrize("relative", [(), (some(3),), (some(1), some(2, 2))])
def test_every_bit_arrives(relative: tuple[RelativePoses, ...]) -> None:
    entry = GraphEntry(4, relative=relative)
    assert messages.decode("GRAPH", messages.encode(HEADER, entry)) == entry


def test_twenty_seven_fit_one_datagram() -> None:
    _, sealed = Team(a_seal(3)).append(GraphEntry(0, relative=(some(27),)), 0)
    assert len(sealed) <= MAX_PAYLOAD < len(sealed) + 48


@pytest.mark.parametrize(
    ("name", "value", "accepted"),
    [
        ("peer", -1, False),
        ("peer", 1, False),
        ("a_n", (0, -1, 1), False),
        ("b_n", (-1, 0, 1), False),
        ("x", (0.0, math.nan, 0.0), False),
        ("theta", (0.0, math.inf, 0.0), False),
        ("theta", (0.0, -1e9, 0.0), True),
        ("tau", (1.0, 0.0, 1.0), False),
        ("tau", (1.0, 1e-300, 1.0), True),
        ("kappa", (1.0, -1.0, 1.0), False),
    ],
)
def test_what_no_sender_could_mean_is_refused(name: str, value: Any, accepted: bool) -> None:
    raw = lcmtypes.graph_t.decode(messages.encode(HEADER, GraphEntry(0, relative=(some(3),))))
    setattr(raw.relative[0], name, value)
    decoded = messages.decode("GRAPH", raw.encode())
    assert isinstance(decoded, GraphEntry) == accepted
