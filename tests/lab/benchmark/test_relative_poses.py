"""The benchmark's own message: as bytes and back, and how much fits one datagram."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from lab.benchmark.over_messages import relative_poses
from lab.benchmark.over_messages.relative_poses import EDGE, FINGERPRINT, RelativePoses
from message_builders import SECRET, a_seal

from drslamd.gossip.seal import Header, Seal, SealFault

CHANNEL = "DRSLAM_EDGES_003"


def some(count: int) -> RelativePoses:
    rows = [
        (k, count - k, math.pi / (k + 1), -math.e, 1e-300, 1e300, 0.1 + k) for k in range(count)
    ]
    return RelativePoses(4, 254, np.array(rows, EDGE))


def sealed(seal: Seal, poses: RelativePoses) -> bytes:
    return seal.close(CHANNEL, relative_poses.encode(seal.header(17), poses))


@pytest.mark.parametrize("count", [0, 1, 28])
def test_every_bit_arrives(count: int) -> None:
    poses = some(count)
    back = relative_poses.decode(sealed(a_seal(3), poses))
    assert (back.seq, back.peer) == (4, 254)
    assert back.edges.tolist() == poses.edges.tolist()


def test_the_bytes_are_those_that_its_module_describes() -> None:
    """Written down once more with struct."""
    header = Header(3, 3, 11, 12, 13)
    message = relative_poses.encode(header, some(2))
    expected = FINGERPRINT + struct.pack(">bhqiq", 3, 3, 11, 12, 13) + bytes(8)
    expected += struct.pack(">ih", 4, 254)
    for k in range(2):
        values = (math.pi / (k + 1), -math.e, 1e-300, 1e300, 0.1 + k)
        expected += struct.pack(">iiddddd", k, 2 - k, *values)
    assert message == expected


def test_twenty_eight_fit_one_datagram() -> None:
    assert relative_poses.MOST == 28
    assert len(relative_poses.encode(a_seal(3).header(0), some(28))) == 45 + 28 * 48 <= 1400
    assert 45 + 29 * 48 > 1400


def test_a_part_of_an_edge_is_refused() -> None:
    payload = sealed(a_seal(3), some(2))
    with pytest.raises(ValueError):
        relative_poses.decode(payload[:-1])


def test_the_daemons_seal_judges_it_like_any_message() -> None:
    payload, known = sealed(a_seal(3), some(2)), frozenset([FINGERPRINT])
    opened = a_seal(1).open(CHANNEL, payload, known, once=False)
    assert opened == Header(3, 3, 1, 1, 17)
    changed = payload[:-1] + bytes([payload[-1] ^ 1])
    assert a_seal(1).open(CHANNEL, changed, known, once=False) is SealFault.WRONG_TAG
    other = a_seal(1, secret=SECRET[::-1])
    assert other.open(CHANNEL, payload, known, once=False) is SealFault.WRONG_TAG


def test_its_channel_is_as_long_as_that_of_the_daemons_graph() -> None:
    assert relative_poses.channel(3) == CHANNEL
    assert len(CHANNEL) == len("DRSLAM_GRAPH_003")
