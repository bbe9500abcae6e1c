"""A computer that is too slow for its team: modules rest, and the robot says so."""

from __future__ import annotations

import numpy as np
import pytest
from teams import EASY, VirtualTeam

from drslamd.conventions import SECOND_US


@pytest.mark.row("O9")
@pytest.mark.parametrize(
    ("solve_ms", "cycle_s", "said"),
    [(100, 1.0, False), (390, 2.0, False), (560, 3.0, True)],
)
@pytest.mark.slow
def test_a_module_takes_a_fifth_of_a_core_at_most_and_names_its_pace(
    solve_ms: int, cycle_s: float, said: bool
) -> None:
    team = VirtualTeam(EASY, solve_us=1000 * solve_ms)
    team.run(50.0)
    poses = [t / SECOND_US for t, channel, _ in team.member(1).traces.sent if "POSE" in channel]
    assert np.median(np.diff(poses[-8:])) == pytest.approx(cycle_s, abs=0.25)
    sentence = f"optimizer runs every {5e-3 * solve_ms:.1f} s instead of every 1.0 s"
    assert (sentence in team.problems(1)) == said


@pytest.mark.slow
def test_on_a_network_that_is_too_slow_poses_wait_and_the_team_still_agrees() -> None:
    """Ten solutions a second and two kilobytes a second for each robot."""
    fast = "[optimizer]\nrate_hz = 10.0\n[relative_pose]\nrate_hz = 5.0\n"
    team = VirtualTeam(EASY, extra=fast + "[gossip]\nmax_bytes_per_s = 2000\n")
    for robot in range(3):
        outbox = team.member(robot).robot.outbox
        outbox._rate = 600
        outbox._bucket = 1200.0
    team.run(60.0)
    assert set(team.frames().values()) == {0}
    assert team.errors()["ate_rmse_m"] < 0.15
    assert team.member(1).robot.outbox.held_back["pose"] > 0
    assert "holds messages back" in team.problems(1)
