"""Modules and controllers that are not there: they print what the real ones print.

The layouts are written here once more, from the same protocol sheets as the decoders, so that a
mistake in a decoder does not hide behind the same mistake in its test.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from typing import Protocol

U32 = 0xFFFFFFFF

BlockProblem = tuple[int, float, bytes]
"""Peer, range in metres, the two bytes of its powers."""


def _summed(frame: bytes) -> bytes:
    return frame + bytes([sum(frame) & 0xFF])


def _int24(value: int) -> bytes:
    return (value & 0xFFFFFF).to_bytes(3, "little")


class LinkTrackEmulator:
    """A LinkTrack module in DR_MODE0 or DR_MODE1.

    Args:
        uwb_id: of this module.
        frame: 2 or 3 for DR_MODE0, 5 for DR_MODE1.
        power_up_s: how long it had been on when the recording starts.
    """

    def __init__(self, uwb_id: int, frame: int = 2, power_up_s: float = 17.0) -> None:
        self.uwb_id = uwb_id
        self._frame = {2: self._node2, 3: self._node3, 5: self._node5}[frame]
        self._power_up_ms = round(power_up_s * 1000)
        self.gap_db: Callable[[float, int], float] = lambda t, peer: 3.0
        """How much weaker the first path from a peer is than all that is received, at time t."""

    def reboot(self, t: float) -> None:
        """It begins anew at time t: its own clock is zero."""
        self._power_up_ms = -round(t * 1000)

    def frame(self, t: float, ranges: Sequence[tuple[int, float]]) -> bytes:
        """What it prints at time t (s of the common radio clock) for (peer, range m) blocks."""
        system = round(t * 1000) & U32
        blocks = [(peer, metres, self._signal(self.gap_db(t, peer))) for peer, metres in ranges]
        return self._frame(system, (system + self._power_up_ms) & U32, blocks)

    @staticmethod
    def _signal(gap_db: float) -> bytes:
        """Powers of the first path and of all, half a decibel each; the latter is -78 dB."""
        return bytes([156 + round(2 * gap_db), 156])

    def _node2(self, system: int, local: int, blocks: Sequence[BlockProblem]) -> bytes:
        head = struct.pack("<BBH BB I", 0x55, 4, 120 + 13 * len(blocks), 0, self.uwb_id, system)
        head += bytes(92) + struct.pack("<I", local) + bytes(10)
        head += struct.pack("<HB", 4900, len(blocks))
        for peer, metres, signal in blocks:
            head += struct.pack("<BB", 0, peer) + _int24(round(metres * 1000)) + signal
            head += struct.pack("<I", system) + bytes(2)
        return _summed(head)

    def _node3(self, system: int, local: int, blocks: Sequence[BlockProblem]) -> bytes:
        length = 22 + 7 * len(blocks)
        head = struct.pack("<BBH BB II", 0x55, 5, length, 0, self.uwb_id, local, system)
        head += bytes(4) + struct.pack("<HB", 4900, len(blocks))
        for peer, metres, signal in blocks:
            head += struct.pack("<BB", 0, peer) + _int24(round(metres * 1000)) + signal
        return _summed(head)

    def _node5(self, system: int, local: int, blocks: Sequence[BlockProblem]) -> bytes:
        length = 25 + 10 * len(blocks)
        head = struct.pack("<BBH BI II", 0x55, 8, length, 0, self.uwb_id, local, 0)
        head += bytes(4) + struct.pack("<HB", 4900, len(blocks))
        for peer, metres, signal in blocks:
            head += struct.pack("<BI", 0, peer) + _int24(round(metres * 1000)) + signal
        return _summed(head)


class WheelEmulator(Protocol):
    """A wheel controller on a serial line."""

    track_m: float
    """Distance of its wheels, as the configuration must say it."""

    def config(self, port: str) -> str:
        """The lines of the section ``[wheels]`` that fit it."""

    def stream(self, t: float, left_m: float, right_m: float) -> bytes:
        """What it prints by itself at time t (s), its wheels having gone so far."""

    def answer(self, asked: bytes) -> bytes:
        """What it prints when it is written to."""


class KobukiEmulator:
    """The base of a TurtleBot 2: streams 16-bit counters, and the angle of its gyro.

    Attributes:
        gyro: its angle at a time, rad; None where the base does not say it.
    """

    track_m = 0.230
    _per_metre = 11_724.4

    def __init__(self) -> None:
        self.gyro: Callable[[float], float | None] = lambda t: None

    def config(self, port: str) -> str:
        return f'source = "kobuki"\nport = "{port}"\n'

    def stream(self, t: float, left_m: float, right_m: float) -> bytes:
        left, right = (round(path * self._per_metre) & 0xFFFF for path in (left_m, right_m))
        core = struct.pack("<H3B2H", round(t * 1000) & 0xFFFF, 0, 0, 0, left, right) + bytes(6)
        payload = bytes([1, len(core)]) + core
        angle = self.gyro(t)
        if angle is not None:
            said = (round(math.degrees(angle) * 100) + 18_000) % 36_000 - 18_000
            payload += struct.pack("<2Bh5x", 4, 7, said)
        body = bytes([len(payload)]) + payload
        check = 0
        for byte in body:
            check ^= byte
        return b"\xaa\x55" + body + bytes([check])

    def answer(self, asked: bytes) -> bytes:
        return b""


class RoboteqEmulator:
    """A Roboteq controller: says nothing unless it is asked."""

    track_m = 0.40
    _per_metre = 20_000

    def __init__(self) -> None:
        self._counts = (0, 0)
        self._heard = b""
        self._echo = True

    def config(self, port: str) -> str:
        return (
            f'source = "roboteq"\nport = "{port}"\n'
            f"counts_per_metre = {self._per_metre}\ntrack_m = {self.track_m}\n"
        )

    def stream(self, t: float, left_m: float, right_m: float) -> bytes:
        self._counts = (round(left_m * self._per_metre), round(right_m * self._per_metre))
        return b""

    def answer(self, asked: bytes) -> bytes:
        self._heard += asked
        out = b""
        while b"\r" in self._heard:
            line, self._heard = self._heard.split(b"\r", 1)
            out += line + b"\r" if self._echo else b""
            if line == b"^ECHOF 1":
                self._echo = False
                out += b"+\r"
            elif line == b"?C":
                out += b"C=%d:%d\r" % self._counts
            elif line:
                out += b"-\r"
        return out


class AsciiEmulator:
    """A home-made controller that prints drslamd's own line."""

    track_m = 0.30
    _per_metre = 10_000

    def config(self, port: str) -> str:
        return (
            f'source = "ascii"\nport = "{port}"\n'
            f"counts_per_metre = {self._per_metre}\ntrack_m = {self.track_m}\n"
        )

    def stream(self, t: float, left_m: float, right_m: float) -> bytes:
        left, right = (round(path * self._per_metre) for path in (left_m, right_m))
        body = f"ODO,{round(t * 1000)},{left},{right}"
        check = 0
        for character in body.encode():
            check ^= character
        return f"${body}*{check:02X}\r\n".encode()

    def answer(self, asked: bytes) -> bytes:
        return b""


def as_heard_at(data: bytes, sent_baud: int, heard_baud: int) -> bytes:
    """What a receiver at another baud rate makes of bytes: it samples the same line, 8N1."""
    line = [1, 1]
    for byte in data:
        line += [0, *((byte >> k) & 1 for k in range(8)), 1]
    step = sent_baud / heard_baud
    line += [1] * int(12 * max(1.0, step))
    out, at = bytearray(), 0.0
    while at < len(line):
        if line[int(at)]:
            at += step / 8
            continue
        bits = [at + (k + 1.5) * step for k in range(8)]
        if bits[-1] >= len(line):
            break
        out.append(sum(line[int(b)] << k for k, b in enumerate(bits)))
        at += 9.5 * step
    return bytes(out)
