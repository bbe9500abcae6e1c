"""What `python -m lab.bound` prints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
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
        assert 0.01 < float(line.split()[-3]) < 100


def test_a_ratio_scatters_as_drives_do() -> None:
    """Of equal ones not at all; of means as much as means do."""
    same, none = command.jackknifed(np.array([[1.0, 2.0], [2.0, 4.0], [3.0, 6.0]]))
    assert (same, none) == pytest.approx((0.5, 0.0))
    values = np.array([1.0, 2.0, 4.0, 5.0])
    ratio, spread = command.jackknifed(np.stack([values, np.ones(4)], axis=1))
    assert ratio == pytest.approx(3.0)
    assert spread == pytest.approx(np.std(values, ddof=1) / 2)
    assert np.isnan(command.jackknifed(np.ones((1, 2)))[1])
