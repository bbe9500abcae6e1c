"""Messages both ways."""

from __future__ import annotations

import pytest
from patients import Case, found

from drslamd.doctor.daemon.peers_heard import peers_heard


def test_a_peer_that_does_not_hear_us() -> None:
    case = Case()
    assert found(peers_heard, case) == []
    case.now["peers"]["1"]["hears_us"] = False
    (said,) = found(peers_heard, case)
    assert "robot 1 is heard but does not hear this one" in said
    assert "firewall" in said


@pytest.mark.parametrize(("loss", "is_found"), [(0.3, False), (0.31, True)])
def test_a_loss_beyond_which_a_team_suffers(loss: float, is_found: bool) -> None:
    case = Case()
    case.now["peers"]["1"]["loss"] = loss
    assert bool(found(peers_heard, case)) is is_found


@pytest.mark.parametrize(("age_s", "is_found"), [(30.0, False), (31.0, True)])
def test_a_robot_that_fell_silent_is_told_with_its_silence(age_s: float, is_found: bool) -> None:
    case = Case()
    case.now["peers"]["1"] |= {"alive": False, "age_s": age_s}
    findings = list(peers_heard(case.patient))
    assert [f.since_s for f in findings] == ([31] if is_found else [])


def test_a_network_that_is_down_is_an_error() -> None:
    case = Case()
    case.say("network", "cannot send on wlan0: the interface is down; bring it up")
    (finding,) = peers_heard(case.patient)
    assert finding.severity.value == "error"
