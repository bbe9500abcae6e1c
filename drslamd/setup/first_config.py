"""The first configuration of a robot: a TOML file that says what its lines are for."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

from drslamd.config import GossipSection, UwbSection
from drslamd.setup.choices import UwbChoice, WheelsChoice

WIDTH = 44
"""Column in which comments begin, where a line is not longer."""
COMMENTS = {
    "track_m": "m between left and right wheels",
    "counts_per_metre": "of each wheel's path",
    "baud": "bit/s",
    "max_speed_mps": "m/s, faster is a counter that was reset",
    "reverse_left": "true if these wheels count backwards",
    "reverse_right": "true if these wheels count backwards",
    "swap_channels": "true if channel 1 drives the right wheels",
    "wheel_radius_m": "m",
    "left_axis": "node id of each side",
    "can.channel": "the CAN interface",
    "dbc_file": "a path from the folder of this file",
}
"""Of keys of ``[wheels]``."""


class FirstConfig(NamedTuple):
    """What was chosen; an empty `key_file` is a team without a key."""

    robot: int
    uwb: UwbChoice
    wheels: WheelsChoice
    interface: str = ""
    key_file: str = ""


def toml(chosen: FirstConfig) -> str:
    """The file, ready for ``drslamd check``."""
    lines = [
        f"# Robot {chosen.robot}, made by drslamd init. Is it right? drslamd check -c FILE",
        "# Every other key with its default: man drslamd.toml, or etc/drslamd.toml in the clone.",
        "",
        "[robot]",
        _line("id", chosen.robot, "0 to 254, another one for each robot of the team"),
        _line("#calibration", f"{chosen.robot}.calibration.toml", "drslamd calibrate makes it"),
        "",
        "[team]",
        *_team(chosen.key_file, chosen.interface),
        "",
        "[uwb]",
        *_uwb(chosen.uwb, chosen.robot),
        "",
        "[wheels]",
        _line("source", chosen.wheels.source),
        *_wheels(chosen.wheels.keys),
        "",
        "[gossip]",
        _line("interface", chosen.interface, "by which the team is reached; all use one network")
        if chosen.interface
        else _line("#interface", "wlan0", "by which the team is reached, if there are several"),
    ]
    return "\n".join(lines) + "\n"


def _team(key_file: str, interface: str) -> list[str]:
    if not key_file:
        why = "anybody on the network can forge messages; better: key_file"
        network = interface or GossipSection.model_fields["group"].default
        trusted = "every computer there is trusted"
        return [_line("insecure", True, why), _line("trust_everyone_on", network, trusted)]
    return [_line("key_file", key_file, "the same on every robot, mode 0600")]


def _uwb(uwb: UwbChoice, robot: int) -> list[str]:
    lines = [_line("port", uwb.port, "the LinkTrack module; it is only listened to")]
    if uwb.baud and uwb.baud != UwbSection.model_fields["baud"].default:
        lines.append(_line("baud", uwb.baud, "bit/s, as set in the module"))
    if uwb.uwb_id is not None and uwb.uwb_id != robot:
        lines.append(_line("id", uwb.uwb_id, "of the module"))
    return [
        *lines,
        _line("#antenna_x_m", 0.0, "m from the middle between the wheels, forward"),
        _line("#antenna_y_m", 0.0, "m, to the left"),
        _line("#antenna_z_m", 0.0, "m, above the floor; matters where robots differ"),
    ]


def _wheels(keys: Mapping[str, Any]) -> list[str]:
    return [_line(key, value, COMMENTS.get(key, "")) for key, value in keys.items()]


def _line(key: str, value: object, comment: str = "") -> str:
    line = f"{key} = {json.dumps(value, ensure_ascii=False)}"
    return f"{line:<{WIDTH}}# {comment}" if comment else line
