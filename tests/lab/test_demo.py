"""When the demo is satisfied, and what it says and ends with when it is not."""

from __future__ import annotations

import asyncio
import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lab import demo
from lab.play import real_team
from lab.recordings.recording import Recording
from lab.score import metrics, outcome
from lab.score.outcome import Outcome, dead_reckoning

FRAME = np.array([[7.0, -3.0, 2.0]])
SMALL = ["--robots", "2", "--seconds", "6"]


def scores_of(off_m: float, off_deg: float) -> dict[str, Any]:
    given = {"ate_rmse_m": 0.2, "rot_mean_deg": 3.0}
    return {
        "team": {"ate_rmse_m": off_m, "rot_mean_deg": off_deg},
        "odometry": {"team": given},
    }


def together() -> Outcome:
    return Outcome(frames={0: 0, 1: 0, 2: 0})


@pytest.mark.parametrize(("off_m", "off_deg"), [(0.0, 0.0), (0.2, 3.0), (0.2399, 3.599)])
def test_up_to_1_2_times_dead_reckoning_is_good(off_m: float, off_deg: float) -> None:
    assert demo.shortcomings(together(), scores_of(off_m, off_deg)) == []


@pytest.mark.parametrize(
    ("off_m", "off_deg", "words"),
    [
        (0.2401, 3.0, ["off by 0.240 m, more than 1.2 times the 0.200 m"]),
        (0.2, 3.601, ["off by 3.601 degrees, more than 1.2 times the 3.000 degrees"]),
        (9.0, 90.0, ["off by 9.000 m", "off by 90.000 degrees"]),
    ],
)
def test_more_than_that_is_named_with_both_figures(
    off_m: float, off_deg: float, words: list[str]
) -> None:
    faults = demo.shortcomings(together(), scores_of(off_m, off_deg))
    assert len(faults) == len(words)
    for fault, word in zip(faults, words, strict=True):
        assert fault.startswith(word)


@pytest.mark.parametrize("frames", [{0: 0, 1: 0, 2: 2}, {0: 0, 1: None}, {0: None, 1: None}])
def test_a_team_that_is_not_one_group_is_named(frames: dict[int, int | None]) -> None:
    (fault,) = demo.shortcomings(Outcome(frames=frames), scores_of(0.0, 0.0))
    assert fault.startswith("the team is not one group at the end; frame of each robot: {0: ")


class Played:
    """In the place of a real team: what it answered, and what it was given."""

    def __init__(self) -> None:
        self.recordings: list[Recording] = []
        self.share = 0.5
        """Of the error of dead reckoning that is left."""
        self.apart = False
        self.beside: Any = None
        self.failure = ""
        self.signal: signal.Signals | None = None

    async def run(self, recording: Recording, *_: Any, beside: Any = None, **__: Any) -> Outcome:
        self.recordings.append(recording)
        self.beside = beside
        if self.signal is not None:
            signal.raise_signal(self.signal)
            await asyncio.sleep(60)
        if self.failure:
            raise real_team.TeamFailed(self.failure)
        out = Outcome()
        for robot, poses in dead_reckoning(recording).items():
            trail = recording.trails[robot]
            left = trail.truth + self.share * (poses - trail.truth)
            frame = robot if self.apart else 0
            out.final[robot] = outcome.Path(
                trail.t, metrics.compose(FRAME, left), np.full(len(left), frame)
            )
            out.frames[robot] = frame
            out.bytes_sent[robot] = 100
        out.live = out.final
        return out


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> Played:
    team = Played()
    monkeypatch.setattr(real_team, "run", team.run)
    return team


def test_a_good_team_ends_with_0_a_table_a_picture_and_figures(
    played: Played, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    png, figures = tmp_path / "new" / "demo.png", tmp_path / "other" / "demo.json"
    assert demo.main([*SMALL, "--png", str(png), "--json", str(figures)]) == 0
    printed = capsys.readouterr().out
    for word in (
        "robot 0",
        "robot 1",
        "team",
        "dead reckoning (true start given)",
        "drslamd (no start given)",
        f"picture: {png}",
    ):
        assert word in printed
    assert "FAILED" not in printed
    assert png.read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    assert len(png.read_bytes()) > 10_000
    scores = json.loads(figures.read_text())
    assert scores["team"]["ate_rmse_m"] < scores["odometry"]["team"]["ate_rmse_m"]


def test_a_bad_team_ends_with_1(
    played: Played, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    played.share = 5.0
    assert demo.main([*SMALL, "--png", str(tmp_path / "demo.png")]) == 1
    assert "FAILED: off by" in capsys.readouterr().out


def test_a_team_in_pieces_ends_with_1_and_still_draws_what_there_is(
    played: Played, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    played.apart = True
    assert demo.main([*SMALL, "--png", str(tmp_path / "demo.png")]) == 1
    assert "FAILED: the team is not one group" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ["demo-failed.png"]


def test_a_run_that_failed_leaves_the_results_of_a_good_one(
    played: Played, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    png, figures = tmp_path / "demo.png", tmp_path / "demo.json"
    command = [*SMALL, "--png", str(png), "--json", str(figures)]
    assert demo.main(command) == 0
    good = png.read_bytes(), figures.read_bytes()
    played.share = 5.0
    assert demo.main(command) == 1
    assert (png.read_bytes(), figures.read_bytes()) == good
    assert f"picture: {tmp_path / 'demo-failed.png'}" in capsys.readouterr().out
    failed = json.loads((tmp_path / "demo-failed.json").read_text())
    assert failed["team"]["ate_rmse_m"] > json.loads(good[1])["team"]["ate_rmse_m"]


def test_a_daemon_that_failed_ends_with_70_and_its_last_words(
    played: Played, capsys: pytest.CaptureFixture[str]
) -> None:
    played.failure = "robot 1 ended:\nlast words"
    assert demo.main(SMALL) == 70
    assert "robot 1 ended:\nlast words" in capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_whoever_interrupts_it_is_told_in_one_sentence(
    played: Played, number: signal.Signals, capsys: pytest.CaptureFixture[str]
) -> None:
    played.signal = number
    assert demo.main(SMALL) == 130
    assert capsys.readouterr().err.strip() == (
        "interrupted: all daemons are stopped, nothing was written"
    )


def test_a_recording_that_cannot_be_used_ends_with_66_before_anything_starts(
    played: Played, capsys: pytest.CaptureFixture[str]
) -> None:
    assert demo.main(["--dataset", "/nowhere/run.pyfg"]) == 66
    assert capsys.readouterr().err == "/nowhere/run.pyfg: No such file or directory\n"
    assert not played.recordings


@pytest.mark.slow
def test_the_seed_the_robots_and_the_time_are_those_that_were_asked_for(
    played: Played, tmp_path: Path
) -> None:
    png = ["--png", str(tmp_path / "demo.png")]
    for seed in ("5", "5", "6"):
        demo.main([*SMALL, "--seed", seed, *png])
    one, again, other = played.recordings
    assert sorted(one.trails) == [0, 1]
    assert one.duration == pytest.approx(6.0, abs=0.1)
    assert np.array_equal(one.ranges, again.ranges)
    assert not np.array_equal(one.trails[0].truth, other.trails[0].truth)
    demo.main(["--seconds", "6", *png])
    assert sorted(played.recordings[-1].trails) == [0, 1, 2]


def test_the_live_map_runs_beside_the_team_only_when_it_is_asked_for(
    played: Played, tmp_path: Path
) -> None:
    png = ["--png", str(tmp_path / "demo.png")]
    demo.main([*SMALL, *png])
    assert played.beside is None
    demo.main([*SMALL, *png, "--view"])
    assert played.beside is demo.live_map


@pytest.mark.slow
def test_the_live_map_beside_the_team_says_its_address_and_ends_with_it(
    capfd: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("aiohttp", reason="aiohttp is not installed")

    async def go() -> None:
        async with demo.live_map(7667, http_port=0):
            for _ in range(100):
                await asyncio.sleep(0.1)
                said.append(capfd.readouterr().out)
                if "live map: http://127.0.0.1:" in "".join(said):
                    return

    said: list[str] = []
    asyncio.run(go())
    assert "live map: http://127.0.0.1:" in "".join(said)


def test_wrong_usage_ends_with_2_and_help_has_examples(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, code in ((["--robots", "many"], 2), (["--help"], 0)):
        with pytest.raises(SystemExit) as ended:
            demo.main(arguments)
        assert ended.value.code == code
    assert "tools/demo --dataset run.pyfg" in capsys.readouterr().out
