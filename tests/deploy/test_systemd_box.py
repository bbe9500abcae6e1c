"""The service under a real systemd, installed as the read-me says.

systemd runs as PID 1 in namespaces of its own on an overlay of this machine (box.sh); it needs root
and a systemd, but none that runs. inside.sh acts, once for all tests; the tests look at the traces.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from deploy_helpers import REPOSITORY, lines_on_a_robot

pytestmark = pytest.mark.slow

HERE = Path(__file__).resolve().parent
LONGEST_HANG_S = 15


@pytest.fixture(scope="module")
def traces(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What inside.sh wrote."""
    if os.getuid() != 0:
        pytest.skip("only root can make the namespaces")
    if not Path("/lib/systemd/systemd").exists() or shutil.which("unshare") is None:
        pytest.skip("no systemd or no unshare here")
    share = tmp_path_factory.mktemp("box")
    shutil.copy(HERE / "inside.sh", share)
    packaged, cloned = lines_on_a_robot()
    (share / "install").write_text("\n".join(cloned[3:] + packaged[2:]))
    done = subprocess.run(
        [HERE / "box.sh", share, REPOSITORY, sys.base_prefix, sysconfig.get_path("purelib")],
        capture_output=True,
        text=True,
        timeout=150,
        check=False,
    )
    if not (share / "booted").exists():
        pytest.skip(f"systemd does not boot in a box here: {done.stderr.strip()[-200:]}")
    assert (share / "finished").exists(), (share / "inside.log").read_text()
    return share


def read(path: Path) -> str:
    return path.read_text().strip()


def test_it_runs_after_the_steps_of_the_read_me(traces: Path) -> None:
    assert read(traces / "active") == "active", read(traces / "install.log")
    assert read(traces / "others").split() == ["active", "active"]
    assert "not localised" in read(traces / "systemctl_status")


def test_its_files_belong_to_its_user_and_no_one_else(traces: Path) -> None:
    text = read(traces / "folders")
    assert re.search(r"srw-rw---- .* drslamd drslamd .* drslamd-3\.sock", text)
    assert re.search(r"-rw------- .* drslamd drslamd .* robot-3\.json", text)


def test_the_read_me_gives_the_key_to_the_service_alone(traces: Path) -> None:
    lines = read(traces / "configuration").splitlines()
    assert lines == [
        "/etc/drslamd 750 root:drslamd",
        "/etc/drslamd/3.toml 644 root:root",
        "/etc/drslamd/team.key 600 drslamd:drslamd",
    ]


def test_status_finds_the_service_from_an_ordinary_shell(traces: Path) -> None:
    assert read(traces / "status.log") == ""
    assert json.loads(read(traces / "status.json"))["robot"] == 3


def test_robots_on_one_host_hear_each_other_through_the_address_filter(traces: Path) -> None:
    peers = json.loads(read(traces / "status.json"))["peers"]
    assert peers["4"]["alive"]
    assert peers["4"]["hears_us"]
    assert "5" not in peers  # it has a key, robot 3 has none


def test_stopping_one_robot_leaves_the_sockets_of_the_others(traces: Path) -> None:
    assert read(traces / "stop_result") == "success"
    assert read(traces / "sockets_after_stop").split() == ["drslamd-3.sock", "drslamd-5.sock"]


@pytest.mark.parametrize(
    ("robot", "sentence"),
    [
        (6, "team.insecure = 6: "),
        (7, "team.key_file = '/etc/drslamd/foreign.key': Permission denied"),
    ],
)
def test_a_configuration_that_cannot_be_used_is_not_tried_again(
    traces: Path, robot: int, sentence: str
) -> None:
    assert read(traces / f"refused{robot}") == "failed 78 0"
    assert sentence in read(traces / f"refused{robot}.log")


@pytest.mark.row("O5")
def test_a_crash_is_followed_by_a_new_start(traces: Path) -> None:
    assert read(traces / "restarts_after_crash") == "1"


def test_a_hang_is_ended_by_the_watchdog_and_shown_in_the_journal(traces: Path) -> None:
    assert read(traces / "restarts_after_hang") == "1"
    assert int(read(traces / "hang_seconds")) <= LONGEST_HANG_S
    log = read(traces / "hang.log")
    assert "Fatal Python error: Aborted" in log
    assert "asyncio" in log
    assert log.count("event=daemon.start") == 2


@pytest.mark.parametrize(
    "what",
    [
        "numbers",
        "packages",
        "state folder",
        "configuration",
        "own key",
        "udp",
        "unix socket",
        "random numbers",
    ],
)
def test_the_sandbox_lets_it_work(traces: Path, what: str) -> None:
    assert probe(traces)[what] == "yes"


@pytest.mark.parametrize(
    "what",
    [
        "other devices",
        "kernel log",
        "etc",
        "shadow",
        "home",
        "raw packets",
        "netlink",
        "other processes",
        "more privileges",
    ],
)
def test_the_sandbox_refuses_what_it_does_not_need(traces: Path, what: str) -> None:
    assert probe(traces)[what] != "yes"


def probe(traces: Path) -> dict[str, str]:
    lines = [line for line in read(traces / "probe").splitlines() if line.startswith("{")]
    assert lines, read(traces / "probe")
    found: dict[str, str] = json.loads(lines[-1])
    return found


def test_networkd_understands_the_snippets_and_sets_the_route(traces: Path) -> None:
    log = read(traces / "networkd.log")
    complaints = [line for line in log.splitlines() if re.match(r"/etc/systemd/network/.*:", line)]
    assert len(complaints) == 1
    assert "BitRat" in complaints[0]  # the planted one: it does read them all
    assert read(traces / "route").startswith("224.0.0.0/4 dev wlan0")
