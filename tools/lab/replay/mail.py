"""What recordings of several robots say together: whose clock is how far ahead, who heard whom.

A message that stands in two recordings was sent at one time of one clock and heard at one time of
another. Delays are positive, so the quickest message of some seconds each way bounds the offset
from both sides (as of NTP); a line through the middle is offset and rate.
"""

from __future__ import annotations

import bisect
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from drslamd.conventions import SECOND_US
from drslamd.events import ChannelMessage, Datagram
from drslamd.gossip import lc02
from drslamd.recording.records import Sent
from lab.play.simulator import Clock
from lab.recordings.recording import Array
from lab.replay.runs import Run

WINDOW_US = 10 * SECOND_US
"""In which the quickest message each way is looked for; a crystal drifts 0.5 ms meanwhile."""
DELAY_US = 2_000
"""Of a message, where only one way is known."""
HEARD_WITHIN_US = 3 * SECOND_US
"""Robots say something at least every second: who was not heard for longer could not be."""
MOST_PPM = 500.0
"""No crystal is worse; short recordings would say more."""


@dataclass
class Mail:
    """What one run sent and heard: the first time of each channel and content, us."""

    sent: dict[tuple[str, bytes], int] = field(default_factory=dict)
    heard: dict[tuple[str, bytes], int] = field(default_factory=dict)


def mail_of(run: Run) -> Mail:
    """Read a run for its messages."""
    mail = Mail()
    for record in run.records():
        if isinstance(record, Sent):
            mail.sent.setdefault((record.send.channel, record.send.payload), record.utime)
        elif isinstance(record, Datagram):
            framed = lc02.decode(record.data)
            if not isinstance(framed, lc02.FramingFault):
                mail.heard.setdefault(framed, record.utime)
        elif isinstance(record, ChannelMessage):
            mail.heard.setdefault((record.channel, record.payload), record.utime)
    return mail


def travelled(sender: Mail, receiver: Mail) -> Array:
    """(k, 2) times at which messages were sent and heard, each on its own clock, us, ascending."""
    both = [(at, receiver.heard[key]) for key, at in sender.sent.items() if key in receiver.heard]
    return np.array(sorted(both), dtype=np.int64).reshape(-1, 2)


def line(there: Array, back: Array) -> tuple[int, float, float] | None:
    """The clock of b beside that of a: at time `a0` of a it is `b - a` us ahead, and gains `ppm`.

    Args:
        there: of `travelled` from a to b; back: from b to a.
    """
    upper = _quickest(there[:, 0], there[:, 1] - there[:, 0])
    lower = _quickest(back[:, 1], back[:, 1] - back[:, 0])
    both = sorted(set(upper) & set(lower))
    if both:
        ahead = np.array([(upper[k] - lower[k]) / 2 for k in both])
    elif upper:
        both = sorted(upper)
        ahead = np.array([upper[k] - DELAY_US for k in both], dtype=float)
    elif lower:
        both = sorted(lower)
        ahead = np.array([DELAY_US - lower[k] for k in both], dtype=float)
    else:
        return None
    windows = np.array(both, dtype=float)
    middle = windows.mean()
    ppm = 0.0
    if len(both) > 1:
        slope = np.polyfit(windows - middle, ahead, 1)[0] / WINDOW_US * 1e6
        ppm = float(np.clip(slope, -MOST_PPM, MOST_PPM))
    return round((middle + 0.5) * WINDOW_US), float(ahead.mean()), ppm


def _quickest(at: Array, took: Array) -> dict[int, int]:
    """The least of each window of time."""
    out: dict[int, int] = {}
    for window, us in zip((at // WINDOW_US).tolist(), took.tolist(), strict=True):
        out[window] = min(us, out.get(window, us))
    return out


def clocks(runs: Sequence[Run], mails: Sequence[Mail]) -> list[Clock]:
    """The clock of each run beside one time of the world, in which the first run begins at 0.

    Where no chain of messages leads from the first run to another, wall clocks have to do.
    """
    found: dict[int, Clock] = {0: Clock(runs[0].opening.utime)}
    waiting = [0]
    while waiting:
        a = waiting.pop(0)
        for b in range(len(runs)):
            if b in found:
                continue
            seen = line(travelled(mails[a], mails[b]), travelled(mails[b], mails[a]))
            if seen is not None:
                found[b] = _chained(found[a], *seen)
                waiting.append(b)
    for b, run in enumerate(runs):
        if b not in found:
            walls = run.wall_ahead_us(), runs[0].wall_ahead_us()
            found[b] = Clock(runs[0].opening.utime + walls[1] - walls[0])
    return [found[k] for k in range(len(runs))]


def _chained(a: Clock, a0: int, ahead_us: float, ppm: float) -> Clock:
    """The clock of b from that of a and `line`."""
    rate = (1 + a.ppm * 1e-6) * (1 + ppm * 1e-6)
    world = a.world(a0)
    offset = a0 + ahead_us - rate * world
    return Clock(round(offset), (rate - 1) * 1e6)


class Reach:
    """Who could hear whom, as it was recorded."""

    def __init__(self) -> None:
        self._times: dict[tuple[int, int], list[int]] = defaultdict(list)

    def add(self, a: int, clock: Clock, b: int, messages: Array) -> None:
        """Messages that travelled from a to b."""
        times = [clock.world(int(at)) for at in messages[:, 0]]
        self._times[a, b] = sorted(self._times[a, b] + times)

    def connects(self, a: int, b: int, t_us: int) -> bool:
        """Was anything of a heard by b about that time?"""
        times = self._times[a, b]
        at = bisect.bisect_left(times, t_us)
        near = times[max(at - 1, 0) : at + 1]
        return any(abs(time - t_us) < HEARD_WITHIN_US for time in near)
