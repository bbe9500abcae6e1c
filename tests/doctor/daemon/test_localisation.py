"""Why there is no pose."""

from __future__ import annotations

from patients import Case, found

from drslamd.doctor.daemon.localisation import localisation


def test_the_reason_stands_before_what_the_next_start_will_miss() -> None:
    case = Case()
    assert found(localisation, case) == []
    case.say("state", "cannot write robot-3.json")
    case.say("pose", "not localised: no ranges")
    assert found(localisation, case) == ["not localised: no ranges", "cannot write robot-3.json"]
