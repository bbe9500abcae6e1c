"""Measurements as LCM structs; `test_codecs` says the rest through whole messages."""

from __future__ import annotations

import pytest
from message_builders import one_of_each_kind

from drslamd.conventions import Chain, node_chain
from drslamd.gossip.entries.measurement_codecs import (
    filled_closure,
    filled_peer,
    filled_range,
    peers_of,
    read_closure,
    read_model,
    read_peer,
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


@pytest.mark.parametrize("uwb_id", [0, 7, 2**32 - 1])
def test_a_module_that_no_robot_carries_is_named_by_its_uwb_id(uwb_id: int) -> None:
    said = filled_peer(node_chain(uwb_id))
    assert (said.id, said.epoch) == (255, uwb_id)
    assert read_peer(said) == node_chain(uwb_id)


@pytest.mark.parametrize("uwb_id", [-1, 2**32])
def test_no_module_has_such_an_id(uwb_id: int) -> None:
    said = filled_peer(node_chain(0))
    said.epoch = uwb_id
    with pytest.raises(ValueError, match="uwb id"):
        read_peer(said)
