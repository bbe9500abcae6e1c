"""tools/evaluate on a small recording in virtual time: codes, table and the schema."""

from __future__ import annotations

import contextlib
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lab import evaluate
from lab.play import real_team
from lab.recordings import pyfg, world
from lab.recordings.recording import Recording
from lab.score.outcome import Outcome

SCENE = world.Scene(
    robots=2,
    seconds=45.0,
    ranges=world.RangeModel(bias=0.05, slow=0.03, burst_share=0.0),
    odometry=world.OdometryModel(scale=0.01, yaw_deg_per_m=0.05),
    odometry_hz=20,
    range_hz=10,
    both_measure=False,
)
ATE = {"ate_rmse_m", "ate_mean_m", "ate_std_m"}
ROTATION = {"rot_mean_deg", "rot_std_deg", "rot_mean_centred_deg"}
PARTS = {"robots", "team", "live", "odometry", "pairs", "closures", "bytes_sent", "ms"}
PAIR = {"trans_median_m", "rot_median_deg", "trans_mean_m", "rot_mean_deg"}


@dataclass
class Run:
    code: int
    printed: str
    scores: dict[str, Any]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("evaluate") / "small.pyfg"
    pyfg.write(path, world.simulate(SCENE, 3), 0.06, np.array([0.002, 0.001, 0.005]))
    return path


@pytest.fixture(scope="module")
def run(recording: Path) -> Run:
    """The whole command, once."""
    figures = recording.parent / "new" / "scores.json"
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(io.StringIO()):
        code = evaluate.main([str(recording), "--json", str(figures)])
    return Run(code, printed.getvalue(), json.loads(figures.read_text()))


def test_it_ends_with_0_and_a_table(run: Run) -> None:
    assert run.code == 0
    rows = {line[:8].strip(): line for line in run.printed.splitlines()}
    for name, key in (("robot 0", "0"), ("robot 1", "1")):
        for scores in (run.scores, run.scores["odometry"]):
            assert f"{scores['robots'][key]['ate_rmse_m']:.3f}" in rows[name]
            assert f"{scores['robots'][key]['rot_mean_deg']:.2f}" in rows[name]
    assert f"{run.scores['team']['ate_rmse_m']:.3f}" in rows["team"]


def test_the_scores_have_the_fields_of_the_schema_and_no_others(run: Run) -> None:
    scores = run.scores
    assert set(scores) == {"recording"} | PARTS
    assert scores["recording"] == "small.pyfg"
    assert set(scores["live"]) == set(scores["odometry"]) == {"robots", "team"}
    for part in (scores, scores["live"], scores["odometry"]):
        assert set(part["robots"]) == {"0", "1"}
        for errors in (*part["robots"].values(), part["team"]):
            assert set(errors) == ATE | ROTATION
            assert all(isinstance(value, float) for value in errors.values())
    assert set(scores["pairs"]) == {"0-1"}
    assert set(scores["pairs"]["0-1"]) == PAIR
    assert set(scores["closures"]) == {"seen", "kept"}
    assert set(scores["bytes_sent"]) == {"0", "1"}
    modules = {"relative_pose", "what_if", "consistency", "optimizer", "points"}
    assert set(scores["ms"]) == modules
    assert all(set(module) == {"median", "p99"} for module in scores["ms"].values())


def test_the_figures_are_what_such_a_team_reaches(run: Run) -> None:
    scores = run.scores
    assert 0 < scores["team"]["ate_rmse_m"] < 0.10
    assert scores["team"]["rot_mean_deg"] < 3.0
    assert scores["live"]["team"]["ate_rmse_m"] < 0.5
    assert 0 < scores["pairs"]["0-1"]["trans_median_m"] < 0.3
    assert 0 < scores["closures"]["kept"] <= scores["closures"]["seen"]
    assert all(1_000 < sent < 1_000_000 for sent in scores["bytes_sent"].values())
    assert all(0 < module["median"] <= module["p99"] for module in scores["ms"].values())


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("gone.pyfg", None, "No such file or directory"),
        ("run.bag", "x", "readers exist for .pyfg"),
        (
            "bad.pyfg",
            "VERTEX_SE2 1 A0\n",
            "bad.pyfg line 1: VERTEX_SE2 has 2 fields; t key x y yaw belong",
        ),
    ],
)
def test_a_recording_that_cannot_be_used_ends_with_66_and_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, text: str | None, sentence: str
) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    assert evaluate.main([str(tmp_path / name)]) == 66
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1


def test_a_config_that_is_not_there_ends_with_66(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert evaluate.main([str(recording), "--config", "/nowhere/rbcd.toml"]) == 66
    assert "/nowhere/rbcd.toml" in capsys.readouterr().err


def test_a_config_with_a_fault_ends_with_78_and_its_sentence(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "bad.toml"
    config.write_text("[optimizer]\nrate_hz = -1\n")
    assert evaluate.main([str(recording), "--config", str(config)]) == 78
    assert capsys.readouterr().err.startswith("optimizer.rate_hz = -1: ")


def test_in_real_time_it_asks_the_real_team_and_ends_with_70_when_that_fails(
    recording: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async def fail(played: Recording, *_: Any, **__: Any) -> Outcome:
        raise real_team.TeamFailed(f"robot 1 of {played.name} did not start")

    monkeypatch.setattr(real_team, "run", fail)
    assert evaluate.main([str(recording), "--speed", "real"]) == 70
    assert capsys.readouterr().err.endswith("robot 1 of small.pyfg did not start\n")


@pytest.mark.parametrize("arguments", [[], ["run.pyfg", "--speed", "slow"], ["run.pyfg", "--jsn"]])
def test_wrong_usage_ends_with_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        evaluate.main(arguments)
    assert ended.value.code == 2
    assert "usage: tools/evaluate" in capsys.readouterr().err


def test_help_has_examples(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        evaluate.main(["--help"])
    assert ended.value.code == 0
    assert "tools/evaluate run.pyfg --json scores.json" in capsys.readouterr().out
