"""Set-ups with which the daemon does not start: `check` and `run` say the same, the cause first."""

from __future__ import annotations

import pytest
from setup_faults import Fault, faults_that_are_refused
from setup_scenes import give_away, healthy, nobody

FAULTS = faults_that_are_refused()


@pytest.mark.parametrize("fault", FAULTS, ids=[fault.name for fault in FAULTS])
def test_the_cause_stands_first_with_its_remedy_and_a_run_agrees(
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
    assert checked.code == ran.code == fault.code
    assert checked.first == ran.first
    assert fault.cause in checked.first
    assert fault.remedy in checked.first
    assert "Traceback" not in "".join(checked.lines)
