"""Messages that are not taken."""

from __future__ import annotations

from patients import Case, found

from drslamd.doctor.daemon.team_key import team_key


def test_each_reason_is_told() -> None:
    case = Case()
    assert found(team_key, case) == []
    keys = ["team.recording", "team.wrong_tag", "team.wrong_version", "team.beyond_clocks"]
    for key in keys:
        case.say(key, key)
    assert found(team_key, case) == keys
