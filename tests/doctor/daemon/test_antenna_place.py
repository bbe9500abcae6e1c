"""An antenna elsewhere than configured."""

from __future__ import annotations

import pytest
from patients import Case, found

from drslamd.doctor.daemon.antenna_place import antenna_place


@pytest.mark.parametrize(("place", "is_found"), [((0.06, 0.08), False), ((0.06, 0.09), True)])
def test_more_than_a_tenth_of_a_metre_is_a_finding(
    place: tuple[float, float], is_found: bool
) -> None:
    case = Case()
    case.now["graph"]["antenna_m"] = {"3": list(place)}
    said = found(antenna_place, case)
    assert bool(said) is is_found
    assert all("uwb.antenna_x_m = 0.06 and uwb.antenna_y_m = 0.09" in s for s in said)


def test_nothing_is_said_before_anything_is_learned() -> None:
    assert found(antenna_place, Case()) == []
