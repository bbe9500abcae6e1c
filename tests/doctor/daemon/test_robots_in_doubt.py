"""Poses that are contradicted."""

from __future__ import annotations

from patients import Case, found

from drslamd.doctor.daemon.robots_in_doubt import robots_in_doubt


def test_doubt_about_us_about_partners_and_of_others_about_themselves() -> None:
    case = Case()
    assert found(robots_in_doubt, case) == []
    case.say("doubt", "the pose is doubtful: odometry ...")
    case.say("partners", "ranges to robot 2 do not fit")
    case.now["peers"]["1"]["pose"] = "doubtful"
    said = found(robots_in_doubt, case)
    assert said[:2] == ["the pose is doubtful: odometry ...", "ranges to robot 2 do not fit"]
    assert said[2].startswith("robot 1 says that its own pose is doubtful")
    case.now["peers"]["1"]["alive"] = False
    assert len(found(robots_in_doubt, case)) == 2


def test_odometry_that_was_worse_is_told_with_what_to_do() -> None:
    case = Case()
    case.say("odometry", "odometry is some times as wrong as configured; wheels slip")
    assert found(robots_in_doubt, case) == [
        "odometry is some times as wrong as configured; wheels slip"
    ]
