"""What the codec of the module says, as an error with its age."""

from __future__ import annotations

from patients import Case, found

from drslamd.doctor.daemon.module_mode import module_mode


def test_what_the_daemon_says_of_the_module_is_an_error_and_says_since_when() -> None:
    case = Case()
    assert found(module_mode, case) == []
    case.say("uwb", "the UWB module is in LP mode; set it to DR_MODE0", since_s=90)
    (finding,) = module_mode(case.patient)
    assert finding.cause == "the UWB module is in LP mode"
    assert finding.remedy == "set it to DR_MODE0"
    assert (finding.severity.value, finding.since_s) == ("error", 90)
