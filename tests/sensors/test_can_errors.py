"""Error frames of a CAN bus: what they say, from when on, and when it is over."""

from __future__ import annotations

import pytest

from drslamd.conventions import SECOND_US
from drslamd.sensors.can_errors import MOST_ERRORS, OFF, ONLY_ERRORS, WELL_US, CanErrors

BUS_OFF, CONTROLLER, ACKNOWLEDGEMENT = 0x40, 0x04, 0x20
"""Classes, as linux/can/error.h numbers them."""


def spoken_of(*ids: int, has_classes: bool = True) -> CanErrors:
    errors = CanErrors(has_classes=has_classes)
    for can_id in ids:
        errors.on_error(can_id, bytes(8), 0)
    return errors


@pytest.mark.row("D9")
def test_a_controller_that_is_off_the_bus_is_named_at_once() -> None:
    assert spoken_of(BUS_OFF).trouble == OFF
    assert spoken_of(BUS_OFF | CONTROLLER).trouble == OFF
    assert spoken_of(ACKNOWLEDGEMENT).trouble == ""
    assert spoken_of(*[ACKNOWLEDGEMENT] * MOST_ERRORS, BUS_OFF).trouble == OFF


def test_of_an_adapter_whose_error_frames_have_no_classes_their_ids_say_nothing() -> None:
    assert spoken_of(BUS_OFF, has_classes=False).trouble == ""


@pytest.mark.row("D9")
@pytest.mark.parametrize(("count", "said"), [(MOST_ERRORS - 1, ""), (MOST_ERRORS, ONLY_ERRORS)])
def test_many_errors_in_a_row_are_a_bus_that_nobody_understands(count: int, said: str) -> None:
    assert spoken_of(*[ACKNOWLEDGEMENT] * count).trouble == said
    assert spoken_of(*[0x7F] * count, has_classes=False).trouble == said


def test_errors_between_good_frames_are_counted_and_no_more() -> None:
    errors = CanErrors(has_classes=True)
    for k in range(3 * MOST_ERRORS):
        errors.on_error(ACKNOWLEDGEMENT, bytes(8), k)
        errors.on_frame(k)
    assert errors.trouble == ""
    assert errors.counters() == {"bus.error_frames": 3 * MOST_ERRORS, "bus.overruns": 0}


@pytest.mark.parametrize(("after_us", "is_well"), [(WELL_US - 1, False), (WELL_US, True)])
def test_a_bus_is_well_when_there_was_no_error_for_a_while(after_us: int, is_well: bool) -> None:
    errors = CanErrors(has_classes=True)
    errors.on_error(BUS_OFF, bytes(8), 3 * SECOND_US)
    errors.on_frame(3 * SECOND_US + after_us)
    assert (errors.trouble == "") is is_well


@pytest.mark.parametrize(
    ("can_id", "data", "count"),
    [
        (CONTROLLER, b"\0\x01" + bytes(6), 1),
        (CONTROLLER, b"\0\x02" + bytes(6), 0),
        (ACKNOWLEDGEMENT, b"\0\x01" + bytes(6), 0),
        (CONTROLLER, b"\0", 0),
    ],
)
def test_frames_that_the_controller_lost_are_counted(can_id: int, data: bytes, count: int) -> None:
    errors = CanErrors(has_classes=True)
    errors.on_error(can_id, data, 0)
    assert errors.overruns == count
    without = CanErrors(has_classes=False)
    without.on_error(can_id, data, 0)
    assert without.overruns == 0


def test_a_bus_that_is_opened_anew_begins_well_and_goes_on_counting() -> None:
    errors = spoken_of(BUS_OFF, *[ACKNOWLEDGEMENT] * (MOST_ERRORS - 2))
    errors.begin()
    errors.on_error(ACKNOWLEDGEMENT, bytes(8), 0)
    assert (errors.trouble, errors.frames) == ("", MOST_ERRORS)
