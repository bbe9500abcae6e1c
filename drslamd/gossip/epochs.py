"""Which starts of a robot are believed: the bounds on epochs, from members and from our own file.

An epoch is the microsecond of a wall clock, or a little above the last one that is known. A later
epoch of a robot silences all its earlier ones, so whoever could name the last number there is would
mute that robot for ever. Therefore

    up to `LAST_CLOCK_EPOCH`    any epoch is believed: clocks are wrong by decades, and who has none
                                knows it
    above that                  only in steps: each proven message lifts what is believed of its
                                robot by at most `EPOCH_STEP`

However high a lie was, its robot begins again above it (`drslamd.gossip.starts`) and is followed
there. To come to the end of the type takes 2^30 lies.
"""

from __future__ import annotations

from collections.abc import Mapping

from drslamd.conventions import SECOND_US

FIRST_EPOCH = 0
LAST_CLOCK_EPOCH = 2**53
"""The year 2255; also the last whole number that every reader of JSON holds exactly. A clock that
shows more has never been set."""
EPOCH_STEP = 2**32
"""71 minutes, or thousands of starts that a peer did not hear of, a second apart."""
LAST_KEPT_EPOCH = LAST_CLOCK_EPOCH + 4_096 * EPOCH_STEP
"""What a state file may say, and no start is above it: thousands of lies were followed before. A
peer that counts such a robot up needs as many messages."""
MAX_EPOCH = 2**62
"""What any message may say."""


def highest_believed(latest: int) -> int:
    """The highest epoch that is believed of a robot whose latest known one is `latest`."""
    return min(max(latest, LAST_CLOCK_EPOCH) + EPOCH_STEP, MAX_EPOCH)


def next_epoch(above: int, wall_s: int, draw_us: int) -> int:
    """An epoch above `above`, which is at most `LAST_KEPT_EPOCH`, for a new start.

    It is a whole second and a random part. Where nothing can be kept and the clock comes up the
    same each time, the random part still tells two starts apart.

    Args:
        wall_s: the wall clock, s since 1970.
        draw_us: random, 0 to 999,999.
    """
    is_set = 0 <= wall_s < LAST_CLOCK_EPOCH // SECOND_US
    clock = wall_s if is_set else 0
    second = max(above // SECOND_US + 1, clock)
    if second * SECOND_US + SECOND_US > LAST_KEPT_EPOCH:
        second = clock
    return second * SECOND_US + draw_us


def is_kept_epoch(value: object) -> bool:
    """Is it an epoch that a state file may hold?"""
    return type(value) is int and FIRST_EPOCH <= value <= LAST_KEPT_EPOCH


def kept_epochs(latest: Mapping[int, int]) -> dict[int, int]:
    """What of these, by robot, a state file may hold."""
    return {robot: epoch for robot, epoch in latest.items() if is_kept_epoch(epoch)}
