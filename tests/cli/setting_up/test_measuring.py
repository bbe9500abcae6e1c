"""Sensors without a daemon: wheels that are pushed, modules that range, on pseudo-terminals."""

from __future__ import annotations

import fcntl
import math
import os
from collections.abc import Callable
from pathlib import Path

import pytest
from lab.play.emulators import (
    AsciiEmulator,
    KobukiEmulator,
    LinkTrackEmulator,
    RoboteqEmulator,
    WheelEmulator,
)
from speaking_ports import SpeakingPort, pushed, while_speaking

from drslamd.cli.setting_up.measuring import NotMeasured, Seen, Why, measured_ranges, measured_way
from drslamd.config import Config, parse
from drslamd.setup.way import Phase, Way


def configured(base: WheelEmulator, wheels: str, uwb: str = "/dev/none") -> Config:
    return parse(
        f'robot.id = 3\nteam.insecure = true\nuwb.port = "{uwb}"\n[wheels]\n{base.config(wheels)}'
    )


def way(
    port: SpeakingPort, base: WheelEmulator, within_s: float = 20.0
) -> tuple[Way | NotMeasured, list[Phase]]:
    seen: list[Phase] = []

    def tell(now: Seen) -> None:
        if not seen or seen[-1] is not now.phase:
            seen.append(now.phase)

    config = configured(base, port.path)
    return while_speaking([port], lambda: measured_way(config, within_s, tell)), seen


@pytest.mark.slow
@pytest.mark.parametrize("base", [KobukiEmulator, RoboteqEmulator, AsciiEmulator])
def test_a_push_is_followed_from_rest_to_rest(
    tmp_path: Path, base: Callable[[], WheelEmulator]
) -> None:
    device = base()
    found, seen = way(pushed(tmp_path / "tty", device, 1.02, 0.98), device)
    assert isinstance(found, Way)
    assert found.left_m == pytest.approx(1.02, abs=1e-3)
    assert found.right_m == pytest.approx(0.98, abs=1e-3)
    assert found.chord_m == pytest.approx(1.0, abs=2e-3)
    assert seen == [Phase.STANDING, Phase.MOVING, Phase.ENDED]


@pytest.mark.slow
def test_what_does_not_begin_or_not_end_has_its_time(tmp_path: Path) -> None:
    device = KobukiEmulator()
    found, _ = way(pushed(tmp_path / "a", device, 0.0, 0.0), device, within_s=1.5)
    assert isinstance(found, NotMeasured)
    assert (found.why, found.sentence[:30]) == (Why.TIME, "no wheel moved within 1.5 s: p")
    found, _ = way(pushed(tmp_path / "b", device, 5.0, 5.0, seconds=10.0), device, within_s=2.5)
    assert isinstance(found, NotMeasured)
    assert found.sentence.startswith("it did not stand still for two seconds within 2.5 s (left ")


def test_a_port_that_a_daemon_holds_is_named_with_the_remedy(tmp_path: Path) -> None:
    device = KobukiEmulator()
    port = pushed(tmp_path / "tty", device, 1.0, 1.0)
    line = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(line, fcntl.LOCK_EX)
    try:
        found, _ = way(port, device)
    finally:
        os.close(line)
    assert isinstance(found, NotMeasured)
    assert found == NotMeasured(
        Why.BUSY, f"{port.path} is in use; stop the daemon first: systemctl stop drslamd@3"
    )


@pytest.mark.slow
def test_a_base_that_says_nothing_of_use_is_told_as_in_status(tmp_path: Path) -> None:
    device = AsciiEmulator()
    port = SpeakingPort(tmp_path / "tty", lambda t: b"hello\r\n", 115_200)
    found, _ = way(port, device)
    assert isinstance(found, NotMeasured)
    assert found.why is Why.SENSOR
    assert "$ODO" in found.sentence


def test_a_port_that_is_missing_is_said_at_once(tmp_path: Path) -> None:
    config = configured(KobukiEmulator(), str(tmp_path / "none"))
    found = while_speaking([], lambda: measured_way(config, 20.0, lambda _: None))
    assert found == NotMeasured(Why.PORT, f"{tmp_path / 'none'}: No such file or directory")


def ranges(folder: Path, peer: int, seconds: float = 1.0) -> object:
    module = LinkTrackEmulator(3)
    port = SpeakingPort(
        folder / "tty",
        lambda t: module.frame(t, [(4, 3.1 + 0.01 * math.sin(t)), (9, 5.0)]),
        921_600,
    )
    config = configured(KobukiEmulator(), "/dev/none", port.path)
    found = while_speaking([port], lambda: measured_ranges(config, peer, seconds, lambda _: None))
    assert port.written == b""
    return found


def test_ranges_to_one_module_are_collected_and_nothing_is_written(tmp_path: Path) -> None:
    found = ranges(tmp_path, 4)
    assert isinstance(found, list)
    assert len(found) > 20
    assert all(s.peer_uwb_id == 4 and abs(s.range_m - 3.1) < 0.02 for s in found)


def test_a_module_that_is_not_heard_is_told_with_those_that_are(tmp_path: Path) -> None:
    found = ranges(tmp_path, 7)
    assert found == NotMeasured(Why.SENSOR, "no range to module 7: only 4, 9 is heard")
