"""``drslamd view``: what it is told, what it says, what it ends with."""

from __future__ import annotations

import argparse
import builtins
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from message_builders import SECRET
from onlooked_team import Actor
from transport_helpers import free_port

from drslamd import cli
from drslamd.cli import exit_codes, view
from drslamd.cli.parser import load
from drslamd.config import GossipSection

PROXYLESS = urllib.request.build_opener(urllib.request.ProxyHandler({}))

NO_KEY = 'insecure = true\ntrust_everyone_on = "239.255.76.67"'


def options(**given: Any) -> argparse.Namespace:
    flags = ("config", "group", "port", "interface")
    return argparse.Namespace(**{**dict.fromkeys(flags), "listen": "127.0.0.1", **given})


def keyed(config: Path, mode: int = 0o600) -> Path:
    """The same configuration with a team key and a group of its own."""
    key = config.with_name("team.key")
    key.write_text(SECRET.hex() + "\n")
    key.chmod(mode)
    gossip = '\n[gossip]\ninterface = "lo"\nport = 7001\ngroup = "239.1.2.3"\n'
    text = config.read_text().replace(NO_KEY, f'key_file = "{key}"')
    config.write_text(text + gossip)
    return config


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--http-port", "65536"], "--http-port 65536: allowed are 0 to 65535"),
        (["--http-port", "-1"], "--http-port -1: allowed are 0 to 65535"),
        (["--listen", "wlan0"], "--listen wlan0: must be an address"),
        (["--group", "10.0.0.1"], '--group "10.0.0.1": must be an IPv4 multicast address'),
        (["--port", "0"], "--port 0: a whole number, at least 1 and at most 65535"),
    ],
)
def test_a_flag_that_cannot_be_meant_ends_with_64_and_a_sentence(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("aiohttp", reason="aiohttp is not installed")
    assert cli.main(["view", *arguments]) == exit_codes.USAGE
    assert capsys.readouterr().err.startswith(f"drslamd view: {words}")


def test_without_aiohttp_one_sentence_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = builtins.__import__

    def missing(name: str, *args: Any, **kwargs: Any) -> Any:
        if name.startswith("aiohttp"):
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", missing)
    assert cli.main(["view"]) == exit_codes.UNAVAILABLE == 69
    said = capsys.readouterr().err
    assert said == 'drslamd view needs aiohttp: pip install "drslamd[view]"\n'


def test_without_a_file_nothing_is_verified_on_the_group_of_the_project() -> None:
    hearing, _ = view._ears(options())
    assert not hearing.verifies
    section = view._section(GossipSection(), options())
    assert (section.group, section.port, section.interface) == ("239.255.76.67", 7667, "")


def test_a_file_gives_group_interface_and_key_and_flags_stand_above_it(config: Path) -> None:
    hearing, _ = view._ears(options(config=str(keyed(config))))
    assert hearing.verifies
    actor = Actor(4, secret=SECRET)
    assert hearing.receive(actor.datagram(actor.status(), 0.0)) is not None
    stranger = Actor(5, secret=bytes(32))
    assert hearing.receive(stranger.datagram(stranger.status(), 0.0)) is None
    found = load(str(config)).gossip
    section = view._section(found, options(port=7002))
    assert (section.group, section.port, section.interface) == ("239.1.2.3", 7002, "lo")


def test_a_file_without_a_key_verifies_nothing(config: Path) -> None:
    hearing, _ = view._ears(options(config=str(config)))
    assert not hearing.verifies


def test_a_key_that_others_can_read_ends_with_78_as_the_daemon_does(
    config: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("aiohttp", reason="aiohttp is not installed")
    assert cli.main(["view", "-c", str(keyed(config, 0o644))]) == exit_codes.BAD_CONFIG
    assert "mode 0644 lets others read it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("listen", "hosts"),
    [
        ("127.0.0.1", ["127.0.0.1"]),
        ("::1", ["[::1]"]),
        ("0.0.0.0", ["localhost", f"{socket.gethostname()}.local"]),
    ],
)
def test_the_address_to_type_is_said(listen: str, hosts: list[str]) -> None:
    assert view._hosts(listen) == hosts


class Running:
    """A real process, with what it said first."""

    def __init__(self, *arguments: str) -> None:
        pytest.importorskip("aiohttp", reason="aiohttp is not installed")
        command = [sys.executable, "-m", "drslamd", "view", "--interface", "127.0.0.1", *arguments]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True)
        assert self.process.stdout is not None
        self.line = self.process.stdout.readline()
        self.url = self.line.removeprefix("live map: ").strip()

    def end(self, number: int = signal.SIGTERM) -> int:
        self.process.send_signal(number)
        self.process.communicate(timeout=10)
        return self.process.returncode


@pytest.fixture
def running() -> Iterator[Running]:
    program = Running("--http-port", "0", "--port", str(free_port()))
    yield program
    if program.process.poll() is None:
        program.process.kill()
    program.process.communicate()


@pytest.mark.slow
def test_the_program_says_its_address_shows_its_page_and_ends_in_order(running: Running) -> None:
    assert re.fullmatch(r"live map: http://127\.0\.0\.1:\d+/\n", running.line)
    with PROXYLESS.open(running.url, timeout=5) as answer:
        assert b"drslamd: live map" in answer.read()
    with pytest.raises(urllib.error.HTTPError, match="405"):
        PROXYLESS.open(running.url, data=b"x", timeout=5)
    assert running.end(signal.SIGINT) == exit_codes.OK


@pytest.mark.slow
def test_a_port_that_is_taken_ends_with_69_and_a_remedy(running: Running) -> None:
    port = running.url.rstrip("/").rpartition(":")[2]
    command = [sys.executable, "-m", "drslamd", "view", "--http-port", port]
    second = subprocess.run(command, capture_output=True, text=True, check=False, timeout=20)
    assert second.returncode == exit_codes.UNAVAILABLE
    assert second.stderr.startswith(f"127.0.0.1:{port}: ")
    assert "give another with --listen or --http-port" in second.stderr


@pytest.mark.slow
def test_an_onlooker_costs_little(running: Running) -> None:
    time.sleep(2.0)
    before = cpu_s(running.process.pid)
    time.sleep(3.0)
    assert cpu_s(running.process.pid) - before < 0.3
    assert running.end() == exit_codes.OK


def cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
