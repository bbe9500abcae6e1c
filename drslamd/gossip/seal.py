"""Who made a message, and is it new: version, origin, epoch, counter and tag of every message.

The tag is a keyed BLAKE2b over channel and message with the tag field zero. The key is derived
from the team key and the origin, so a relay can hand a message on but not change it. A message is
judged in the order of cost, and nothing is remembered of it before its tag is proven and all else
in it was found good (`Seal.accept`):

    length, type, version, origin, time, own echo, epoch not older than the last one, counter not
    seen, tag; and a proven message under our own id that we did not send is another robot's.

Without a team key the tag is made with a key that everybody knows; it then only finds damage.
"""

from __future__ import annotations

import hmac
import struct
from dataclasses import dataclass
from enum import Enum
from hashlib import blake2b

from drslamd.conventions import LAST_UTIME, MAX_ROBOT_ID
from drslamd.gossip.epochs import FIRST_EPOCH
from drslamd.gossip.lc02 import MAX_PAYLOAD
from drslamd.gossip.replay_window import ReplayWindow

VERSION = 3
"""Of the set of types: 3 has chapters of chapters, and says gaps of logs in few bytes."""
KEY_BYTES = 32
TAG_BYTES = 8
"""A forger needs 2^63 tries, each of them a datagram."""
_HEADER = struct.Struct(f">8sbhqiq{TAG_BYTES}s")
"""LCM's fingerprint, then header_t in LCM's order (big-endian, packed)."""
_TAG_AT = _HEADER.size - TAG_BYTES
_PUBLIC_KEY = b"drslamd without a team key      "

LAST_COUNTER = 2**31 - 1
SPENT_COUNTER = LAST_COUNTER - 100_000
"""A start that has sent so many messages, three a second for 22 years, needs another epoch soon."""


class SealFault(Enum):
    TOO_SHORT = "message too short"
    TOO_LONG = "message too long"
    UNKNOWN_TYPE = "unknown message type"
    WRONG_VERSION = "other version of the messages"
    BAD_ORIGIN = "origin is no robot id"
    BAD_TIME = "made at a time that no clock shows"
    OWN = "own message"
    OWN_ID_USED = "another robot uses this id"
    OLD_EPOCH = "from before a restart of its origin"
    OTHER_START = "of another start of this robot, repeated by a peer"
    SEEN = "already seen"
    WRONG_TAG = "tag does not fit the team key"


@dataclass(frozen=True)
class Header:
    version: int
    origin: int
    epoch: int
    counter: int
    utime: int


def team_key(secret: bytes | None) -> bytes:
    """The key for `Seal`: the secret of the team, or the public one when there is none.

    Raises:
        ValueError: the secret has another length than `KEY_BYTES`.
    """
    if secret is None:
        return _PUBLIC_KEY
    if len(secret) != KEY_BYTES:
        raise ValueError(f"a team key has {KEY_BYTES} bytes, not {len(secret)}")
    return secret


def _tag(key: bytes, channel: str, message: bytes) -> bytes:
    digest = blake2b(digest_size=TAG_BYTES, key=key)
    digest.update(channel.encode("ascii") + b"\0" + message[:_TAG_AT] + bytes(TAG_BYTES))
    digest.update(message[_HEADER.size :])
    return digest.digest()


def _origin_key(key: bytes, origin: int) -> bytes:
    return blake2b(struct.pack(">h", origin), key=key, person=b"drslamd origin").digest()


def header_of(message: bytes, fingerprints: frozenset[bytes]) -> Header | SealFault:
    """What a message says of itself, nothing of it proven; or why it cannot be a robot's.

    Args:
        fingerprints: of the types that its channel may carry.
    """
    if len(message) < _HEADER.size:
        return SealFault.TOO_SHORT
    if len(message) > MAX_PAYLOAD:
        return SealFault.TOO_LONG
    fingerprint, *fields, _ = _HEADER.unpack_from(message)
    header = Header(*fields)
    if fingerprint not in fingerprints:
        return SealFault.UNKNOWN_TYPE
    if header.version != VERSION:
        return SealFault.WRONG_VERSION
    if not 0 <= header.origin <= MAX_ROBOT_ID:
        return SealFault.BAD_ORIGIN
    if not 0 <= header.utime <= LAST_UTIME:
        return SealFault.BAD_TIME
    return header


class Seal:
    """Closes our messages and judges those of others."""

    def __init__(self, key: bytes, robot: int, epoch: int, epochs: dict[int, int]) -> None:
        """
        Args:
            key: of `team_key`.
            robot, epoch: our own.
            epochs: last known epoch of each peer, as it was kept over our restart.
        """
        self._key = key
        self.robot = robot
        self.epoch = epoch
        self.epochs = dict(epochs)
        self._windows: dict[int, ReplayWindow] = {}
        self._counter = 0

    @property
    def has_spoken(self) -> bool:
        """Was any message made under this epoch?"""
        return self._counter > 0

    @property
    def is_spent(self) -> bool:
        """Will this epoch soon have no more counters?"""
        return self._counter > SPENT_COUNTER

    def header(self, utime: int) -> Header:
        """The header of our next message."""
        self._counter += 1
        return Header(VERSION, self.robot, self.epoch, self._counter, utime)

    def close(self, channel: str, message: bytes) -> bytes:
        """Fill in the tag of an encoded message."""
        tag = _tag(_origin_key(self._key, self.robot), channel, message)
        return message[:_TAG_AT] + tag + message[_HEADER.size :]

    def open(
        self, channel: str, message: bytes, fingerprints: frozenset[bytes], once: bool = True
    ) -> Header | SealFault:
        """Judge one message and remember it, when nothing else is to be found good in it.

        Args: as of `judge`.
        """
        verdict = self.judge(channel, message, fingerprints, once)
        if isinstance(verdict, Header):
            self.accept(verdict, once)
        return verdict

    def accept(self, header: Header, once: bool = True) -> None:
        """Remember a message that was judged good: from now on its start is the present one."""
        window = self._window(header)
        self.epochs[header.origin], self._windows[header.origin] = header.epoch, window
        if once:
            window.commit(header.counter)

    def judge(
        self, channel: str, message: bytes, fingerprints: frozenset[bytes], once: bool = True
    ) -> Header | SealFault:
        """Who made a message, or why it is not to be heard.

        Args:
            fingerprints: of the types that this channel may carry.
            once: False for messages whose own numbering makes a repetition harmless.
        """
        header = header_of(message, fingerprints)
        if isinstance(header, SealFault):
            return header
        ours = header.origin == self.robot
        if ours and header.epoch == self.epoch and header.counter <= self._counter:
            return SealFault.OWN
        if ours and not once:
            return SealFault.OTHER_START
        if header.epoch < self.epochs.get(header.origin, FIRST_EPOCH):
            return SealFault.OLD_EPOCH
        if once and not self._window(header).is_new(header.counter):
            return SealFault.SEEN
        if not self.is_proven(header, channel, message):
            return SealFault.WRONG_TAG
        return SealFault.OWN_ID_USED if ours else header

    def is_proven(self, header: Header, channel: str, message: bytes) -> bool:
        """Did somebody with the key make this message, whose header this is?"""
        proof = _tag(_origin_key(self._key, header.origin), channel, message)
        return hmac.compare_digest(message[_TAG_AT : _HEADER.size], proof)

    def _window(self, header: Header) -> ReplayWindow:
        """The window that a message belongs to; every epoch begins with an empty one."""
        if header.epoch != self.epochs.get(header.origin):
            return ReplayWindow()
        return self._windows.get(header.origin, ReplayWindow())
