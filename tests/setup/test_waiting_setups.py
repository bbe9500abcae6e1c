"""Set-ups with which the daemon starts and waits: `check` warns of what a run then says first."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import setup_scenes
from namespace import hindrance
from setup_faults import Fault
from setup_scenes import give_away, healthy, nobody
from setup_waits import faults_that_are_waited_for

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


def test_interfaces_that_are_down_or_without_address_or_cable_in_a_network_of_their_own() -> None:
    if hindrance():
        pytest.skip(hindrance())
    script = Path(setup_scenes.__file__).with_name("setup_in_namespace.py")
    done = subprocess.run(
        ["unshare", "-rnm", sys.executable, str(script)],
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert done.returncode == 0, done.stdout + done.stderr
