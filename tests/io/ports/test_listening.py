"""Serial ports that are listened to, and never written to."""

from __future__ import annotations

import asyncio
import fcntl
import os
import termios
from pathlib import Path

import pytest
from speaking_ports import SpeakingPort, kobuki, linktrack, roboteq, while_speaking

from drslamd.io.ports.listening import Listened, answers_as_roboteq, listen
from drslamd.sensors.recognition import Device, Recognised

SHORT_S = 0.25


def heard(port: SpeakingPort) -> Listened:
    return while_speaking([port], lambda: listen(port.path, listen_s=SHORT_S))


@pytest.mark.parametrize("baud", [921_600, 115_200, 2_000_000])
def test_a_linktrack_is_found_with_its_speed_and_nothing_is_written(
    tmp_path: Path, baud: int
) -> None:
    port = linktrack(tmp_path / "tty", 7, baud)
    found = heard(port)
    assert (found.who.device, found.who.uwb_id, found.baud) == (Device.LINKTRACK, 7, baud)
    assert port.written == b""


def test_a_kobuki_is_found_at_its_own_speed(tmp_path: Path) -> None:
    found = heard(kobuki(tmp_path / "tty"))
    assert (found.who.device, found.baud) == (Device.KOBUKI, 115_200)


def test_what_the_last_user_of_a_port_set_does_not_make_its_device_gone(tmp_path: Path) -> None:
    """pyserial leaves a VMIN of 0: to read nothing is then what an unplugged port says."""
    port = kobuki(tmp_path / "tty")
    line = os.open(port.path, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        settings = termios.tcgetattr(line)
        settings[3] = 0  # raw, or VMIN means nothing
        settings[6][termios.VMIN] = settings[6][termios.VTIME] = 0
        termios.tcsetattr(line, termios.TCSANOW, settings)
    finally:
        os.close(line)
    assert heard(port).who.device is Device.KOBUKI


def test_what_speaks_and_is_nobody_we_know_is_unknown(tmp_path: Path) -> None:
    port = SpeakingPort(tmp_path / "tty", lambda t: b"$GPGGA,1,2*00\r\n", 115_200)
    assert heard(port) == Listened(Recognised(Device.UNKNOWN))
    assert port.written == b""


def test_a_base_that_waits_for_questions_is_silent(tmp_path: Path) -> None:
    port = roboteq(tmp_path / "tty")
    assert heard(port) == Listened(Recognised(Device.SILENT))
    assert port.written == b""


def test_a_roboteq_answers_when_it_is_asked_and_a_kobuki_does_not(tmp_path: Path) -> None:
    for port, answers in ((roboteq(tmp_path / "a"), True), (kobuki(tmp_path / "b"), False)):
        ask = lambda path=port.path: answers_as_roboteq(path, 115_200, SHORT_S)  # noqa: E731
        assert while_speaking([port], ask) is answers
        assert b"?C\r" in port.written


def test_a_port_that_a_daemon_holds_is_said_to_be_in_use(tmp_path: Path) -> None:
    port = kobuki(tmp_path / "tty")
    line = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(line, fcntl.LOCK_EX)
    try:
        assert heard(port).fault == "in use by another program"
    finally:
        os.close(line)


def test_what_is_no_port_has_a_reason(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("text")
    for name, why in (("none", "no such port"), ("file", "no serial port")):
        assert asyncio.run(listen(str(tmp_path / name))).fault == why


def test_the_lines_that_reset_boards_are_not_dropped_when_it_is_closed(tmp_path: Path) -> None:
    port = kobuki(tmp_path / "tty")

    async def control() -> int:
        await listen(port.path, listen_s=SHORT_S)
        line = os.open(port.path, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            return int(termios.tcgetattr(line)[2])
        finally:
            os.close(line)

    assert not while_speaking([port], control) & termios.HUPCL
