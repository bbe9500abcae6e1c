"""The parts that a configuration chooses: which, with what, and a sentence when one is missing."""

from __future__ import annotations

import builtins
import importlib.util
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from daemon_scenes import CONFIG, Stepped

from drslamd.config import Config, ConfigError, parse
from drslamd.io.can_bus import CanBus
from drslamd.io.multicast import Multicast
from drslamd.io.recording.recorder import NoRecorder, Recorder
from drslamd.io.serial_port import SerialPort
from drslamd.parts import (
    begun_robot,
    dbc_text,
    make_ports,
    make_recorder,
    make_transport,
    make_wheels,
    outlived,
    taped_calibration,
    team_secret,
)
from drslamd.recording.records import Beginning
from drslamd.robot import Robot
from drslamd.setup.calibration_file import MAX_BYTES
from drslamd.slam.calibration.sensor_calibration import UNLEARNED
from drslamd.slam.graph.estimate import Learned

KOBUKI = 'source = "kobuki"\nport = "/dev/none"\n'
ODRIVE = """source = "odrive"
track_m = 0.5
left_axis = 0
right_axis = 1
wheel_radius_m = 0.1
"""
DBC = """source = "dbc"
dbc_file = "{}"
measures = "wheel_speeds"
left = "A.B"
right = "A.C"
track_m = 0.5
"""


def configured(wheels: str = KOBUKI, more: str = "") -> Config:
    assert KOBUKI in CONFIG
    return parse(CONFIG.replace(KOBUKI, wheels) + more)


@pytest.fixture
def without(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Let a package be missing from now on."""
    true_import = builtins.__import__

    def forget(package: str) -> None:
        def fake(name: str, *arguments: Any, **keywords: Any) -> Any:
            if name == package:
                raise ModuleNotFoundError(f"No module named '{package}'")
            return true_import(name, *arguments, **keywords)

        monkeypatch.setattr(builtins, "__import__", fake)

    return forget


def told(make: Any, config: Config) -> Any:
    """What `make` gives, and that it has our clock and tells us its events."""
    clock, events = Stepped(), []  # type: ignore[var-annotated]
    part = make(config, clock, events.append)
    assert part._clock is clock
    assert events == []
    return part


def test_the_network_is_our_own_transport_unless_lcm_is_asked_for() -> None:
    assert isinstance(told(make_transport, configured()), Multicast)


@pytest.mark.skipif(importlib.util.find_spec("lcm") is None, reason="no package lcm")
def test_lcm_is_taken_when_it_is_asked_for() -> None:
    from drslamd.io.liblcm import Liblcm

    config = configured(more='[gossip]\nprovider = "liblcm"\n')
    assert isinstance(told(make_transport, config), Liblcm)


def test_lcm_that_is_missing_is_one_sentence(without: Any) -> None:
    without("lcm")
    with pytest.raises(ConfigError, match="pip install lcm"):
        make_transport(configured(more='[gossip]\nprovider = "liblcm"\n'), Stepped(), print)


def test_wheels_on_a_serial_line_have_the_port_and_the_speed_of_their_section() -> None:
    port = told(make_wheels, configured(KOBUKI + "baud = 57_600\n"))
    assert isinstance(port, SerialPort)
    assert (port._port, port._path, port._baud) == ("wheels", "/dev/none", 57_600)


ROBOTEQ = 'source = "roboteq"\nport = "/dev/none"\ntrack_m = 0.4\ncounts_per_metre = 100.0\n'
ASCII = ROBOTEQ.replace("roboteq", "ascii")


@pytest.mark.parametrize(("wheels", "in_rounds"), [(KOBUKI, True), (ASCII, True), (ROBOTEQ, False)])
def test_only_ports_of_devices_that_stamp_what_they_send_are_read_in_rounds(
    wheels: str, in_rounds: bool
) -> None:
    uwb, base = make_ports(configured(wheels), Stepped(), print, lambda: False)
    assert isinstance(base, SerialPort)
    assert (uwb._port, uwb._path) == ("uwb", configured().uwb.port)
    assert uwb._rounds is not None
    assert (base._rounds is uwb._rounds) is in_rounds
    assert (base._rounds is None) is not in_rounds


@pytest.mark.parametrize(
    ("more", "read"), [("", False), ("", True), ("[near]\nlcm_hz = 10\n", False)]
)
def test_no_port_waits_for_a_round_while_poses_are_taken_as_they_come(
    more: str, read: bool
) -> None:
    uwb, _ = make_ports(configured(more=more), Stepped(), print, lambda: read)
    assert uwb._rounds is not None
    assert uwb._rounds.has_time() is not (read or bool(more))


def test_wheels_on_a_can_bus_have_the_bus_of_their_section() -> None:
    pytest.importorskip("can", reason="python-can is not installed")
    bus = told(make_wheels, configured(ODRIVE + '[wheels.can]\nchannel = "can3"\n'))
    assert isinstance(bus, CanBus)
    assert bus._section.channel == "can3"


def test_a_package_for_can_that_is_missing_is_one_sentence(without: Any) -> None:
    without("can")
    with pytest.raises(ConfigError, match="pip install"):
        make_wheels(configured(ODRIVE), Stepped(), print)


def test_a_dbc_file_is_read_only_for_wheels_that_have_one(tmp_path: Path) -> None:
    path = tmp_path / "base.dbc"
    path.write_text('VERSION "é"\n')
    assert dbc_text(configured(DBC.format(path))) == 'VERSION "é"\n'
    assert dbc_text(configured()) == dbc_text(configured(ODRIVE)) == ""


@pytest.mark.parametrize(
    ("content", "sentence"), [(None, "No such file or directory"), (b"B\0\0\0O", "not a text file")]
)
def test_a_dbc_file_that_cannot_be_read_is_one_sentence(
    tmp_path: Path, content: bytes | None, sentence: str
) -> None:
    path = tmp_path / "base.dbc"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError) as caught:
        dbc_text(configured(DBC.format(path)))
    assert caught.value.faults == [f"wheels.dbc_file = '{path}': {sentence}; correct the path"]


@pytest.mark.parametrize(
    ("more", "folder"), [("", "state/recordings"), ('record_dir = "/data/runs"\n', "/data/runs")]
)
def test_a_recording_goes_where_it_is_told_or_into_the_state_folder(more: str, folder: str) -> None:
    config = configured(more=f"record = true\nrecord_mb = 32\n{more}")
    recorder = make_recorder(config, Stepped(), Path("state"), "", bytes(32))
    assert isinstance(recorder, Recorder)
    assert recorder._files.folder == Path(folder)
    assert recorder._files.file_bytes == 2 << 20
    assert recorder._encoder._is_framed


def test_without_a_word_nothing_is_recorded() -> None:
    made = make_recorder(configured(), Stepped(), Path("state"), "", bytes(32))
    assert isinstance(made, NoRecorder)


def named(path: Path) -> Config:
    return parse(CONFIG.replace("id = 1", f'id = 1\ncalibration = "{path}"'))


def test_a_robot_begins_with_what_its_last_start_kept() -> None:
    place = {"speed_mps": 0.5, "seen": [[4, 9, 120, 12_300_000, 1.5, -2.0, 0.2]]}
    state = {"epoch": 3, "epochs": {"2": 7}, "calibration": {"scale": [0.1, 0.02]}, "place": place}
    kept = outlived(state)
    assert kept["epochs"] == {2: 7}
    make = partial(Robot, configured(), bytes(32))
    robot = begun_robot(make, Beginning(4, **kept))
    assert robot.own.epoch == 4
    assert robot.memory.state()["place"] == place
    assert robot.calibration.latest.scale == Learned(0.1, 0.02)
    assert robot.front.resumption.is_waiting
    fresh = begun_robot(make, Beginning(4, **outlived({})))
    assert not fresh.front.resumption.is_waiting


def test_no_calibration_is_nothing_known() -> None:
    assert taped_calibration(configured()) == UNLEARNED


def test_a_calibration_is_read_from_the_folder_of_the_configuration(tmp_path: Path) -> None:
    (tmp_path / "1.cal").write_text("robot.id = 1\nbias.4 = {bias_m = 0.1, sigma_m = 0.08}\n")
    text = CONFIG.replace("id = 1", 'id = 1\ncalibration = "1.cal"')
    assert taped_calibration(parse(text, str(tmp_path))).bias == {4: Learned(0.1, 0.08)}


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (None, "No such file; make it with drslamd calibrate, or leave the key out"),
        (b"robot.id = 2\n", "it is of robot 2, not 1; measure this one: drslamd calibrate"),
        (b"\xff", "not a text file"),
        (b"robot", "not valid TOML: "),
        (b"#" * (MAX_BYTES + 1), "it has more than 65536 bytes; name a file that drslamd cal"),
    ],
)
def test_a_calibration_that_cannot_be_used_is_one_sentence(
    tmp_path: Path, content: bytes | None, why: str
) -> None:
    path = tmp_path / "1.calibration.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigError) as error:
        taped_calibration(named(path))
    (fault,) = error.value.faults
    assert fault.startswith(f"robot.calibration = {str(path)!r}: {why}")


def test_a_folder_is_no_calibration(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="Is a directory"):
        taped_calibration(named(tmp_path))


# a team without a key


def without_key(gossip: str = "", trusted: str = "") -> Config:
    more = f'trust_everyone_on = "{trusted}"\n' if trusted else ""
    text = CONFIG.replace('trust_everyone_on = "239.255.76.67"\n', more)
    return parse(f"{text}[gossip]\n{gossip}\n")


@pytest.mark.parametrize(
    ("gossip", "trusted"),
    [
        ("ttl = 0", ""),
        ('interface = "lo"', ""),
        ('interface = "127.0.0.1"', ""),
        ("", "239.255.76.67"),
        ('interface = "wlan0"', "wlan0"),
        ('provider = "liblcm"\nurl = "udpm://239.255.76.67:7667"', ""),
        ('provider = "liblcm"\nurl = "udpm://239.255.76.67:7667?ttl=0"', ""),
    ],
)
def test_a_team_may_be_without_key_on_this_host_or_where_all_are_trusted_by_name(
    gossip: str, trusted: str
) -> None:
    assert team_secret(without_key(gossip, trusted)) is None


@pytest.mark.parametrize(
    ("gossip", "trusted", "network"),
    [
        ("", "", "239.255.76.67"),
        ("ttl = 1", "eth0", "239.255.76.67"),
        ('interface = "wlan0"', "", "wlan0"),
        ('interface = "wlan0"', "239.255.76.67", "wlan0"),
        ('provider = "liblcm"\nurl = "udpm://239.255.76.67:7667?ttl=1"', "", "239.255.76.67"),
        ('provider = "liblcm"\nurl = "tcpq://10.0.0.1:7700"', "", "239.255.76.67"),
    ],
)
def test_elsewhere_a_team_without_key_is_refused_with_the_way_out(
    gossip: str, trusted: str, network: str
) -> None:
    with pytest.raises(ConfigError) as refused:
        team_secret(without_key(gossip, trusted))
    (fault,) = refused.value.faults
    assert fault.startswith(f"team.insecure = true: whoever is on the network {network} could")
    assert f"team.trust_everyone_on = {network!r}" in fault
    assert "drslamd keygen" in fault


def test_trust_without_insecure_is_a_fault_of_the_configuration() -> None:
    text = CONFIG.replace("insecure = true", 'key_file = "k"')
    with pytest.raises(ConfigError, match="trust_everyone_on is for insecure = true"):
        parse(text)
