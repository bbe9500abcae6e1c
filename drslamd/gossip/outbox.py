"""A budget of bytes for what one robot sends, so that no team talks a slow network to death.

A bucket fills with `max_bytes_per_s` and holds two seconds of it. Its lower part is kept for what
the team needs most: a message goes out only when the bucket is fuller than what its kind must
leave. What is held back is counted and said, and none of it is lost for good: peers ask again for
log entries and for odometry, and the next pose replaces the last.
"""

from __future__ import annotations

from collections import Counter, deque

from drslamd.conventions import SECOND_US
from drslamd.events import Send
from drslamd.gossip import messages

BUCKET_S = 2.0
LEAVES = {
    "STATUS": 0.0,
    "GRAPH": 0.2,
    "ODOMETRY": 0.4,
    "POSE": 0.6,
    "PUBLIC": 0.6,
    "HYPOTHESES": 0.8,
}
"""What each kind leaves in the bucket, as a share of it: the least useful stops first."""
RELAYED = 0.8
"""Entries of another robot's log, which somebody else may also repeat."""
SPOKEN_OF_US = 10 * SECOND_US
"""How long after something was held back it is still spoken of."""


class Outbox:
    """Lets messages through while the budget lasts, and counts them.

    Attributes:
        messages_sent, bytes_sent: with the framing of LCM.
        held_back: messages that the budget stopped, by kind.
    """

    def __init__(self, robot: int, max_bytes_per_s: int) -> None:
        self._robot = robot
        self._rate = max_bytes_per_s
        self._bucket = BUCKET_S * max_bytes_per_s
        self._utime: int | None = None
        self.messages_sent = 0
        self.bytes_sent = 0
        self.held_back: Counter[str] = Counter()
        self._stopped: deque[int] = deque(maxlen=1)

    def passes(self, send: Send, utime: int) -> bool:
        """May this message go out now?"""
        full = BUCKET_S * self._rate
        since = 0 if self._utime is None else max(0, utime - self._utime)
        self._utime = utime
        self._bucket = min(full, self._bucket + self._rate * since / SECOND_US)
        kind = messages.kind_of_channel(send.channel) or "NEAR"
        is_ours = send.channel == messages.channel(kind, self._robot)
        leaves = LEAVES.get(kind, RELAYED) if is_ours else RELAYED
        size = 8 + len(send.channel) + 1 + len(send.payload)
        if self._bucket - size < leaves * full:
            self.held_back[kind.lower()] += 1
            self._stopped.append(utime)
            return False
        self._bucket -= size
        self.messages_sent += 1
        self.bytes_sent += size
        return True

    def condition(self, utime: int) -> str | None:
        """One sentence while messages are held back."""
        if not self._stopped or utime - self._stopped[0] > SPOKEN_OF_US:
            return None
        kinds = ", ".join(f"{count} {kind}" for kind, count in self.held_back.most_common())
        return (
            f"gossip.max_bytes_per_s = {self._rate} holds messages back ({kinds} so far): "
            "estimates come later; allow more if the network can carry it"
        )
