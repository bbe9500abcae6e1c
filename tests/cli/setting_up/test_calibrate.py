"""``drslamd calibrate``: from a push to the file, and to a robot that begins with it."""

from __future__ import annotations

import asyncio
import fcntl
import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest
from lab.play.emulators import AsciiEmulator, KobukiEmulator, LinkTrackEmulator, WheelEmulator
from places import REPOSITORY
from speaking_ports import PushedPort, SpeakingPort, while_speaking

from drslamd import cli
from drslamd.cli.exit_codes import ALREADY_RUNS, BAD_CONFIG, CANNOT_CREATE, FOUND, OK, USAGE
from drslamd.cli.parser import load
from drslamd.parts import taped_calibration
from drslamd.setup.calibration_file import read


def configured(folder: Path, base: WheelEmulator, wheels: str, uwb: str = "/dev/none") -> Path:
    path = folder / "3.toml"
    path.write_text(
        f'[robot]\nid = 3\n[team]\ninsecure = true\n[uwb]\nport = "{uwb}"\n'
        f"[wheels]\n{base.config(wheels)}"
    )
    return path


def calibrate(port: SpeakingPort, *words: str) -> tuple[int, str, str]:
    """Exit code, output and what is said beside it."""

    async def run() -> tuple[int, str, str]:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "drslamd", "calibrate", *words),
            cwd=REPOSITORY,
            env={**os.environ, "PYTHONPATH": str(REPOSITORY)},
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        assert process.stdout is not None
        assert process.stderr is not None
        said = ""
        async for line in process.stderr:
            said += line.decode()
            if isinstance(port, PushedPort):
                port.goes = port.goes or line == b"  go\n"
        out = await process.stdout.read()
        return await process.wait(), out.decode(), said

    return while_speaking([port], run)


@pytest.mark.slow
def test_a_push_becomes_a_file_that_the_robot_begins_with(tmp_path: Path) -> None:
    base = KobukiEmulator()
    port = PushedPort(tmp_path / "tty", base, (1.03, 1.03), 1.5)
    config = configured(tmp_path, base, port.path)
    code, out, err = calibrate(port, "push", "-c", str(config))
    assert code == OK, err
    assert "push it 1 m ahead" in err
    file = tmp_path / "3.calibration.toml"
    assert f'next: set robot.calibration = "{file}"' in out
    known = read(file.read_text()).push
    assert known is not None
    assert known.value == pytest.approx(1 - 1 / 1.03, abs=2e-4)
    assert known.sigma == pytest.approx(0.005 / 1.03, rel=0.02)
    config.write_text(config.read_text().replace("id = 3", f'id = 3\ncalibration = "{file.name}"'))
    assert taped_calibration(load(str(config))).scale == known


@pytest.mark.slow
def test_a_turn_and_a_wheel_that_runs_backwards_are_told_to_a_program(tmp_path: Path) -> None:
    base = AsciiEmulator()  # its track is 0.3 m
    port = PushedPort(tmp_path / "tty", base, (-1.0, 1.0), 1.5)
    config = configured(tmp_path, base, port.path)
    code, out, _ = calibrate(port, "turn", "-c", str(config), "--json")
    answer: dict[str, Any] = json.loads(out)
    assert code == OK
    (step,) = answer["steps"]
    assert step["turn"] == pytest.approx(2 * 3.14159265 / (2.0 / 0.3) - 1, abs=1e-3)
    before = Path(answer["file"]).read_text()
    port = PushedPort(tmp_path / "tty", base, (1.0, -1.0), 1.5)
    code, out, err = calibrate(port, "push", "-c", str(config), "--json")
    assert code == FOUND
    assert "set wheels.reverse_right = true" in json.loads(out)["fault"]
    assert err.splitlines()[-1].startswith("drslamd calibrate: push: the right wheel counts back")
    assert Path(answer["file"]).read_text() == before


@pytest.mark.slow
def test_antennas_at_a_taped_distance_have_a_bias(tmp_path: Path) -> None:
    module = LinkTrackEmulator(3)
    port = SpeakingPort(tmp_path / "tty", lambda t: module.frame(t, [(4, 3.12)]), 921_600)
    config = configured(tmp_path, KobukiEmulator(), "/dev/none", port.path)
    code, out, err = calibrate(
        port, "apart", "-c", str(config), "--peer", "4", "--within", "2", "-o", f"{tmp_path}/own"
    )
    assert code == OK, err
    assert "0.120 m too long" in out
    bias = read((tmp_path / "own").read_text()).biases[4]
    assert bias.value == pytest.approx(0.12)
    assert port.written == b""


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--metres", "2"], "--metres needs its step"),
        (["push", "--metres", "0.09"], "--metres 0.09: 0.1 to 50"),
        (["push", "--metres", "0"], "--metres 0: 0.1 to 50"),
        (["push", "--metres", "51"], "--metres 51: 0.1 to 50"),
        (["push", "--metres", "nan"], "--metres nan: 0.1 to 50"),
        (["turn", "--turns", "-1"], "--turns -1: 0.1 to 20"),
        (["turn", "--within", "601"], "--within 601: 0.1 to 600"),
        (["apart"], "--peer: the id of the other robot, 0 to 254"),
        (["apart", "--peer", "255"], "--peer: the id of the other robot, 0 to 254"),
        (["apart", "--peer", "3"], "--peer 3: that is this robot"),
        (["apart", "--peer", "2"], "measure on robot 2, with --peer 3"),
    ],
)
def test_what_cannot_be_meant_is_one_sentence(
    words: list[str], says: str, config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["calibrate", *words, "-c", str(config)]) == USAGE
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith("drslamd calibrate: ")
    assert says in said


def test_a_port_that_is_missing_ends_with_69_before_anything_is_written(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["calibrate", "-c", str(config)]) == 69
    said = capsys.readouterr().err.splitlines()[-1]
    assert said == "drslamd calibrate: push: /dev/none: No such file or directory"
    assert not (config.parent / "3.calibration.toml").exists()


def test_a_file_of_another_robot_is_not_written_over(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = config.parent / "3.calibration.toml"
    for text, says in (
        ("[robot]\nid = 5\n", f"{file}: it is of robot 5, not 3; name another with -o"),
        ("id = ", "; remove it and measure anew: drslamd calibrate"),
    ):
        file.write_text(text)
        assert cli.main(["calibrate", "push", "-c", str(config)]) == BAD_CONFIG
        (said,) = capsys.readouterr().err.splitlines()
        assert says in said
        assert file.read_text() == text


@pytest.mark.slow
def test_a_port_that_a_daemon_holds_ends_as_a_second_daemon_does(tmp_path: Path) -> None:
    base = KobukiEmulator()
    port = PushedPort(tmp_path / "tty", base, (1.0, 1.0), 1.5)
    config = configured(tmp_path, base, port.path)
    line = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(line, fcntl.LOCK_EX)
    try:
        code, _, err = calibrate(port, "-c", str(config))
    finally:
        os.close(line)
    assert code == ALREADY_RUNS
    assert err.splitlines()[-1].endswith("stop the daemon first: systemctl stop drslamd@3")


def test_a_place_that_cannot_be_written_is_said_before_anybody_pushes(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = config.parent / "none" / "file"
    assert cli.main(["calibrate", "-c", str(config), "-o", str(place)]) == CANNOT_CREATE
    (said,) = capsys.readouterr().err.splitlines()
    assert said.endswith("none: nothing can be written there; try sudo, or another -o")
