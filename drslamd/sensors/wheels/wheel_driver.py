"""What every source of wheel odometry has in common, whatever the base speaks.

A driver is a state machine without a clock: bytes or CAN frames in, samples out. It decodes a
message as a whole and checks it before it changes anything. What is wrong with a message is
counted in `tally`; only a wrong configuration raises, and only when the driver is made.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import Final, Protocol, Union, runtime_checkable

from drslamd.conventions import MILLISECOND_US, SECOND_US
from drslamd.events import CanFrame
from drslamd.sensors.device_clock import DeviceClock
from drslamd.sensors.samples import WheelSample
from drslamd.sensors.tally import Tally


class WheelRefusal(Enum):
    """Why a packet, line or CAN frame that is meant for us is not used."""

    MALFORMED = "not of the form that the protocol gives it"
    CHECKSUM = "a wrong checksum"
    OVERLONG = "a line longer than any that is meant for us"
    SHORT = "fewer bytes than its values take"
    NOT_FINITE = "a value that is not a finite number"
    TIME = "a time of the base that does not continue the one before"
    OLD_PROTOCOL = "a protocol of the base that is not supported"
    NOT_AVAILABLE = "a value that the base itself marks as not available"
    STANDING = "a position that stands while its speed says that the wheel turns"
    NO_ODOMETRY = "values of a way of driving that cannot be integrated"


Outcome = Union[list[WheelSample], WheelRefusal, None]
"""Of one packet, line or CAN frame: accepted with the samples that it completes, refused, or None
when it is meant for somebody else."""


def tallied(tally: Tally[WheelRefusal], outcome: Outcome) -> list[WheelSample]:
    """The samples of `outcome`, which is counted."""
    if isinstance(outcome, WheelRefusal):
        tally.refuse(outcome)
        return []
    if outcome is None:
        tally.ignored += 1
        return []
    tally.accepted += 1
    return outcome


MOST_WAITED_US: Final = SECOND_US
"""Between the first message of a base and the second; what was said before is of another time."""


class BaseTime:
    """Stamps on the clock of the host for a base that says its own time, in ms that wrap.

    The first message waits until the second one shows that its time goes on. It is not lost, unless
    the second comes late: the odometry, and so the frame of this robot, begins where the base said
    its first word. It counts as accepted.
    """

    def __init__(self, bits: int) -> None:
        self._clock = DeviceClock(bits, MILLISECOND_US)
        self._waiting: Callable[[int], list[WheelSample]] | None = None

    def stamped(
        self, time_ms: int, utime: int, samples: Callable[[int], list[WheelSample]]
    ) -> Outcome:
        """What a message completes that came at `utime` (us).

        Args:
            samples: those of this message, given when it was measured (us).
        """
        measured = self._clock.to_host(time_ms, utime)
        waited, self._waiting = self._waiting, None
        if measured is None:
            self._waiting = samples
            is_first = waited is None and self._clock.offset_us is None
            return [] if is_first else WheelRefusal.TIME
        first = self._clock.first_us
        if waited is None or first is None or measured - first > MOST_WAITED_US:
            return samples(measured)
        return [*waited(first), *samples(measured)]


class WheelDriver(Protocol):
    """Common to all drivers.

    Attributes:
        tally: packets, lines or CAN frames; ignored are those that are meant for somebody else.
        expects: what the driver looks for, in words for a person.
    """

    tally: Tally[WheelRefusal]
    expects: str

    def fault(self) -> str | None:
        """One sentence about what the base itself reports to be wrong, with a remedy, or None."""
        return None

    def why_no_sample(self, utime: int) -> str | None:
        """Asked when input has given no sample for a while: one sentence with a remedy, or None
        when it cannot be told from what was decoded."""
        return None

    def unpaired(self) -> int:
        """Values of one side that found none of the other side in time."""
        return 0


@runtime_checkable
class SerialDriver(WheelDriver, Protocol):
    """A base on a serial port that talks unasked."""

    def feed(self, data: bytes, utime: int) -> list[WheelSample]:
        """Samples that are complete now that `data` has arrived at `utime` (us)."""


@runtime_checkable
class PolledDriver(SerialDriver, Protocol):
    """A base on a serial port that has to be asked."""

    def poll(self, utime: int) -> bytes:
        """What has to be written at `utime` (us); empty when nothing is due."""


@runtime_checkable
class CanDriver(WheelDriver, Protocol):
    """A base on a CAN bus."""

    def on_frame(self, frame: CanFrame) -> list[WheelSample]:
        """Samples that `frame` completes."""
