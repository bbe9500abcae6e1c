"""What `python -m lab.bound` prints."""

from __future__ import annotations

from dataclasses import replace

import pytest
from lab.bound import __main__ as command
from lab.bound import efficiency
from lab.reproduce.experiment import SCENE


def test_every_row_has_its_bound_and_who_is_told_all(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(efficiency, "SCENE", replace(SCENE, seconds=22.0, speed=0.5, range_hz=10))
    assert command.main(["--seeds", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "3 robots, 1 seeds: root mean squares"
    assert [line.split()[0] for line in lines[1:]] == ["hindsight"] * 2 + ["live"] * 2
    for line in lines[1:]:
        assert 0.01 < float(line.split()[-1]) < 100
