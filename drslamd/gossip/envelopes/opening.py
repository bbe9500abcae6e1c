"""A datagram is opened, in the order of cost: framing, seal, content, channel."""

from __future__ import annotations

from typing import NamedTuple, Union

from drslamd.events import ChannelMessage, Datagram
from drslamd.gossip import lc02, messages
from drslamd.gossip.messages import Message
from drslamd.gossip.seal import Header, Seal, SealFault, header_of
from drslamd.slam.graph.measurements import GraphEntry

_FINGERPRINTS = {kind: frozenset([value]) for kind, value in messages.FINGERPRINTS.items()}
_OF_ANOTHER_START = (SealFault.OLD_EPOCH, SealFault.OWN_ID_USED)


class Opened(NamedTuple):
    """A message that is proven to be of its origin.

    Attributes:
        payload: as it was sealed.
        fault: why it is not to be believed all the same: it is of another start than the latest
            of its robot, or of another robot under our id.
    """

    header: Header
    message: Message
    payload: bytes
    fault: SealFault | None


Outcome = Union[Opened, SealFault, str, None]
"""Or why it is to be refused; None for what is not meant for robots."""


def unframed(event: Datagram | ChannelMessage) -> tuple[str, bytes] | lc02.FramingFault:
    """Channel and payload, whether LCM has taken off its framing or we have to."""
    if isinstance(event, Datagram):
        return lc02.decode(event.data)
    return event.channel, event.payload


def opened(seal: Seal, event: Datagram | ChannelMessage) -> Outcome:
    """What came, proven and within its bounds. Nothing is remembered of it."""
    framed = unframed(event)
    if isinstance(framed, lc02.FramingFault):
        return framed.value
    channel, payload = framed
    kind = messages.kind_of_channel(channel)
    if channel.startswith(messages.NEAR_PREFIX):
        return None  # for whoever steers, not for robots
    if kind is None:
        return "channel of another program"
    once = kind != "GRAPH"
    verdict = seal.judge(channel, payload, _FINGERPRINTS[kind], once)
    fault = None
    if verdict in _OF_ANOTHER_START and once:
        # who else speaks under an id is told by what it says
        header = header_of(payload, _FINGERPRINTS[kind])
        if isinstance(header, Header) and seal.is_proven(header, channel, payload):
            fault, verdict = verdict, header
    if isinstance(verdict, SealFault):
        return verdict
    message = messages.decode(kind, payload)
    if isinstance(message, str):
        return "content out of range"
    if channel != messages.channel(kind, verdict.origin):
        return "channel of another robot"
    return Opened(verdict, message, payload, fault)


def entry_of(event: Datagram | ChannelMessage) -> tuple[GraphEntry, bytes] | None:
    """The entry of a log that it says it is, and as it was sealed; nothing of it is proven."""
    framed = unframed(event)
    if isinstance(framed, lc02.FramingFault):
        return None
    channel, payload = framed
    is_entry = messages.kind_of_channel(channel) == "GRAPH"
    entry = messages.decode("GRAPH", payload) if is_entry else None
    return (entry, payload) if isinstance(entry, GraphEntry) else None


def is_news_of_a_member(seal: Seal, data: bytes) -> bool:
    """Is it proven, and none that came before? Entries of logs, which may come again, are not."""
    framed = lc02.decode(data)
    if isinstance(framed, lc02.FramingFault):
        return False
    channel, payload = framed
    kind = messages.kind_of_channel(channel)
    if kind is None or kind == "GRAPH":
        return False
    return isinstance(seal.judge(channel, payload, _FINGERPRINTS[kind]), Header)
