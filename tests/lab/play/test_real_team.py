"""A team of real processes that does not come to be."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from lab.play.real_team import RealRobot, RealTeam, TeamFailed
from lab.recordings import world


async def asleep(robot: RealRobot) -> None:
    """In the place of a daemon: a process that stays until it is stopped."""
    robot.process = await asyncio.create_subprocess_exec("sleep", "60")


async def unready(robot: RealRobot) -> None:
    """The second one does not answer."""
    if robot.hardware.robot == 1:
        raise TeamFailed("robot 1 did not start")


def test_where_one_daemon_does_not_start_nobody_and_nothing_is_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(RealRobot, "start", asleep)
    monkeypatch.setattr(RealRobot, "ready", unready)

    async def begin() -> tuple[Path, list[int | None]]:
        team = RealTeam(world.simulate(world.Scene(2, 5), 0))
        with pytest.raises(TeamFailed, match="robot 1"):
            async with team:
                pass
        processes = [robot.process for robot in team.robots.values()]
        return team.folder, [process.returncode for process in processes if process]

    folder, codes = asyncio.run(begin())
    assert codes == [-15, -15]
    assert not folder.exists()
