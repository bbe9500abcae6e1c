"""The file that ``drslamd init`` writes."""

from __future__ import annotations

from typing import Any

import pytest

from drslamd.config import parse
from drslamd.config_wheels import SOURCES
from drslamd.setup.choices import UwbChoice, WheelsChoice
from drslamd.setup.first_config import FirstConfig, toml

PORT = {"port": "/dev/wheels"}
BASES: dict[str, dict[str, Any]] = {
    "kobuki": PORT,
    "roboteq": {**PORT, "counts_per_metre": 1000, "track_m": 0.5, "swap_channels": True},
    "ascii": {**PORT, "baud": 57_600, "counts_per_metre": 4000.5, "track_m": 0.3},
    "wheeltec": {**PORT, "track_m": 0.3},
    "odrive": {"left_axis": 0, "right_axis": 1, "track_m": 0.5, "wheel_radius_m": 0.085},
    "agilex": {"track_m": 0.6, "can.channel": "can1"},
    "dbc": {
        "dbc_file": "base.dbc",
        "measures": "wheel_speeds",
        "track_m": 0.5,
        "left": "A.B",
        "right": "A.C",
    },
}


@pytest.mark.parametrize("source", SOURCES)
def test_what_was_chosen_stands_in_the_file_of_every_base(source: str) -> None:
    wheels = WheelsChoice(source, BASES[source])
    assert wheels.lacking == []
    chosen = FirstConfig(4, UwbChoice("/dev/uwb", 460_800, 9), wheels, "wlan0", "/k/team.key")
    config = parse(toml(chosen))
    assert (config.robot.id, config.uwb.port, config.uwb.baud, config.uwb.id) == (
        4,
        "/dev/uwb",
        460_800,
        9,
    )
    assert config.wheels.source == source
    for key, value in BASES[source].items():
        if key == "can.channel":
            assert config.wheels.can.channel == value  # type: ignore[union-attr]
        elif key != "dbc_file":
            assert getattr(config.wheels, key) == value
    assert (config.gossip.interface, config.team.key_file) == ("wlan0", "/k/team.key")


def test_what_is_as_usual_is_not_said() -> None:
    text = toml(FirstConfig(7, UwbChoice("/dev/uwb", 921_600, 7), WheelsChoice("kobuki", PORT)))
    config = parse(text)
    assert config.team.insecure
    assert config.gossip.interface == ""
    assert "\nbaud" not in text
    assert text.count("\nid") == 1


def test_its_lines_fit_a_terminal_and_those_that_are_commented_out_can_be_used() -> None:
    text = toml(FirstConfig(7, UwbChoice("/dev/uwb"), WheelsChoice("kobuki", PORT)))
    assert max(len(line) for line in text.splitlines()) <= 110
    used = parse(
        "\n".join(line.removeprefix("#") if "=" in line else line for line in text.split("\n"))
    )
    assert used.uwb.antenna_x_m == 0.0
    assert used.gossip.interface == "wlan0"
