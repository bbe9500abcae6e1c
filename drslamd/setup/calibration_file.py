"""The file of what a tape said: written by ``drslamd calibrate``, named by `robot.calibration`.

    [robot]
    id = 3
    [wheels]                     # as configured when they were measured
    source = "kobuki"
    track_m = 0.23
    [push]                       # the wheels say this share too much
    scale = 0.012
    sigma = 0.0053
    [turn]                       # turns are longer than the wheels say, by this share
    turn = -0.031
    sigma = 0.007
    [bias.7]                     # ranges to robot 7 are so much too long
    bias_m = 0.11
    sigma_m = 0.08

It is read as if a stranger had written it: bounded in size and in every number. What was measured
with other wheels, or on another robot, says nothing here.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import tomli

from drslamd.config import Config
from drslamd.config_faults import one_line
from drslamd.conventions import ROBOT_NAMES
from drslamd.setup.taped_steps import MOST_BIAS_M, MOST_FACTOR, turn_implied
from drslamd.setup.wheel_scales import as_configured, has_two_sides
from drslamd.slam.calibration.sensor_calibration import SensorCalibration
from drslamd.slam.graph.estimate import Learned

MAX_BYTES: Final = 64 * 1024
"""Biases of 254 peers are a third of it."""
LEAST_SIGMA, MOST_SIGMA = 1e-4, 0.5
"""No tape is better, and nothing that is worse is worth a file."""
LEAST_SCALE, MOST_SCALE = 1 - MOST_FACTOR, 1 - 1 / MOST_FACTOR
LEAST_TURN, MOST_TURN = 1 / MOST_FACTOR - 1, MOST_FACTOR - 1
ROUNDED: Final = 6
"""Digits behind the point."""


class UnusableCalibration(Exception):
    """One sentence, without the name of the file: the fault; what to do."""


def _damaged(fault: str) -> UnusableCalibration:
    return UnusableCalibration(f"{fault}; remove it and measure anew: drslamd calibrate")


@dataclass(frozen=True)
class Taped:
    """What was measured so far.

    Attributes:
        wheels: keys of ``[wheels]`` as they were when `push` and `turn` were measured.
        push: scale of ways; turn: by which fraction turns are longer.
        biases: by robot, m.
    """

    robot: int
    wheels: Mapping[str, Any] = field(default_factory=dict)
    push: Learned | None = None
    turn: Learned | None = None
    biases: Mapping[int, Learned] = field(default_factory=dict)

    def calibration(self, config: Config) -> SensorCalibration:
        """As it is used.

        Raises:
            UnusableCalibration: it was measured on another robot, or with other wheels.
        """
        if self.robot != config.robot.id:
            raise UnusableCalibration(
                f"it is of robot {self.robot}, not {config.robot.id}; measure this one: "
                "drslamd calibrate"
            )
        has_wheels = self.push is not None or self.turn is not None
        if has_wheels and (changed := self.changed(config)):
            raise UnusableCalibration(
                f"it was measured with {changed}; measure again: drslamd calibrate push"
            )
        turn = self.turn
        if turn is None and self.push is not None and has_two_sides(config.wheels):
            turn = turn_implied(self.push)
        nothing = Learned()
        return SensorCalibration(
            scale=self.push or nothing, turn=turn or nothing, bias=dict(self.biases)
        )

    def changed(self, config: Config) -> str:
        """A key of the wheels that is not as it was, in words; empty when all are."""
        now = as_configured(config.wheels)
        for key in sorted(now.keys() | self.wheels.keys()):
            # what a gyro tells is held against the wheels, and changes nothing of theirs
            if "gyro" not in key and now.get(key) != self.wheels.get(key):
                before, after = (_value(t.get(key)) for t in (self.wheels, now))
                return f"wheels.{key} = {before}, which is now {after}"
        return ""

    def with_wheels(self, config: Config) -> Taped:
        """Ready for a new measurement: those with other wheels are forgotten."""
        if not self.changed(config):
            return self
        return replace(self, wheels=as_configured(config.wheels), push=None, turn=None)


def text(taped: Taped) -> str:
    """The file."""
    lines = [
        "# What a tape says of this robot, made by drslamd calibrate; robot.calibration names it.",
        "# It counts as long as [wheels] is as it was.",
        "",
        "[robot]",
        f"id = {taped.robot}",
    ]
    if taped.wheels:
        lines += ["", "[wheels]", *(f"{k} = {json.dumps(v)}" for k, v in taped.wheels.items())]
    for name, key, what, learned in (
        ("push", "scale", "the share by which ways come out too long", taped.push),
        ("turn", "turn", "the share by which turns are longer than they come out", taped.turn),
    ):
        if learned is not None:
            lines += ["", f"[{name}]", f"{_number(key, learned.value)}  # {what}"]
            lines += [_number("sigma", learned.sigma)]
    for peer, bias in sorted(taped.biases.items()):
        lines += ["", f"[bias.{peer}]"]
        lines += [f"{_number('bias_m', bias.value)}  # ranges to robot {peer} are so much too long"]
        lines += [_number("sigma_m", bias.sigma)]
    return "\n".join(lines) + "\n"


def read(file_text: str) -> Taped:
    """What `text` gave; anything may be given.

    Raises:
        UnusableCalibration: it is no such file.
    """
    try:
        whole = tomli.loads(file_text)
    except (ValueError, RecursionError) as error:
        reason = one_line(str(error)) if isinstance(error, tomli.TOMLDecodeError) else "a number"
        raise _damaged(f"not valid TOML: {reason}") from None
    unknown = whole.keys() - {"robot", "wheels", "push", "turn", "bias"}
    if unknown:
        raise _damaged(f"{min(unknown)[:40]!r}: unknown section")
    robot = _table(whole, "robot").get("id")
    if isinstance(robot, bool) or not isinstance(robot, int) or str(robot) not in ROBOT_NAMES:
        raise _damaged("robot.id: missing, or no id of a robot")
    biases = _table(whole, "bias")
    if not biases.keys() <= ROBOT_NAMES:
        raise _damaged("bias: its sections are named by ids of robots")
    return Taped(
        robot,
        _table(whole, "wheels"),
        _learned(whole, "push", ("scale", LEAST_SCALE, MOST_SCALE), "sigma"),
        _learned(whole, "turn", ("turn", LEAST_TURN, MOST_TURN), "sigma"),
        {
            int(peer): value
            for peer in biases
            if (value := _learned(biases, peer, ("bias_m", -MOST_BIAS_M, MOST_BIAS_M), "sigma_m"))
        },
    )


def _learned(
    tables: Mapping[str, Any], name: str, key: tuple[str, float, float], sigma: str
) -> Learned | None:
    if name not in tables:
        return None
    table = _table(tables, name)
    value = _bounded(table, name, *key)
    return Learned(value, _bounded(table, name, sigma, LEAST_SIGMA, MOST_SIGMA))


def _table(tables: Mapping[str, Any], name: str) -> dict[str, Any]:
    table = tables.get(name, {})
    if not isinstance(table, dict):
        raise _damaged(f"{name}: a section")
    return table


def _bounded(table: Mapping[str, Any], name: str, key: str, least: float, most: float) -> float:
    value = table.get(key)
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not is_number or not least <= value <= most:  # type: ignore[operator]
        raise _damaged(f"{name}.{key}: a number, at least {least:g} and at most {most:g}")
    return float(value)  # type: ignore[arg-type]


def _number(key: str, value: float) -> str:
    return f"{key} = {round(value, ROUNDED)!r}"


def _value(value: object) -> str:
    return "not set" if value is None else json.dumps(value, default=str)[:40]
