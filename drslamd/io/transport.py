"""What the daemon wants of a network, whoever provides it."""

from __future__ import annotations

from typing import Protocol


class Transport(Protocol):
    """Publishes LCM messages, and delivers those of others as events.

    Attributes:
        dropped: messages that the network did not take.
        flooded: datagrams that were not looked at, since their address sends too many.
        reads: how often it has read.
    """

    dropped: int
    flooded: int
    reads: int

    async def run(self) -> None:
        """Join, receive, join again after a fault; ends only by cancellation."""

    def descriptor(self) -> int:
        """What it reads from; -1 while there is nothing to read from."""

    def send(self, channel: str, payload: bytes) -> None:
        """Publish without waiting; what the network does not take is dropped and counted."""

    def complaint(self) -> str | None:
        """One sentence while the network is flooded, where that can be seen."""
