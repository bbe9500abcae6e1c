"""The service file: systemd accepts it, it gives away little, and it says what the daemon means."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import pytest
from deploy_helpers import EXAMPLE, LONGEST_STOP_S, REPOSITORY, lines_on_a_robot

from drslamd.cli import exit_codes
from drslamd.config import parse
from drslamd.machine import folders

UNIT = REPOSITORY / "systemd" / "drslamd@.service"
SYSUSERS = REPOSITORY / "systemd" / "drslamd.sysusers"
RULES = REPOSITORY / "etc" / "udev" / "60-drslamd.rules"
INSTALLED = "/opt/drslamd/bin/drslamd"
MAX_EXPOSURE_TENTHS = 20


def settings() -> dict[str, list[str]]:
    """Every value of every key, in the order of the file."""
    found = defaultdict(list)
    for line in UNIT.read_text().splitlines():
        key, equals, value = line.partition("=")
        if equals and not line.startswith("#"):
            found[key].append(value)
    return dict(found)


def analyze(*arguments: str) -> subprocess.CompletedProcess[str]:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("no systemd-analyze here")
    return subprocess.run(
        ["systemd-analyze", *arguments], capture_output=True, text=True, check=False
    )


def test_systemd_finds_nothing_to_complain_about(tmp_path: Path) -> None:
    copy = tmp_path / "drslamd@3.service"
    text = UNIT.read_text()
    assert INSTALLED in text
    copy.write_text(text.replace(INSTALLED, f"{sys.executable} -m drslamd"))
    done = analyze("verify", "--man=no", str(copy))
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_verify_would_have_found_a_misspelt_key(tmp_path: Path) -> None:
    copy = tmp_path / "drslamd@3.service"
    copy.write_text(UNIT.read_text().replace("WatchdogSec", "WatchDogSec"))
    assert "WatchDogSec" in analyze("verify", "--man=no", str(copy)).stderr


@pytest.mark.row("O14")
def test_the_exposure_is_at_most_two() -> None:
    options = ("security", "--offline=true", "--no-pager")
    done = analyze(*options, f"--threshold={MAX_EXPOSURE_TENTHS}", str(UNIT))
    if "unrecognized option" in done.stderr:
        pytest.skip("systemd-analyze security --offline came with systemd 250")
    assert done.returncode == 0, done.stdout.splitlines()[-1]
    assert analyze(*options, "--threshold=1", str(UNIT)).returncode != 0  # it does count in tenths


def test_systemd_does_not_restart_what_only_a_person_can_mend() -> None:
    unit = settings()
    assert unit["RestartPreventExitStatus"] == [f"{exit_codes.USAGE} {exit_codes.BAD_CONFIG}"]
    # a failed ExecStartPre= is restarted whatever its exit code (systemd issue 11868)
    assert "ExecStartPre" not in unit


def test_stopping_and_the_watchdog_leave_the_daemon_its_time() -> None:
    unit = settings()
    assert int(unit["TimeoutStopSec"][0]) >= 2 * LONGEST_STOP_S
    assert int(unit["WatchdogSec"][0]) == 10
    assert unit["Type"] == ["notify"]


def test_robots_on_one_host_share_folders_but_no_file(monkeypatch: pytest.MonkeyPatch) -> None:
    unit = settings()
    assert unit["StateDirectory"] == unit["RuntimeDirectory"] == ["drslamd"]
    assert unit["RuntimeDirectoryPreserve"] == ["yes"]
    monkeypatch.setenv("STATE_DIRECTORY", "/var/lib/drslamd")
    monkeypatch.setenv("RUNTIME_DIRECTORY", "/run/drslamd")
    text = EXAMPLE.read_text()
    robots = [parse(text.replace("\nid = 1 ", f"\nid = {number} ")) for number in (3, 4)]
    assert [str(folders.socket_path(robot)) for robot in robots] == [
        "/run/drslamd/drslamd-3.sock",
        "/run/drslamd/drslamd-4.sock",
    ]
    assert {str(folders.state_dir(robot)) for robot in robots} == {"/var/lib/drslamd"}


def test_the_user_of_the_service_is_the_one_that_sysusers_makes() -> None:
    unit = settings()
    lines = [line.split() for line in SYSUSERS.read_text().splitlines() if line[0] != "#"]
    assert unit["User"] == unit["Group"] == [lines[0][1]]
    assert lines[1] == ["m", lines[0][1], *unit["SupplementaryGroups"]]


def test_the_serial_drivers_of_the_udev_rules_are_allowed_and_loaded_before() -> None:
    unit = settings()
    allowed = [value.split() for value in unit["DeviceAllow"]]
    assert allowed == [[f"char-{name}", "rw"] for name in ("ttyUSB", "ttyACM", "ttyCH343USB")]
    # systemd looks a driver up when the service starts, and the plug may come later
    for key in ("Wants", "After"):
        loaded = re.findall(r"modprobe@(\w+)\.service", " ".join(unit[key]))
        assert loaded == ["usbserial", "cdc_acm", "ch343"]


def test_the_read_me_explains_every_exit_code() -> None:
    text = (UNIT.parent / "README.md").read_text()
    for code in (exit_codes.OK, exit_codes.USAGE, exit_codes.BAD_CONFIG, exit_codes.BUG):
        assert re.search(rf"^\| (\d+, )*{code} \|", text, re.MULTILINE), code
    assert INSTALLED in text


def test_the_lines_for_a_clone_install_every_file_and_the_program_that_the_unit_starts() -> None:
    text = "\n".join(lines_on_a_robot()[1])
    for path in (UNIT, SYSUSERS, EXAMPLE, RULES):
        assert f" {path.relative_to(REPOSITORY)} " in text
    assert f"ln -s {INSTALLED} " in text
    assert f"{Path(INSTALLED).parent}/pip install" in text
