"""Measurements as LCM structs; `test_codecs` says the rest through whole messages."""

from __future__ import annotations

import pytest
from message_builders import one_of_each_kind

from drslamd.conventions import Chain
from drslamd.gossip.entries.measurement_codecs import (
    filled_closure,
    filled_range,
    peers_of,
    read_closure,
    read_model,
    read_range,
)
from drslamd.slam.graph.measurements import GraphEntry


def the_entry() -> GraphEntry:
    (entry,) = (m for m in one_of_each_kind() if isinstance(m, GraphEntry))
    return entry


def test_a_range_and_a_closure_come_back() -> None:
    entry, peers = the_entry(), [Chain(4, 12)]
    assert peers_of(entry) == peers
    (item,), (seen,) = entry.ranges, entry.closures
    assert read_range(filled_range(item, 0), peers) == item
    assert read_closure(filled_closure(seen, 0), peers) == seen


@pytest.mark.parametrize("count", [7, 9])
def test_a_model_has_eight_numbers(count: int) -> None:
    assert read_model((0.5,) * 8).antenna_x_m == 0.5
    with pytest.raises(ValueError, match="traits"):
        read_model((0.5,) * count)
