"""How much a team may say again in a second, so that healing never crowds the channel.

Everybody counts what is on the air, its own messages and what it hears, so that those who heal a
partition or fill a newcomer share one allowance: in any second at most twice as much is said as
when nobody lacks anything. What is no repeat goes first: room is left for what is about to come,
foreseen from what came three seconds ago.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from enum import Enum

from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.gossip.message_types import Status
from drslamd.slam.graph.measurements import GraphEntry

FRAMING = 25
"""Bytes that LCM puts around each message: eight, and its channel."""
MOST = 2.0
"""Times as much as is said when nobody lacks anything: what is counted is a little uneven."""
LEAST_RATE, LEAST_EACH = 1_500, 700
"""Bytes a second of all messages that a team may say, however quiet it is; for each robot."""
LEAST_SHARE = 0.2
"""Of what may be said, for repeats: however much else there is, they go on."""
RESERVE = 0.02
"""Of repeats, for those who have few of them: what is lacked by few is there soon."""
MOST_LOSS = 0.8
"""That is reckoned with."""
REPEATED = 0.55
"""At a loss p, messages that one needs beyond itself until all have it, by p / (1 - p)^2."""
UNSURE = 1.2
"""At a loss p, this times p (1 - p) of repeats is left as well: whoever hears only some of them
does not know how many the others were, and all fill what room they see."""
BIN_US = SECOND_US // 10
PER_SECOND, PERIOD = 10, 30
"""Bins of a second, and of the three between two statuses."""
HEARTBEAT_US = 2_500 * MILLISECOND_US
"""A status that follows the last one so soon would not be said if nobody lacked anything."""
FLOOD = 2.0
"""Times as much as may be said: somebody does not keep to it."""


class Speech(Enum):
    """What a message is to the others."""

    NEW = 1
    STATUS = 2
    AGAIN = 3


def said_of(message: object, counter: int = 0, latest: int | None = 0) -> Speech:
    """What a message is.

    Args:
        counter: of the message.
        latest: counter of the last status or pose that was heard of its robot, None if none was. An
            entry made before that is said again; chapters are said late.
    """
    if not isinstance(message, GraphEntry):
        return Speech.STATUS if isinstance(message, Status) else Speech.NEW
    is_again = latest is None or counter < latest or message.chapter is not None
    return Speech.AGAIN if is_again else Speech.NEW


class _LastSecond:
    """Bytes of the last second."""

    def __init__(self) -> None:
        self._said: deque[tuple[int, float]] = deque()
        self._bytes = 0.0

    def add(self, utime: int, count: float) -> None:
        self._said.append((utime, count))
        self._bytes = self.bytes(utime) + count

    def bytes(self, utime: int) -> float:
        while self._said and utime - self._said[0][0] >= SECOND_US:
            self._bytes -= self._said.popleft()[1]
        return self._bytes


class _First:
    """Bytes of what goes before repeats; it comes again every three seconds or sooner."""

    def __init__(self) -> None:
        self._said: dict[int, float] = {}
        """By tenth of a second ..."""
        self._comes: dict[int, float] = {}
        """... all of it, and what comes again."""

    def add(self, utime: int, count: float, *, again: bool) -> None:
        """So many bytes; will they come again?"""
        now = utime // BIN_US
        if now not in self._said:
            for bins in (self._said, self._comes):
                for past in [past for past in bins if not 0 < now - past <= PERIOD]:
                    del bins[past]
        self._said[now] = self._said.get(now, 0.0) + count
        if again:
            self._comes[now] = self._comes.get(now, 0.0) + count

    def rate(self, utime: int) -> float:
        """Bytes a second of late that come again."""
        now = utime // BIN_US
        of_late = sum(n for past, n in self._comes.items() if 0 <= now - past < PERIOD)
        return of_late * PER_SECOND / PERIOD

    def busiest(self, utime: int) -> float:
        """The most bytes in any second that has this moment in it, as far as can be foreseen."""
        now, said, usual = utime // BIN_US, self._said.get, self._comes.get
        past = [said(at, 0.0) for at in range(now - PER_SECOND + 1, now)]
        come = [usual(at - PERIOD, 0.0) for at in range(now + 1, now + PER_SECOND)]
        total = sum(past) + max(said(now, 0.0), usual(now - PERIOD, 0.0))
        most = total
        for goes, comes in zip(past, come, strict=True):
            total += comes - goes
            most = max(most, total)
        return most


class Allowance:
    """How many bytes of repeats a team sends together.

    Where messages are lost it grows: entries then need several repeats, also when nobody lacks more
    than the latest ones.

    Attributes:
        loss: share of the messages that are lost, 0 to 1.
    """

    def __init__(self) -> None:
        self.loss, self._robots = 0.0, 1
        self._first, self._again = _First(), _LastSecond()
        """What is no repeat, and repeats."""
        self._heartbeats: dict[int, int] = {}
        """When a status of each robot came that was its usual one."""
        self._own_utime = 0
        """When a repeat of ours went out last."""

    def reckon(self, losses: Sequence[float]) -> None:
        """How much of what each peer says is lost; of a newcomer little is known."""
        self._robots = 1 + len(losses)
        self.loss = min(sorted(losses)[len(losses) // 2], MOST_LOSS) if losses else 0.0

    def on_air(
        self, size: int, utime: int, kind: Speech, sender: int, *, heard: bool = False
    ) -> None:
        """A message of so many bytes by a robot; of what is heard others were not."""
        count = (size + FRAMING) / (1 - self.loss) if heard else size + FRAMING
        if kind is Speech.AGAIN:
            self._again.add(utime, count)
            self._own_utime = self._own_utime if heard else utime
            return
        is_usual = kind is Speech.NEW or self._is_heartbeat(sender, utime)
        self._first.add(utime, count, again=is_usual)

    def _is_heartbeat(self, sender: int, utime: int) -> bool:
        last = self._heartbeats.get(sender)
        if last is not None and 0 <= utime - last < HEARTBEAT_US:
            return False
        self._heartbeats[sender] = utime
        return True

    def has_room(self, utime: int, size: int = 0, *, is_one_of_many: bool = False) -> bool:
        """May a repeat of so many bytes go out? Where others flood the channel, one each second."""
        needed = 1 + REPEATED * self.loss / (1 - self.loss) ** 2
        least = max(LEAST_RATE, LEAST_EACH * self._robots)
        most = max(MOST * self._first.rate(utime), least) * needed
        first, again = self._first.busiest(utime), self._again.bytes(utime)
        repeats = max(most - first, LEAST_SHARE * most)
        left = RESERVE + UNSURE * self.loss * (1 - self.loss)
        room = repeats * (1 - left) if is_one_of_many else repeats
        is_flooded = first + again > FLOOD * most
        is_waiting = utime - self._own_utime < SECOND_US
        return again + size + FRAMING <= room or (is_flooded and not is_waiting)
