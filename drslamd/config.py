"""The configuration: one frozen model per section of the TOML file.

`parse` turns TOML text into a `Config` or raises `ConfigError`: one sentence per fault with the
key, the value and what is allowed. The paper's parameters have its names and, if any, its values.
"""

from __future__ import annotations

import re
from pathlib import PurePath
from typing import Annotated, Literal

import tomli
from pydantic import (
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from drslamd.config_faults import one_line, sentences
from drslamd.config_wheels import Baud, FilePath, Port, Section, Wheels
from drslamd.conventions import MAX_ROBOT_ID

Rate = Annotated[float, Field(gt=0, le=50)]
Metres = Annotated[float, Field(ge=-5, le=5)]
RobotId = Annotated[int, Field(ge=0, le=MAX_ROBOT_ID)]


class RobotSection(Section):
    id: RobotId
    """Unique in the team; the lowest living id of a group gives the frame of that group."""
    calibration: FilePath = ""
    """File made by `drslamd calibrate`: what a tape says of wheels and antennas."""


class TeamSection(Section):
    key_file: FilePath = ""
    """File made by `drslamd keygen`, mode 0600, the same on every robot."""
    insecure: bool = False
    """True runs without a key: whoever is on the network can then forge messages. Without
    `trust_everyone_on` that is only for a network that ends on this host (`gossip.ttl = 0`)."""
    trust_everyone_on: str = ""
    """With `insecure`: the network whose every computer is trusted, `gossip.interface`, or
    `gossip.group` where no interface is named."""

    @model_validator(mode="after")
    def _trust_is_asked_for(self) -> TeamSection:
        if self.trust_everyone_on and not self.insecure:
            raise ValueError("trust_everyone_on is for insecure = true: leave it out")
        return self

    @model_validator(mode="after")
    def _key_or_explicitly_none(self) -> TeamSection:
        if bool(self.key_file) == self.insecure:
            raise ValueError(
                "key_file and insecure = true exclude each other: leave out one of them"
                if self.insecure
                else "neither key_file (made by `drslamd keygen`) nor insecure = true is there"
            )
        return self


class UwbSection(Section):
    port: Port
    """Serial device of the LinkTrack module; a path below /dev/serial/by-id survives replugging."""
    baud: Baud = 921_600
    id: Annotated[int, Field(ge=0, le=0xFFFFFFFF)] | None = None
    """8-bit id in DR_MODE0, 32-bit id in DR_MODE1; `robot.id` when left out."""
    max_range_m: Annotated[float, Field(gt=0, le=1000)] = 120.0
    antenna_x_m: Metres = 0.0
    antenna_y_m: Metres = 0.0
    antenna_z_m: Metres = 0.0
    """Antenna in the body frame: x forward, y to the left, z above the floor (any common level)."""

    @property
    def line(self) -> str:
        """Where the module is, and how it is read."""
        return f"{self.port} at {self.baud} baud"


class OdometrySection(Section):
    """Noise of dead reckoning per path length (defaults: recorded wheeled robots)."""

    scale_sigma: Annotated[float, Field(gt=0, le=0.5)] = 0.10
    """Recorded robots: mostly 1 to 4 %, but up to 21 % where nobody calibrated."""
    yaw_sigma_deg_per_m: Annotated[float, Field(gt=0, le=20)] = 0.15
    random_translation_per_sqrt_m: Annotated[float, Field(gt=0, le=1)] = 0.01
    random_yaw_deg_per_sqrt_m: Annotated[float, Field(gt=0, le=20)] = 0.5


class RelativePoseSection(Section):
    """Module 1 (paper III-A)."""

    algorithm: Literal["drslamd", "paper"] = "drslamd"
    rate_hz: Rate = 1.0
    tau: Annotated[int, Field(ge=3, le=1000)] = 50
    """Window of `algorithm = "paper"`, in samples at 10 Hz."""
    delta: Annotated[float, Field(ge=0.01, le=0.8)] = 0.1
    """Step of the coarse search over phi and theta, radians."""
    window_max_s: Annotated[float, Field(ge=1, le=120)] = 40.0
    """Longest window of `algorithm = "drslamd"`."""
    range_sigma_m: Annotated[float, Field(ge=0.001, le=5)] = 0.10
    range_bias_sigma_m: Annotated[float, Field(ge=0.001, le=5)] = 0.30
    """How far the constant bias of a pair may be from zero before anything is measured."""
    nlos_db: Annotated[float, Field(ge=0, le=60)] = 10.0
    """A first path so much weaker than all that is received is taken for blocked; 0 turns it off.
    LinkTrack user manual 7.2: above 10 dB likely no line of sight, below 6 dB likely one."""
    self_calibration: bool = True
    """Take out what module 3 has learned of biases and odometry, before this start too."""


class ConsistencySection(Section):
    """Module 2 (paper III-B)."""

    epsilon: Annotated[float, Field(gt=0, lt=1)] = 0.1
    """Significance level: the gate is the chi-squared quantile at 1 - epsilon, 3 degrees."""
    rate_hz: Rate = 1.0


class OptimizerSection(Section):
    """Module 3 (paper III-C)."""

    algorithm: Literal["banded", "closures", "rbcd"] = "banded"
    rate_hz: Rate = 1.0
    rank: Annotated[int, Field(ge=2, le=20)] = 5
    """Rank of the relaxation that `algorithm = "rbcd"` optimises."""


class GossipSection(Section):
    provider: Literal["native", "liblcm"] = "native"
    group: str = "239.255.76.67"
    port: Annotated[int, Field(ge=1, le=65535)] = 7667
    interface: str = ""
    """Name or address of the network interface; empty leaves the choice to the routing table."""
    ttl: Annotated[int, Field(ge=0, le=32)] = 1
    """0 keeps everything on this host (tests), 1 on this network."""
    max_bytes_per_s: Annotated[int, Field(ge=2_000, le=10_000_000)] = 50_000
    """Of this robot; what is least useful is held back first."""
    url: str = ""
    """For `provider = "liblcm"`: any LCM URL; made from the keys above when empty."""

    @model_validator(mode="after")
    def _group_is_multicast(self) -> GossipSection:
        parts = self.group.split(".")
        numbers = [int(p) for p in parts if re.fullmatch("[0-9]{1,3}", p) and int(p) < 256]
        if len(parts) != 4 or len(numbers) != 4 or not 224 <= numbers[0] <= 239:
            raise ValueError(
                f'group = "{self.group}": must be an IPv4 multicast address, '
                "224.0.0.0 to 239.255.255.255"
            )
        if self.url and self.provider != "liblcm":
            raise ValueError('url is read only with provider = "liblcm"')
        return self


Place = Annotated[float, Field(ge=-1e6, le=1e6)]


class BeaconSection(Section):
    """A module that no robot carries, and whose place somebody has measured: two make the frame of
    the site. All of them have x and y, or all latitude and longitude (then x is east and y north of
    the first)."""

    uwb_id: Annotated[int, Field(ge=0, le=0xFFFFFFFF)]
    x_m: Place | None = None
    y_m: Place | None = None
    latitude_deg: Annotated[float, Field(ge=-85, le=85)] | None = None
    longitude_deg: Annotated[float, Field(ge=-180, le=180)] | None = None

    @model_validator(mode="after")
    def _place_is_said_once(self) -> BeaconSection:
        metres, degrees = (self.x_m, self.y_m), (self.latitude_deg, self.longitude_deg)
        said = [None not in pair for pair in (metres, degrees)]
        if said.count(True) != 1 or any(v is not None for v in (degrees if said[0] else metres)):
            raise ValueError("give x_m and y_m, or latitude_deg and longitude_deg")
        return self


class NearSection(Section):
    """The pose of now and the peers around it, for whoever steers by it."""

    lcm_hz: Annotated[float, Field(ge=0, le=50)] = 0
    """Messages a second on the channel DRSLAM_NEAR, at most one for each sample of odometry; 0 says
    nothing there. The local socket always has all of them."""
    hypotheses: bool = False
    """Once a second on the channel DRSLAM_HYPOTHESES where peers may be, until one answer stands;
    the live map then shows it. `drslamd status` always has it."""


class DaemonSection(Section):
    state_dir: FilePath = ""
    """Default: $STATE_DIRECTORY under systemd, else ~/.local/state/drslamd."""
    status_socket: FilePath = ""
    """Default: drslamd-<id>.sock in $RUNTIME_DIRECTORY under systemd, else in the state folder."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    log_format: Literal["text", "json"] = "text"
    record: bool = False
    """Keep everything that is heard and done, for `tools/replay` and LCM's own tools."""
    record_dir: FilePath = ""
    """Default: recordings in the state folder."""
    record_mb: Annotated[int, Field(ge=16, le=1_000_000)] = 1000
    """Of this robot in that folder; the oldest files go first."""


class Config(Section):
    robot: RobotSection
    team: TeamSection
    uwb: UwbSection
    wheels: Wheels
    odometry: OdometrySection = OdometrySection()
    relative_pose: RelativePoseSection = RelativePoseSection()
    consistency: ConsistencySection = ConsistencySection()
    optimizer: OptimizerSection = OptimizerSection()
    gossip: GossipSection = GossipSection()
    near: NearSection = NearSection()
    daemon: DaemonSection = DaemonSection()
    beacon: Annotated[list[BeaconSection], Field(default_factory=list, max_length=64)]

    @field_validator("beacon")
    @classmethod
    def _beacons_are_of_one_kind(cls, found: list[BeaconSection]) -> list[BeaconSection]:
        if len({beacon.x_m is None for beacon in found}) > 1:
            raise ValueError("all have x_m and y_m, or all latitude_deg and longitude_deg")
        if len({beacon.uwb_id for beacon in found}) < len(found):
            raise ValueError("each module once")
        return found

    @property
    def uwb_id(self) -> int:
        return self.robot.id if self.uwb.id is None else self.uwb.id


PLACES = (
    ("robot", "calibration"),
    ("team", "key_file"),
    ("uwb", "port"),
    ("wheels", "port"),
    ("wheels", "dbc_file"),
    ("daemon", "state_dir"),
    ("daemon", "status_socket"),
    ("daemon", "record_dir"),
)
"""Keys that name files, devices and folders: the same ones from wherever a program is started."""


BYTE_ORDER_MARK = "\ufeff"
"""Some editors put it before the first line."""


class ConfigError(Exception):
    """The file cannot be used; `faults` holds one sentence for each reason."""

    def __init__(self, faults: list[str]) -> None:
        super().__init__("\n".join(faults))
        self.faults = faults


def parse(text: str, base_dir: str = "") -> Config:
    """Read TOML text; relative paths count from `base_dir`.

    Raises:
        ConfigError: with one sentence per fault.
    """
    try:
        table = tomli.loads(text.removeprefix(BYTE_ORDER_MARK))
    except tomli.TOMLDecodeError as error:
        raise ConfigError([f"not valid TOML: {one_line(str(error))}"]) from None
    except ValueError:
        raise ConfigError(["not valid TOML: a number of thousands of digits"]) from None
    except RecursionError:
        raise ConfigError(["not valid TOML: brackets or keys nested too deep"]) from None
    for section, key in PLACES:
        values = table.get(section)
        if isinstance(values, dict) and _is_relative(values.get(key)):
            values[key] = str(PurePath(base_dir) / values[key])
    try:
        config = Config.model_validate(table)
    except ValidationError as error:
        raise ConfigError(sentences(error, Config)) from None
    if any(beacon.uwb_id == config.uwb_id for beacon in config.beacon):
        fault = "the module of this robot; a beacon is one that no robot carries"
        raise ConfigError([f"beacon.uwb_id = {config.uwb_id}: {fault}"])
    return config


def _is_relative(value: object) -> bool:
    """Is it a path that counts from somewhere? (``~`` is refused as it stands.)"""
    return isinstance(value, str) and value != "" and not value.startswith("~")
