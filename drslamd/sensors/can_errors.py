"""What the error frames of a CAN bus say: is it off, does anybody understand anything on it?

Source: linux/can/error.h. An error frame names in its id the classes of what went wrong; with an
overflow of the controller, its second byte says so. Other adapters send error frames without that.
"""

from __future__ import annotations

from typing import Final

from drslamd.conventions import SECOND_US

_CONTROLLER: Final = 0x04
_BUS_OFF: Final = 0x40
_OVERRUN: Final = 0x01
"""In the second byte of a frame of `_CONTROLLER`: frames came faster than they were taken."""
MOST_ERRORS: Final = 20
"""Error frames without a frame between them after which nobody is understood."""
WELL_US: Final = 5 * SECOND_US
"""Frames without an error for so long, and a bus is well again; a bus that has a loose contact
is then said to be lost twelve times a minute and no more."""

OFF: Final = (
    "the controller is off the bus (bus-off) after too many errors: compare the bitrates, check "
    "both wires and the resistors at the ends; ip link set NAME type can restart-ms 100 lets it "
    "come back by itself"
)
ONLY_ERRORS: Final = (
    "nothing but error frames: is its bitrate that of the base, are both wires right and has each "
    "end a resistor of 120 ohm?"
)


class CanErrors:
    """Of one bus, while it is open.

    Attributes:
        frames: error frames so far.
        overruns: of them such that say that frames were lost.
        trouble: what is wrong now, empty when nothing is.
    """

    def __init__(self, *, has_classes: bool) -> None:
        """
        Args:
            has_classes: do ids of error frames name classes, as those of SocketCAN do?
        """
        self._has_classes = has_classes
        self._in_a_row = 0
        self._last_utime = 0
        self.frames = self.overruns = 0
        self.trouble = ""

    def begin(self) -> None:
        """The bus was opened: what was wrong with it is forgotten, what was counted is not."""
        self._in_a_row, self.trouble = 0, ""

    def on_error(self, can_id: int, data: bytes, utime: int) -> None:
        """An error frame came at `utime` (us)."""
        self.frames += 1
        self._in_a_row += 1
        self._last_utime = utime
        if self._has_classes and can_id & _CONTROLLER and len(data) > 1 and data[1] & _OVERRUN:
            self.overruns += 1
        if self._has_classes and can_id & _BUS_OFF:
            self.trouble = OFF
        elif self._in_a_row >= MOST_ERRORS and not self.trouble:
            self.trouble = ONLY_ERRORS

    def counters(self) -> dict[str, int]:
        """Everything that is counted, by flat names."""
        return {"bus.error_frames": self.frames, "bus.overruns": self.overruns}

    def on_frame(self, utime: int) -> None:
        """A frame of somebody came at `utime` (us)."""
        self._in_a_row = 0
        if self.trouble and utime - self._last_utime >= WELL_US:
            self.trouble = ""
