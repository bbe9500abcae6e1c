"""Two robots or modules with one id."""

from __future__ import annotations

from patients import Case, found

from drslamd.doctor.daemon.duplicate_id import duplicate_id


def test_either_is_an_error() -> None:
    case = Case()
    assert found(duplicate_id, case) == []
    case.say("team.uwb_id", "module 3 twice")
    case.say("team.own_id_used", "another robot uses id 3; give every robot its own")
    findings = list(duplicate_id(case.patient))
    assert [f.cause for f in findings] == ["another robot uses id 3", "module 3 twice"]
    assert {f.severity.value for f in findings} == {"error"}
