"""What a fuzzer throws bytes at: every decoder, and a whole robot. Each must take anything."""

from __future__ import annotations

import struct
from collections.abc import Callable
from contextlib import suppress
from functools import partial

from drslamd.config import ConfigError, parse
from drslamd.events import CanFrame, ChannelMessage, Datagram, Send, SerialData, Slept, Tick
from drslamd.gossip import lc02, messages
from drslamd.gossip.codecs import CODECS
from drslamd.gossip.entries.chapter_packing import packed, unpacked
from drslamd.gossip.seal import Seal
from drslamd.gossip.team import Team
from drslamd.recording.decoder import Decoder
from drslamd.recording.event_log import Entry
from drslamd.robot import Robot
from drslamd.sensors.linktrack.linktrack_input import LinkTrackInput
from drslamd.sensors.wheels.wheel_input import WheelInput
from drslamd.setup.calibration_file import UnusableCalibration, read
from lab.hunt.lies import Liar

Target = Callable[[bytes], None]

KEY = b"the key of a team that is fuzzed"
SECOND_US = 1_000_000
CHAPTER_SEQ = 300
"""Of the entry that a chapter is."""
HEAD = """
[robot]
id = 1
[team]
insecure = true
[uwb]
port = "/dev/none"
[wheels]
"""
WHEELS = {
    "kobuki": 'source = "kobuki"\nport = "/dev/none"\n',
    "roboteq": 'source = "roboteq"\nport = "/dev/none"\ncounts_per_metre = 1000\n'
    "track_m = 0.5\nmax_speed_mps = 2\n",
    "ascii": 'source = "ascii"\nport = "/dev/none"\ncounts_per_metre = 1000\n'
    "track_m = 0.5\nmax_speed_mps = 2\n",
    "wheeltec": 'source = "wheeltec"\nport = "/dev/none"\ntrack_m = 0.5\nmax_speed_mps = 2\n',
    "odrive": 'source = "odrive"\nwheel_radius_m = 0.1\n'
    "left_axis = 0\nright_axis = 1\ntrack_m = 0.5\nmax_speed_mps = 2\n"
    '[wheels.can]\nchannel = "can0"\n',
    "agilex": 'source = "agilex"\ntrack_m = 0.5\nmax_speed_mps = 2\n'
    '[wheels.can]\nchannel = "can0"\n',
}


class Accepted(AssertionError):
    """Something was believed that nobody had said."""


def datagram() -> Target:
    """A stranger's datagram to a team with a key."""
    team, clock = Team(Seal(KEY, 1, 1, {})), [0]

    def take(data: bytes) -> None:
        clock[0] += 10
        if team.receive(Datagram(clock[0], data, "10.0.0.66")) is not None or team.accepted:
            raise Accepted

    return take


def payload(kind: str) -> Target:
    """The content of a message, whose seal is good."""

    def take(data: bytes) -> None:
        message = messages.decode(kind, data)
        if not isinstance(message, str):
            # whatever is read can be said again
            messages.encode(Seal(KEY, 1, 1, {}).header(0), message)

    return take


def chapter(data: bytes) -> None:
    """What a chapter packs, before it is deflated: no bent byte survives that."""
    with suppress(ValueError, IndexError):
        packed(unpacked(data, CHAPTER_SEQ))


def uwb() -> Target:
    """Bytes of a LinkTrack."""
    module, clock = LinkTrackInput(1, 100.0), [0]

    def take(data: bytes) -> None:
        clock[0] += 20_000
        for sample in module.feed(data, clock[0]):
            if not -0.5 <= sample.range_m <= 100.0:
                raise Accepted

    return take


def wheels(source: str) -> Target:
    """Bytes or frames of a base."""
    section = parse(HEAD + WHEELS[source]).wheels
    base, clock = WheelInput(section), [0]
    is_can = "wheels.can" in WHEELS[source]

    def take(data: bytes) -> None:
        clock[0] += 20_000
        if is_can and len(data) >= 2:
            (can_id,) = struct.unpack_from(">H", data)
            base.on_frame(CanFrame(clock[0], can_id & 0x7FF, bool(can_id >> 15), data[2:66]))
        elif not is_can:
            base.feed(data, clock[0])

    return take


def recording() -> Target:
    """An entry of a recording."""
    decoder = Decoder()

    def take(data: bytes) -> None:
        name, _, rest = data.partition(b"\0")
        decoder.decode(Entry(0, 0, name.decode("latin-1"), rest))

    return take


def configuration(data: bytes) -> None:
    """A configuration file."""
    with suppress(ConfigError, UnicodeDecodeError):
        parse(data.decode())


def calibration(data: bytes) -> None:
    """A file of `drslamd calibrate`."""
    with suppress(UnusableCalibration, UnicodeDecodeError):
        read(data.decode())


def robot() -> Target:
    """Events of every kind to one robot; the first byte says which."""
    config = parse(HEAD + WHEELS["kobuki"])
    one, clock = Robot(config, KEY, 1, {}), [SECOND_US]
    channels = [messages.channel(kind, 2) for kind in CODECS]

    def take(data: bytes) -> None:
        kind, rest = data[0] if data else 0, data[1:]
        clock[0] += 20_000
        utime = clock[0]
        if kind < 64:
            one.handle(SerialData(utime, "uwb" if kind % 2 else "wheels", rest))
        elif kind < 128:
            one.handle(Datagram(utime, rest, "10.0.0.66"))
        elif kind < 192:
            one.handle(ChannelMessage(utime, channels[kind % len(channels)], rest, "10.0.0.66"))
        elif kind < 224:
            one.handle(Slept(utime, kind))
        else:
            one.handle(Tick(utime))
        if one.team.accepted:
            raise Accepted

    return take


def frame(data: bytes) -> None:
    """LCM's framing."""
    lc02.decode(data)


TARGETS: dict[str, Callable[[], Target]] = {
    "datagram": datagram,
    "lc02": lambda: frame,
    **{kind.lower(): partial(payload, kind) for kind in CODECS},
    "chapter": lambda: chapter,
    "uwb": uwb,
    **{source: partial(wheels, source) for source in WHEELS},
    "recording": recording,
    "configuration": lambda: configuration,
    "calibration": lambda: calibration,
    "robot": robot,
}
"""By the name on the command line; each call makes a fresh one."""


def seeds() -> list[bytes]:
    """Datagrams that a robot without our key sent, and chapters, for fuzzers to begin with."""
    foreign = Robot(parse(HEAD.replace("id = 1", "id = 2") + WHEELS["kobuki"]), bytes(32), 1, {})
    out = []
    for second in range(1, 4):
        for effect in foreign.handle(Tick(second * SECOND_US)):
            if isinstance(effect, Send):
                out.append(lc02.encode(second, effect.channel, effect.payload))
    teller = Liar(2, bytes(32))
    return out + [packed(teller.chapter(CHAPTER_SEQ)) for _ in range(3)]
