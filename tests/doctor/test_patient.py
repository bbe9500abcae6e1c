"""Rates and conditions out of two answers."""

from __future__ import annotations

from patients import SECONDS, Case

from drslamd.doctor.patient import Patient, number, warning


def test_a_rate_is_a_difference_and_a_counter_that_is_new_began_at_nothing() -> None:
    case = Case()
    case.grow("uwb", "counters", "frames.refused.TIME", by=8)
    assert case.patient.rate("uwb", "counters", "frames.refused.TIME") == 8 / SECONDS
    assert case.patient.rate("uwb", "counters", "nowhere") == 0
    still = Patient(case.patient.config, case.before, case.now, 0.0)
    assert still.rate("uwb", "counters", "bytes") == 0


def test_what_is_no_number_is_none() -> None:
    assert number({"a": {"b": 3}}, ("a", "b")) == 3
    assert number({"a": "text"}, ("a",)) == number({"a": 1}, ("a", "b")) == 0


def test_conditions_become_findings_with_their_age() -> None:
    case = Case()
    case.say("load", "slow; faster", since_s=5)
    (finding,) = case.patient.told("check", "load", "budget")
    assert (finding.cause, finding.remedy, finding.since_s) == ("slow", "faster", 5)
    assert warning("a", "b", "c").severity is finding.severity
