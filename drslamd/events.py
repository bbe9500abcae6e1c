"""The nouns: what enters `Robot.handle` (events) and what leaves it (effects).

Everything that a robot learns arrives as one of the events below, with the time at which it
arrived; everything that it wants done leaves as an effect. Nothing else crosses the border, so a
journal of events is a complete recording and replaying it gives the same effects again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Literal, Union

Port = Literal["uwb", "wheels"]


class PortCondition(Enum):
    """What the shell found when it tried a port."""

    OPEN = "open"
    MISSING = "missing"
    DENIED = "no permission"
    BUSY = "in use by another program"
    UNFIT = "unfit"
    LOST = "lost"


# events


@dataclass(frozen=True)
class SerialData:
    """Bytes as they came from a serial port, stamped when they were read."""

    utime: int
    port: Port
    data: bytes


@dataclass(frozen=True)
class CanFrame:
    """One CAN data frame; `can_id` is without flag bits."""

    utime: int
    can_id: int
    extended: bool
    data: bytes


@dataclass(frozen=True)
class PortState:
    """A port was opened, refused or lost."""

    utime: int
    port: Port
    condition: PortCondition
    detail: str = ""


@dataclass(frozen=True)
class Datagram:
    """One UDP datagram of the team's multicast group, still in LCM's framing."""

    utime: int
    data: bytes
    sender: str = ""


@dataclass(frozen=True)
class ChannelMessage:
    """One LCM message whose framing the `lcm` package has already taken off."""

    utime: int
    channel: str
    payload: bytes
    sender: str = ""


@dataclass(frozen=True)
class NetworkState:
    """The multicast group was joined, or could not be."""

    utime: int
    up: bool
    detail: str = ""


@dataclass(frozen=True)
class Tick:
    """Time has passed; the shell sends one whenever `Robot.next_tick` is reached."""

    utime: int


@dataclass(frozen=True)
class Slept:
    """The computer was asleep for so long, until now; what comes next may have waited meanwhile."""

    utime: int
    asleep_us: int


@dataclass(frozen=True)
class JobDone:
    """The result of a `Solve` effect."""

    utime: int
    job_id: int
    result: Any
    elapsed_us: int


@dataclass(frozen=True)
class SaveDone:
    """The result of a `Save` effect: why nothing could be kept, empty when it was."""

    utime: int
    fault: str = ""


@dataclass(frozen=True)
class Stop:
    """The daemon is about to end."""

    utime: int


Event = Union[
    SerialData,
    CanFrame,
    PortState,
    Datagram,
    ChannelMessage,
    NetworkState,
    Tick,
    Slept,
    JobDone,
    SaveDone,
    Stop,
]

# effects


@dataclass(frozen=True)
class Send:
    """Publish one LCM message to the team."""

    channel: str
    payload: bytes


@dataclass(frozen=True)
class Write:
    """Write to a serial port (a controller that has to be asked; never a LinkTrack)."""

    port: Port
    data: bytes


@dataclass(frozen=True)
class Solve:
    """Run a pure computation off the loop and hand its result back as `JobDone`."""

    job_id: int
    name: str
    run: Callable[[], Any]


@dataclass(frozen=True)
class Save:
    """Keep this over a restart."""

    state: Mapping[str, Any]


@dataclass(frozen=True)
class Restart:
    """Forget everything and begin again under an epoch above this one; said until it is done."""

    above: int
    why: str


class Level(Enum):
    INFO = "info"
    WARNING = "warning"


@dataclass(frozen=True)
class Note:
    """One line for the log: a `noun.verb` and its fields."""

    level: Level
    event: str
    fields: Mapping[str, Any] = field(default_factory=dict)


Effect = Union[Send, Write, Solve, Save, Restart, Note]
