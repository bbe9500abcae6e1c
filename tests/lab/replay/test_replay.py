"""tools/replay and tools/evaluate on what robots recorded: what they print, what they end with."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from lab import evaluate
from lab.recordings import world
from lab.replay import __main__ as replay
from lab.replay.provenance import HERE, strangers
from recorded_teams import SHORT, WALL_US, record_team

from drslamd.io.recording.log_files import recordings
from drslamd.recording.event_log import Entry, entries, packed

RECORDING = world.simulate(SHORT, 3)
Printed = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Nine seconds, in which nobody is localised."""
    folder = tmp_path_factory.mktemp("short")
    record_team(folder, RECORDING, until_s=9.0)
    return folder


def test_check_ends_with_0_and_says_how_much_was_the_same(folder: Path, capsys: Printed) -> None:
    assert replay.main([str(folder), "--check"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(",")[0] for line in lines[::2]] == ["robot 0", "robot 1"]
    for line in lines[1::2]:
        assert line.startswith("  the same: ")
        assert line.endswith(" computations, bit for bit")


def test_without_it_the_last_status_is_shown(folder: Path, capsys: Printed) -> None:
    path = recordings(folder)[1]
    assert replay.main([str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(f"robot 1, {path.name}: 9.0 s in ")
    assert lines[1] == "  robot 1, epoch 1"
    assert any(line.startswith("  ! not localised: ") for line in lines)


def test_any_moment_before_the_end_can_be_looked_at(folder: Path, capsys: Printed) -> None:
    assert replay.main([str(recordings(folder)[0]), "--at", "6.5"]) == 0
    early = capsys.readouterr().out
    assert ": 6.5 s in " in early.splitlines()[0]
    assert replay.main([str(recordings(folder)[0])]) == 0
    assert capsys.readouterr().out.splitlines()[1:] != early.splitlines()[1:]


def test_a_difference_ends_with_1_and_its_time(
    folder: Path, tmp_path: Path, capsys: Printed
) -> None:
    path = recordings(folder)[0]
    with path.open("rb") as file:
        log = [entry for entry in entries(file) if isinstance(entry, Entry)]
    i = next(i for i, e in enumerate(log) if e.channel == "REC_SENT_000") + 1
    log[i] = log[i]._replace(data=log[i].data + b"!")
    log[0] = log[0]._replace(data=log[0].data.replace(HERE["numpy"].encode(), b"0.1"))
    data = b"".join(packed(e.number, e.utime, e.channel.encode(), e.data) for e in log)
    (tmp_path / path.name).write_bytes(data)
    assert replay.main([str(tmp_path), "--check"]) == replay.DIFFERS == 1
    _, differs, *why = capsys.readouterr().out.splitlines()
    assert differs.startswith("  differs at ")
    assert f"bytes on {log[i].channel}" in differs
    assert why == [f"  recorded with numpy 0.1, replayed with {HERE['numpy']}: bits may differ"]


def test_where_all_is_the_same_nobody_is_a_stranger() -> None:
    assert strangers(HERE) == []
    assert len(strangers({})) == len(HERE)


def test_what_if_shows_everybody_with_the_other_keys(
    folder: Path, tmp_path: Path, capsys: Printed
) -> None:
    (tmp_path / "short.toml").write_text("[uwb]\nmax_range_m = 0.01\n")
    assert replay.main([str(folder), "--config", str(tmp_path / "short.toml")]) == 0
    out = capsys.readouterr().out
    assert out.count(", what if:") == 2
    assert out.count("ranges.refused.LIMITS") == 2


def test_wrong_input_and_wrong_keys_have_their_codes(
    folder: Path, tmp_path: Path, capsys: Printed
) -> None:
    assert replay.main([str(tmp_path), "--check"]) == replay.NO_INPUT == 66
    assert "no robot-*.lcmlog in it" in capsys.readouterr().err
    wrong = tmp_path / "wrong.toml"
    wrong.write_text("[uwb]\nmax_range_m = -1\n")
    assert replay.main([str(folder), "--config", str(wrong)]) == replay.BAD_CONFIG == 78
    assert capsys.readouterr().err.startswith(f"{wrong}: uwb.max_range_m = -1")
    assert replay.main([str(folder), "--config", str(tmp_path / "none")]) == 66
    with pytest.raises(SystemExit) as ended:
        replay.main([str(folder), "--check", "--config", str(wrong)])
    assert ended.value.code == 2


def test_a_beginning_that_is_gone_is_said(folder: Path, tmp_path: Path, capsys: Printed) -> None:
    path = recordings(folder)[0]
    data = path.read_bytes().replace(b'"part": 0', b'"part": 4')
    (tmp_path / path.name.replace("-0000.", "-0004.")).write_bytes(data)
    assert replay.main([str(tmp_path), "--check"]) == 1
    assert "the first files of this run are gone" in capsys.readouterr().out


# tools/evaluate


def test_without_a_truth_it_says_why_nobody_is_localised(
    folder: Path, tmp_path: Path, capsys: Printed
) -> None:
    figures = tmp_path / "scores.json"
    assert evaluate.main([str(folder), "--json", str(figures)]) == 0
    out = capsys.readouterr().out
    assert out.startswith(
        "robot 0: not localised\nrobot 1: not localised\nrobot 0 is not localised"
    )
    assert re.search(r"^  for \d s: not localised: ", out, re.MULTILINE)
    assert "  with robot 1: not connected; windows: " in out
    scores = json.loads(figures.read_text())
    assert scores["team"] is None
    assert scores["robots"]["1"] == {"pose": {"state": "not localised"}}


@pytest.mark.slow
def test_with_a_truth_it_gives_the_scores_of_any_recording(tmp_path: Path, capsys: Printed) -> None:
    record_team(tmp_path / "logs", RECORDING)
    (tmp_path / "mocap").mkdir()
    for robot, trail in RECORDING.trails.items():
        rows = np.column_stack([trail.t + WALL_US / 1e6, trail.truth])
        name = tmp_path / "mocap" / f"robot_{robot}.csv"
        np.savetxt(name, rows, delimiter=",", header="t,x,y,theta", comments="", fmt="%.6f")
    figures = tmp_path / "scores.json"
    arguments = [str(tmp_path / "logs"), "--truth", str(tmp_path / "mocap")]
    assert evaluate.main([*arguments, "--json", str(figures)]) == 0
    scores = json.loads(figures.read_text())
    assert scores["team"]["ate_rmse_m"] < 0.15
    assert f"{scores['team']['ate_rmse_m']:.3f}" in capsys.readouterr().out
    shutil.rmtree(tmp_path / "mocap")
    assert evaluate.main(arguments) == evaluate.NO_INPUT
    assert "mocap" in capsys.readouterr().err


def test_the_key_of_a_team_is_asked_for(folder: Path, tmp_path: Path, capsys: Printed) -> None:
    for path in recordings(folder):
        data = path.read_bytes().replace(b'"insecure": true', b'"insecure":false')
        data = data.replace(b'"key_file": ""', b'"key_file":"k"')
        (tmp_path / path.name).write_bytes(data)
    assert evaluate.main([str(tmp_path)]) == evaluate.NO_INPUT
    assert "was made with a team key, which no recording holds" in capsys.readouterr().err
