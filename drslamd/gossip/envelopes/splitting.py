"""What does not fit one datagram is said in several."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from drslamd.gossip.bounds import Measurement
from drslamd.gossip.lc02 import MAX_PAYLOAD
from drslamd.slam.graph.measurements import (
    ClosureMeasurement,
    GraphEntry,
    Keyframe,
    RangeMeasurement,
)
from drslamd.slam.graph.public_poses import PublicPoses
from drslamd.slam.robot_model import RobotModel

MODEL_EVERY = 64
"""Log entries between two that say what our sensors are like."""
MEASUREMENTS_PER_ENTRY = 20
"""Keyframes, ranges and closures in one log entry; 20 closures with 20 peers are 1,280 bytes."""
PUBLIC_ENVELOPE_BYTES = 80
"""Of a public_poses_t besides its poses, each a number and 4 * rank floats; 10 for each held."""


def entries_of(
    model: RobotModel, measurements: Sequence[Measurement], first_seq: int, *, is_news: bool
) -> Iterator[GraphEntry]:
    """Log entries from this number on.

    Args:
        is_news: is the model another one than was said?
    """
    starts = range(0, len(measurements), MEASUREMENTS_PER_ENTRY)
    for seq, first in enumerate(starts, start=first_seq):
        part = measurements[first : first + MEASUREMENTS_PER_ENTRY]
        yield GraphEntry(
            seq,
            model if seq % MODEL_EVERY == 0 or (is_news and not first) else None,
            tuple(i for i in part if isinstance(i, Keyframe)),
            tuple(i for i in part if isinstance(i, RangeMeasurement)),
            tuple(i for i in part if isinstance(i, ClosureMeasurement)),
        )


def parts_of(public: PublicPoses) -> Iterator[PublicPoses]:
    """Lifted poses, as many in one message as one datagram takes."""
    lifted = 16 * public.rank
    envelope = PUBLIC_ENVELOPE_BYTES + 10 * len(public.held) + lifted
    return public.split((MAX_PAYLOAD - envelope) // (4 + lifted))
