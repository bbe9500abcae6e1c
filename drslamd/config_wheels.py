"""The section `[wheels]` of the configuration, one model per base, and what every section obeys."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Union

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    field_validator,
    model_validator,
)

Scale = Annotated[float, Field(ge=1e-9, le=1e9)]
"""Between two units; beyond it products with what a sensor says could overflow."""
Baud = Annotated[int, Field(ge=1200, le=4_000_000)]
MAX_CHANNEL = 255
"""No adapter has more."""
MAX_OPTIONS = 16
"""No python-can interface has more."""


class Section(BaseModel):
    """Nothing is guessed: no unknown key, no "3" for 3, no 1 for true, no number without end."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    @field_validator("*")
    @classmethod
    def _is_readable(cls, value: object) -> object:
        # a NUL in a path would end the daemon later, where nobody expects it
        if isinstance(value, str) and not value.isprintable():
            raise ValueError("text without control characters")
        return value


def _text_or_number(given: object) -> object:
    """Some interfaces name their channels, some number them."""
    if isinstance(given, int) and not isinstance(given, bool):
        fits = 0 <= given <= MAX_CHANNEL
    else:
        fits = isinstance(given, str)
    if not fits:
        raise ValueError(f"text in quotes, or a whole number from 0 to {MAX_CHANNEL}")
    return given


def _named_values(given: object) -> object:
    """Of an adapter; what it does with them is its own affair."""
    if not isinstance(given, dict) or len(given) > MAX_OPTIONS:
        raise ValueError(f"at most {MAX_OPTIONS} names, each with a number, text or true or false")
    if not all(map(_is_value, given.values())):
        raise ValueError("each name takes a finite number, printable text, or true or false")
    return given


def _is_value(one: object) -> bool:
    if isinstance(one, str):
        return one.isprintable()
    return isinstance(one, (bool, int)) or (isinstance(one, float) and math.isfinite(one))


def _whole_path(path: str) -> str:
    if path.startswith("~"):
        raise ValueError("~ stands for no home here: write the whole path")
    return path


def _device(path: str) -> str:
    if not path:
        raise ValueError("a serial device; ls /dev/serial/by-id shows their names")
    return path


FilePath = Annotated[str, AfterValidator(_whole_path)]
"""Of a file or a folder; a relative one counts from the folder of the configuration."""
Port = Annotated[FilePath, AfterValidator(_device)]


class CanSection(Section):
    interface: str = "socketcan"
    """A python-can interface name; `socketcan` on robots."""
    channel: Annotated[Union[str, int], BeforeValidator(_text_or_number)] = "can0"
    bitrate: Annotated[int, Field(ge=10_000, le=1_000_000)] | None = None
    """Only for adapters that python-can sets up itself; SocketCAN links come up configured."""
    options: Annotated[dict[str, Union[bool, int, float, str]], BeforeValidator(_named_values)] = {}
    """What else python-can wants to know of this interface, by its own names (`index`, ...)."""


class WheelSection(Section):
    track_m: Annotated[float, Field(gt=0.01, le=10)]
    """Distance between the left and the right wheels; for skid steering the effective one."""
    max_speed_mps: Annotated[float, Field(gt=0, le=50)] = 3.0
    """Faster is taken for a counter that was reset, not for motion."""
    reverse_left: bool = False
    reverse_right: bool = False


class GyroKeys(Section):
    """Of a base that may have a gyro; where it says nothing of one, the wheels give the heading."""

    gyro_noise_deg_per_sqrt_s: Annotated[float, Field(ge=1e-4, le=5)] = 0.03
    gyro_bias_deg_per_h: Annotated[float, Field(ge=0.1, le=10_000)] = 60.0
    """One sigma of what is left when it was calibrated; while the robot stands it is learned."""
    reverse_gyro: bool = False
    """True when it counts turns to the right."""


class SerialWheelSection(WheelSection):
    port: Port
    baud: Baud = 115_200


class KobukiSection(SerialWheelSection, GyroKeys):
    source: Literal["kobuki"]
    track_m: Annotated[float, Field(gt=0.01, le=10)] = 0.230
    max_speed_mps: Annotated[float, Field(gt=0, le=50)] = 1.0
    """Its motors give 0.7 m/s."""
    counts_per_metre: Scale = 11_724.4
    """2 pi 0.035 m at 2578.33 counts per turn (Kobuki's diff_drive)."""


class RoboteqSection(SerialWheelSection):
    source: Literal["roboteq"]
    counts_per_metre: Scale
    poll_hz: Annotated[float, Field(ge=1, le=100)] = 25.0
    swap_channels: bool = False
    """True when channel 1 drives the right wheels."""
    counter: Literal["encoder", "hall"] = "encoder"
    """What counts the turns: `?C` or, for motors with hall sensors alone, `?CB`."""


class AsciiSection(SerialWheelSection, GyroKeys):
    source: Literal["ascii"]
    counts_per_metre: Scale


class WheeltecSection(SerialWheelSection, GyroKeys):
    source: Literal["wheeltec"]

    @model_validator(mode="after")
    def _has_no_sides(self) -> WheeltecSection:
        if self.reverse_left or self.reverse_right:
            raise ValueError("a wheeltec base says what its body does and has no sides to reverse")
        return self


class CanWheelSection(WheelSection):
    can: CanSection = CanSection()


class OdriveSection(CanWheelSection):
    source: Literal["odrive"]
    left_axis: Annotated[int, Field(ge=0, le=63)]
    right_axis: Annotated[int, Field(ge=0, le=63)]
    wheel_radius_m: Annotated[float, Field(gt=0.005, le=2)]
    gear: Annotated[float, Field(gt=0, le=1000)] = 1.0
    """Motor turns per wheel turn."""


class AgilexSection(CanWheelSection, GyroKeys):
    source: Literal["agilex"]
    wheelbase_m: Annotated[float, Field(gt=0.05, le=10)] | None = None
    """Distance between the axles, for a base that says how it steers (Hunter 2.0)."""


class DbcSection(CanWheelSection, GyroKeys):
    source: Literal["dbc"]
    dbc_file: FilePath
    measures: Literal["counts", "wheel_speeds", "twist"]
    left: str = ""
    right: str = ""
    """`Message.Signal` of each side: counts, or m/s after `unit`."""
    linear: str = ""
    angular: str = ""
    """`Message.Signal` of a twist: m/s and rad/s after `unit`."""
    counts_per_metre: Scale | None = None
    counter_bits: Annotated[int, Field(ge=4, le=64)] | None = None
    """At which power of two the counters wrap; what the DBC file says of them when left out."""
    id_mask: Annotated[int, Field(ge=1, le=0x1FFFFFFF)] = 0x1FFFFFFF
    """Applied to an id before the look-up, for ids that hold a node number."""
    left_node: Annotated[int, Field(ge=0)] | None = None
    right_node: Annotated[int, Field(ge=0)] | None = None
    """Node numbers that tell the two sides apart: the bits outside `id_mask`, shifted down."""
    unit: Scale | None = None
    """Factor from the unit of the speed signals to m/s (and rad/s); what the DBC file says of its
    units when left out."""
    angular_unit: Scale | None = None
    """Factor of `angular` to rad/s; `unit` when left out."""
    reverse_angular: bool = False
    """True when the base counts turns to the right."""
    gyro: str = ""
    """`Message.Signal` of a gyro's yaw rate, where the base has one."""
    gyro_unit: Scale | None = None
    """Factor to rad/s; what the DBC file says of its unit when left out."""

    @model_validator(mode="after")
    def _signals_fit_the_measure(self) -> DbcSection:
        wanted = ("linear", "angular") if self.measures == "twist" else ("left", "right")
        missing = [name for name in wanted if getattr(self, name).count(".") != 1]
        if missing:
            raise ValueError(
                f'measures = "{self.measures}" needs {" and ".join(missing)} as "Message.Signal"'
            )
        if self.gyro and self.gyro.count(".") != 1:
            raise ValueError('gyro names a "Message.Signal"')
        if self.measures == "counts" and self.counts_per_metre is None:
            raise ValueError('measures = "counts" needs counts_per_metre')
        if self.measures == "twist" and (self.reverse_left or self.reverse_right):
            raise ValueError('measures = "twist" has no sides to reverse')
        if self.measures != "twist" and self.reverse_angular:
            raise ValueError('reverse_angular is for measures = "twist"')
        return self


Wheels = Annotated[
    Union[
        KobukiSection,
        RoboteqSection,
        AsciiSection,
        WheeltecSection,
        OdriveSection,
        AgilexSection,
        DbcSection,
    ],
    Field(discriminator="source"),
]

SOURCES: dict[str, type[WheelSection]] = {
    "kobuki": KobukiSection,
    "roboteq": RoboteqSection,
    "ascii": AsciiSection,
    "wheeltec": WheeltecSection,
    "odrive": OdriveSection,
    "agilex": AgilexSection,
    "dbc": DbcSection,
}
