"""tools/report: its page, its codes; what fails leaves the page of before."""

from __future__ import annotations

import errno
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lab.play import virtual_team
from lab.recordings import pyfg, world
from lab.report.__main__ import main
from recorded_teams import SHORT, WALL_US, record_team

SCENE = world.Scene(robots=2, seconds=6.0, odometry_hz=10, range_hz=10, both_measure=False)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "small.pyfg"
    pyfg.write(path, world.simulate(SCENE, 3), 0.06, np.array([0.002, 0.001, 0.005]))
    return path


def test_a_short_run_has_its_page(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    to = tmp_path / "new" / "page.html"
    assert main([str(recording), "--to", str(to)]) == 0
    assert capsys.readouterr().out == f"{to}\n"
    assert to.read_text().startswith("<!doctype html>")
    assert list(to.parent.iterdir()) == [to]


def test_without_a_name_it_is_that_of_the_recording(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([str(recording)]) == 0
    assert (tmp_path / "small.html").is_file()


def test_a_recording_that_cannot_be_used_leaves_the_page_of_before(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, bad = tmp_path / "page.html", tmp_path / "bad.pyfg"
    page.write_text("good")
    bad.write_text("EDGE_SE2 1\n")
    assert main([str(bad), "--to", str(page)]) == 66
    assert capsys.readouterr().err.startswith("bad.pyfg line 1: EDGE_SE2 has 1 fields")
    assert main([str(tmp_path / "gone.pyfg"), "--to", str(page)]) == 66
    assert page.read_text() == "good"


def test_a_fault_in_the_middle_leaves_the_page_of_before(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = tmp_path / "page.html"
    page.write_text("good")
    monkeypatch.setattr(virtual_team, "outcome", lambda _: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main([str(recording), "--to", str(page)])
    assert page.read_text() == "good"


def test_a_page_that_cannot_be_written_ends_with_73(
    recording: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    assert main([str(recording), "--to", str(tmp_path / "page.html")]) == 73
    assert "page.html: No space left on device; " in capsys.readouterr().err


def test_no_place_for_the_usual_page_is_said_before_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "run.html").mkdir()
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["run.pyfg"])
    assert ended.value.code == 2
    assert "run.html is a folder; name a file" in capsys.readouterr().err


def test_a_wrong_configuration_ends_with_78(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "x.toml").write_text('[optimizer]\nalgorithm = "magic"\n')
    assert main([str(recording), "--config", str(tmp_path / "x.toml")]) == 78
    assert "optimizer.algorithm" in capsys.readouterr().err


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a team recorded itself, and its truth beside it in UNIX time."""
    folder = tmp_path_factory.mktemp("own")
    played = world.simulate(replace(SHORT, seconds=30.0), 3)
    record_team(folder / "recordings", played)
    (folder / "truth").mkdir()
    for robot, trail in played.trails.items():
        rows = [
            f"{WALL_US / 1e6 + t:.6f} {x} {y} 0 0 0 {np.sin(th / 2)} {np.cos(th / 2)}"
            for t, (x, y, th) in zip(trail.t, trail.truth, strict=True)
        ]
        (folder / "truth" / f"robot_{robot}.tum").write_text("\n".join(rows))
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("has_truth", [True, False])
def test_what_robots_recorded_has_a_page_with_and_without_a_truth(
    has_truth: bool, own: Path, tmp_path: Path
) -> None:
    page = tmp_path / "page.html"
    truth = ["--truth", str(own / "truth")] if has_truth else []
    assert main([str(own / "recordings"), "--to", str(page), *truth]) == 0
    text = page.read_text()
    assert "<h1>recordings</h1>" in text
    assert ("<h2>Errors over time</h2>" in text) is has_truth
    assert "<h2>Residuals of ranges</h2>" in text
    assert "No robot was localised" not in text
