"""The long drive of the lab, short: a graph that is thinned after seconds."""

from __future__ import annotations

import numpy as np
import pytest
from lab.recordings import world
from lab.score.outcome import Outcome, Path
from lab.trust import long_drive

from drslamd.slam.tuning import DEFAULTS, Tuning


def test_old_errors_are_those_of_the_relative_pose() -> None:
    """Both robots a quarter turned and moved together; then one of them 0.3 m to its left."""
    recording = world.simulate(world.Scene(robots=2, seconds=90.0, odometry_hz=10), 1)
    said = {}
    for robot, trail in recording.trails.items():
        x, y, theta = trail.truth.T
        turned = np.stack([3 - y, x + 5, theta + np.pi / 2], axis=-1)
        said[robot] = Path(trail.t, turned, np.zeros(len(trail.t)))
    assert long_drive.old_errors(recording, Outcome(final=said), 80.0) == pytest.approx((0, 0))
    left = said[0].poses + 0.3 * np.column_stack(
        [-np.sin(said[0].poses[:, 2]), np.cos(said[0].poses[:, 2]), np.zeros(len(said[0].t))]
    )
    moved = {**said, 0: Path(said[0].t, left, said[0].frame)}
    metres, degrees = long_drive.old_errors(recording, Outcome(final=moved), 80.0)
    assert metres == pytest.approx(0.3, rel=1e-3)
    assert degrees == pytest.approx(0, abs=1e-6)


@pytest.mark.slow
def test_a_drive_that_was_thinned_all_the_while_is_nearly_as_right(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Keyframes stay for 32 s, so that after two minutes cells are 16 s long."""
    monkeypatch.setattr(long_drive, "OLD_S", 60.0)
    thinned = long_drive.drive(1, 180.0, Tuning(recent_s=32))
    whole = long_drive.drive(1, 180.0, long_drive.EVERYTHING)
    assert thinned.metres != whole.metres
    assert thinned.metres < 1.5 * whole.metres
    assert 0.1 < thinned.nees < 2.0
    assert np.abs([thinned.sigmas, whole.sigmas]).max() < 3.5


def test_figures_say_what_was_not_reached(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def drive(seed: int, seconds: float, tuning: Tuning = DEFAULTS) -> long_drive.Driven:
        metres = 0.2 if tuning is long_drive.EVERYTHING else 0.22
        degrees = 1.0 if tuning is long_drive.EVERYTHING else 1.3
        return long_drive.Driven(metres, degrees, 0.9, np.array([1.0, -2.0]))

    monkeypatch.setattr(long_drive, "drive", drive)
    assert long_drive.main(["--seeds", "1", "2"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert ["NOT REACHED" in line for line in lines] == [False, True, False, False, True]
    assert "1.100" in lines[0]
    assert "1.581" in lines[4]
