"""Set-ups with which the daemon starts and waits: `check` warns of what a run then says first."""

from __future__ import annotations

import pytest
from setup_faults import Fault, faults_that_are_waited_for
from setup_scenes import give_away, healthy, nobody

FAULTS = faults_that_are_waited_for()


def test_of_a_set_up_in_good_order_nothing_is_said() -> None:
    with healthy() as setup:
        assert setup.check() == setup.run() == (0, [])


@pytest.mark.parametrize("fault", FAULTS, ids=[fault.name for fault in FAULTS])
def test_what_a_run_waits_for_is_a_warning_with_the_same_cause(
    fault: Fault, monkeypatch: pytest.MonkeyPatch
) -> None:
    with healthy() as setup:
        if fault.as_nobody:
            give_away(setup)
        fault.make(setup, monkeypatch)
        if fault.as_nobody:
            with nobody():
                checked, ran = setup.check(), setup.run()
        else:
            checked, ran = setup.check(), setup.run()
    assert checked.code == ran.code == fault.code == 0
    assert fault.cause in checked.first
    assert fault.remedy in checked.first
    assert ran.first.startswith(checked.first.partition("; ")[0])
