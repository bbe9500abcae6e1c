"""One run of every scenario of the bench, and that the bench would see what it looks for."""

from __future__ import annotations

import pytest
from lab.soak.faults import FAULTS
from lab.soak.run import run
from lab.soak.scenarios import FEWEST, MIXED, MOST, SCENARIOS, mixed


@pytest.mark.slow
@pytest.mark.parametrize("name", list(SCENARIOS))
def test_after_every_event_of_a_scenario_all_promises_are_kept(name: str) -> None:
    result = run(name, 1, journal=False)
    assert not result.fault, result.line


@pytest.mark.slow
def test_the_same_seed_sends_the_same_bytes_and_fresh_robots_answer_the_same() -> None:
    one, other = (run(MIXED, 3, until_s=40.0) for _ in range(2))
    assert one.digest == other.digest
    assert not one.fault
    assert run(MIXED, 4, until_s=10.0).digest != run(MIXED, 3, until_s=10.0).digest


def test_a_mixture_is_three_to_six_faults_and_its_seed_draws_them() -> None:
    for seed in range(50):
        faults = mixed(seed).faults
        assert FEWEST <= len(faults) <= MOST
        assert len({name for name, _ in faults}) == len(faults)
        assert all(dose in FAULTS[name].doses for name, dose in faults)
        assert mixed(seed) == mixed(seed)
    assert {len(mixed(seed).faults) for seed in range(50)} == {3, 4, 5, 6}


def test_every_fault_has_a_scenario_of_its_own() -> None:
    assert {s.faults[0][0] for s in SCENARIOS.values() if len(s.faults) == 1} == set(FAULTS)
