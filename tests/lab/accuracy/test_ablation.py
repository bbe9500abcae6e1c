"""Doing without one piece: every one of them is really run."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import pytest
from lab.accuracy.__main__ import NO_INPUT, main
from lab.accuracy.ablation import PIECES, Piece
from lab.play import virtual_team
from lab.play.playback import equip
from lab.play.simulator import Simulator
from lab.recordings import world

from drslamd import report

ALL = Piece("everything as it is")
SCENE = world.Scene(
    robots=2,
    seconds=32.0,
    width=5.0,
    height=5.0,
    ranges=world.RangeModel(bias=0.4, burst_share=0.1),
    odometry=world.OdometryModel(scale=0.1),
    range_hz=10,
    odometry_hz=10,
)
"""Everything is wrong enough, and near enough, for each piece to matter."""


def played(piece: Piece, optimizer: str = "banded") -> Simulator:
    recording = world.simulate(SCENE, 5)
    hardware = equip(recording)
    for device in hardware.values():
        # a wall, for 2 s of every 5
        device.uwb.gap_db = lambda t, peer: 12.0 if math.fmod(t, 5.0) < 2.0 else 3.0
    extra = f'[optimizer]\nalgorithm = "{optimizer}"\n{piece.toml}'
    return virtual_team.play(recording, 5, None, extra, hardware, tuning=piece.tuning)


def said(simulator: Simulator) -> str:
    """What the first robot makes of it."""
    robot = simulator.members[0].robot
    return repr([report.trajectories(robot, 0), report.closures(robot)])


@cache
def with_everything() -> str:
    return said(played(ALL))


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in PIECES if name != "gnc"])
def test_without_a_piece_the_team_comes_to_another_answer(name: str) -> None:
    without = played(PIECES[name])
    assert without.members[0].robot.back.estimate is not None
    assert said(without) != with_everything()


def test_without_gnc_closures_are_believed_as_module_2_left_them() -> None:
    simulator = played(PIECES["gnc"], "closures")
    assert simulator.members[0].robot.back.estimate is not None


@pytest.mark.slow
def test_the_same_run_comes_to_the_same_answer() -> None:
    """So what differs above differs because of the piece."""
    assert said(played(ALL)) == with_everything()


def test_a_section_in_both_is_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "other.toml"
    config.write_text("[relative_pose]\ndelta = 0.2\n")
    with pytest.raises(SystemExit) as end:
        main([str(tmp_path), "--without", "nlos", "--config", str(config)])
    assert end.value.code == 2
    assert "[relative_pose]" in capsys.readouterr().err
    assert main([str(tmp_path), "--without", "narrow-priors"]) == NO_INPUT
