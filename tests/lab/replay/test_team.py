"""A team plays its own recordings: as it was, and as it would have been with other keys."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lab.play import virtual_team
from lab.play.playback import equip, robot_config
from lab.play.simulator import Clock, Simulator
from lab.recordings import world
from lab.recordings.recording import Array, BadRecording
from lab.replay import scored, team
from lab.replay.runs import read_runs
from lab.replay.team import Team, configured, gathered, play
from lab.score import outcome
from recorded_teams import SHORT, WALL_US, record, record_team

from drslamd import report
from drslamd.config import ConfigError

RECORDING = world.simulate(SHORT, 3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("team")


@pytest.fixture(scope="module")
def live(folder: Path) -> Simulator:
    return record_team(folder, RECORDING)


@pytest.fixture(scope="module")
def own(folder: Path, live: Simulator) -> Team:
    return gathered(read_runs([folder]))


@pytest.fixture(scope="module")
def brief(tmp_path_factory: pytest.TempPathFactory) -> tuple[Team, Simulator]:
    """Twelve seconds, in which nobody is localised."""
    folder = tmp_path_factory.mktemp("brief")
    simulator = record_team(folder, RECORDING, until_s=12.0)
    return gathered(read_runs([folder])), simulator


def start_of(simulator: Simulator) -> Array:
    """Where robot 1 began, in the frame of robot 0 as robot 0 sees it."""
    estimate = simulator.members[0].robot.back.estimate
    assert estimate is not None
    return np.asarray(estimate.trajectories[1].poses[0])


@pytest.mark.slow
def test_the_clocks_of_a_team_are_those_that_it_had(own: Team, live: Simulator) -> None:
    zero = live.members[0].clock
    for run, found in zip(own.runs, own.clocks, strict=True):
        true = live.members[run.robot].clock
        for t_us in (0, 40_000_000):
            there = true.local(zero.world(own.clocks[0].local(t_us)))
            assert found.local(t_us) == pytest.approx(there, abs=2_500)


@pytest.mark.slow
def test_with_the_keys_that_it_had_it_comes_to_where_it_came(own: Team, live: Simulator) -> None:
    again = play(own)
    assert start_of(again) == pytest.approx(start_of(live), abs=0.02)
    assert sorted(again.members) == [0, 1]


@pytest.mark.slow
@pytest.mark.parametrize(
    "extra",
    ['[optimizer]\nalgorithm = "closures"\n', "[odometry]\nyaw_sigma_deg_per_m = 3.0\n"],
)
def test_another_configuration_changes_the_outcome_as_it_does_live(
    own: Team, live: Simulator, extra: str
) -> None:
    changed, again = virtual_team.play(RECORDING, extra=extra), play(own, extra)
    moved = np.abs(start_of(changed) - start_of(live)).max()
    assert moved > 0.05
    assert start_of(again) == pytest.approx(start_of(changed), abs=moved / 4)


@pytest.mark.slow
def test_what_would_have_made_it_blind_is_seen_and_said(own: Team) -> None:
    blind = play(own, "[uwb]\nmax_range_m = 0.5\n")
    for member in blind.members.values():
        said = report.status(member.robot, member.clock.local(blind.now))
        assert said["pose"] == {"state": "not localised"}
        assert said["uwb"]["counters"]["ranges.refused.LIMITS"] > 100


def test_a_change_is_one_of_the_keys_that_it_names(brief: tuple[Team, Simulator]) -> None:
    run = brief[0].runs[0]
    before, after = run.config(), configured(run, "[optimizer]\nrank = 7\n")
    assert after.optimizer.rank == 7
    same = after.model_copy(update={"optimizer": before.optimizer})
    assert same == before


@pytest.mark.parametrize(
    ("extra", "fault"),
    [
        ("[optimizer]\nrank = 1\n", "optimizer.rank = 1"),
        ("[optimiser]\nrank = 3\n", "optimiser = {...}: unknown key"),
        ("[optimizer\n", "not valid TOML"),
        ("robot = 3\n", "robot = 3"),
    ],
)
def test_a_change_that_cannot_be_used_names_its_key(
    brief: tuple[Team, Simulator], extra: str, fault: str
) -> None:
    with pytest.raises(ConfigError) as raised:
        configured(brief[0].runs[0], extra)
    assert raised.value.faults[0].startswith(fault)


@pytest.mark.slow
def test_messages_of_a_robot_that_has_no_recording_are_played_as_they_were(
    own: Team, folder: Path, live: Simulator
) -> None:
    (path,) = own.runs[1].files
    alone = play(gathered(read_runs([path])))
    assert list(alone.members) == [1]
    assert alone.members[1].robot.back.estimate is not None
    peer = alone.members[1].robot.team.peers[0]
    assert peer.received == live.members[1].robot.team.peers[0].received


def truth_of(shift_s: float = 0.0) -> dict[int, Array]:
    return {
        robot: np.column_stack([trail.t + WALL_US / 1e6 + shift_s, trail.truth])
        for robot, trail in RECORDING.trails.items()
    }


@pytest.mark.slow
def test_errors_against_a_truth_are_those_of_the_simulation(own: Team, live: Simulator) -> None:
    known = outcome.score(RECORDING, virtual_team.outcome(live))
    recording = scored.as_recording("own", own, live_in(own, live), truth_of())
    found = outcome.score(recording, virtual_team.outcome(live_in(own, live)))
    assert found["team"]["ate_rmse_m"] == pytest.approx(known["team"]["ate_rmse_m"], abs=0.01)
    given = found["odometry"]["team"]["ate_rmse_m"]
    assert given == pytest.approx(known["odometry"]["team"]["ate_rmse_m"], abs=0.03)


def live_in(own: Team, live: Simulator) -> Simulator:
    """The simulation with the clocks that were found."""
    for run, clock in zip(own.runs, own.clocks, strict=True):
        member = live.members[run.robot]
        live.members[run.robot] = replace(member, clock=clock)
    return live


@pytest.mark.parametrize(
    ("truth", "words"),
    [
        (truth_of(1e6), "of UNIX time: was a clock not set?"),
        ({0: truth_of()[0]}, "the truth has no robot 1, only 0"),
    ],
)
def test_a_truth_of_another_time_or_of_other_robots_is_refused(
    brief: tuple[Team, Simulator], truth: dict[int, Array], words: str
) -> None:
    with pytest.raises(BadRecording) as raised:
        scored.as_recording("own", *brief, truth)
    assert words in str(raised.value)


def test_without_recorded_computations_they_take_a_usual_time(
    brief: tuple[Team, Simulator], monkeypatch: pytest.MonkeyPatch
) -> None:
    own, _ = brief
    assert own.solve_us == 20_000
    monkeypatch.setattr(type(own.runs[0]), "records", lambda _: iter(()))
    assert team._median_us(own.runs) == team.SOLVE_US


def test_a_robot_that_was_started_again_begins_again(tmp_path: Path) -> None:
    simulator = Simulator()
    device = equip(RECORDING)[0]
    for start in (1, 2):
        member = simulator.add(robot_config(device), Clock(7_000_000), device, epoch=start)
        recorder = record(member, simulator, tmp_path)
        simulator.play(member, device.chunks()[:200] if start == 1 else [])
        simulator.run(3.0 * start)
        simulator.kill(member)
        recorder._flush()
        recorder._files.close()
    played = play(gathered(read_runs([tmp_path])))
    first, second = played._everyone
    assert (first.robot.own.epoch, second.robot.own.epoch) == (1, 2)
    assert (first.running, second.running) == (False, True)
    assert first.robot.front.reckoning.path_m > 0
    assert second.robot.front.reckoning.path_m == 0
