"""``drslamd record``: a log of everybody, from a computer that is no robot."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import lcm
import pytest
from transport_helpers import GROUP, free_port

from drslamd import cli
from drslamd.cli import exit_codes, record
from drslamd.config import GossipSection
from drslamd.gossip import lc02
from drslamd.io.multicast import open_group

Printed = pytest.CaptureFixture[str]


def test_it_writes_until_it_is_stopped_and_says_what_was_heard(tmp_path: Path) -> None:
    port, path = free_port(), tmp_path / "run.lcmlog"
    arguments = ["record", str(path), "--interface", "127.0.0.1", "--port", str(port)]
    process = subprocess.Popen(
        [sys.executable, "-m", "drslamd", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    first = process.stderr.readline()
    assert first == f"listening to {GROUP}:{port} on 127.0.0.1, Ctrl-C ends\n"

    with open_group(GossipSection(port=port, interface="127.0.0.1", ttl=0)) as talker:
        end = time.monotonic() + 10
        while not path.stat().st_size and time.monotonic() < end:
            talker.sendto(lc02.encode(1, "DRSLAM_POSE_001", b"x"), (GROUP, port))
            time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=10)
    assert process.returncode == 0
    assert err == ""
    log = lcm.EventLog(str(path), "r")
    events = list(log)
    log.close()
    assert {event.channel for event in events} == {"DRSLAM_POSE_001"}
    assert out == f"{len(events):>8} DRSLAM_POSE_001\n"


def test_a_file_that_is_there_ends_with_73(tmp_path: Path, capsys: Printed) -> None:
    (tmp_path / "log").touch()
    assert cli.main(["record", str(tmp_path / "log")]) == exit_codes.CANNOT_CREATE == 73
    assert capsys.readouterr().err == f"{tmp_path}/log: is there already; give another name\n"
    code = cli.main(["record", str(tmp_path / "no" / "log"), "--interface", "127.0.0.1"])
    assert code == 73
    assert f"No such file or directory; make its folder first: mkdir -p {tmp_path}/no" in (
        capsys.readouterr().err
    )


def test_an_interface_that_is_not_there_ends_with_69(tmp_path: Path, capsys: Printed) -> None:
    code = cli.main(["record", str(tmp_path / "log"), "--interface", "wlan77"])
    assert code == exit_codes.UNAVAILABLE == 69
    said = capsys.readouterr().err
    assert said.startswith("cannot join 239.255.76.67:7667 on wlan77: ")
    assert not (tmp_path / "log").exists()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--port", "0"], "gossip.port = 0: a whole number, at least 1 and at most 65535"),
        (["--group", "10.0.0.1"], 'gossip: group = "10.0.0.1": must be an IPv4 multicast'),
    ],
)
def test_a_group_that_cannot_be_is_named(
    tmp_path: Path, capsys: Printed, more: list[str], words: str
) -> None:
    assert cli.main(["record", str(tmp_path / "log"), *more]) == exit_codes.BAD_CONFIG
    assert capsys.readouterr().err.startswith(f"drslamd record: {words}")


def test_the_configuration_of_a_robot_says_where_and_flags_say_otherwise(config: Path) -> None:
    config.write_text(config.read_text() + '\n[gossip]\nport = 7001\ninterface = "lo"\n')
    options = cli.parser().parse_args(["record", "x", "-c", str(config), "--port", "7002"])
    section = record._section(options)
    assert (section.port, section.interface) == (7002, "lo")
