"""The steps of ``drslamd calibrate``: say what to do, wait until it is done, say what it means."""

from __future__ import annotations

import argparse
import asyncio
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple, Union

from drslamd.cli.setting_up.measuring import NotMeasured, Seen, measured_ranges, measured_way
from drslamd.config import Config
from drslamd.setup.calibration_file import Taped
from drslamd.setup.taped_steps import (
    Mistake,
    bias_of_distance,
    scale_of_push,
    turn_of_turns,
)
from drslamd.setup.way import Phase, Way
from drslamd.slam.tuning import DEFAULTS

RANGES_S = 10.0


class Done(NamedTuple):
    """A step that went well: the file with it, its numbers, and lines for a person."""

    taped: Taped
    numbers: dict[str, Any]
    lines: list[str]


Result = Union[Done, NotMeasured, Mistake]


def _push(options: argparse.Namespace, config: Config, taped: Taped) -> Result:
    metres: float = options.metres
    _say(
        f"push: let the robot stand, mark where it is, push it {metres:g} m ahead along a line, "
        "and let it stand there."
    )
    way = _way(options, config)
    if isinstance(way, NotMeasured):
        return way
    scale = scale_of_push(way, metres, config.wheels)
    if isinstance(scale, Mistake):
        return scale
    long = "long" if scale.value > 0 else "short"
    lines = [
        f"push: {_sides(way)}, straight {way.chord_m:.3f} m; by the tape {metres:g} m",
        f"  ways come out {_percent(scale.value)} too {long}, +- {_percent(scale.sigma)}",
    ]
    numbers = {**_numbers(way), "metres": metres, "scale": scale.value, "sigma": scale.sigma}
    return Done(replace(taped.with_wheels(config), push=scale), numbers, lines)


def _turn(options: argparse.Namespace, config: Config, taped: Taped) -> Result:
    turns: float = options.turns
    _say(
        f"turn: let the robot stand, mark where it points, turn it left on the spot {turns:g} "
        "time(s) until it points there again, and let it stand."
    )
    way = _way(options, config)
    if isinstance(way, NotMeasured):
        return way
    turn = turn_of_turns(way, turns, config.wheels)
    if isinstance(turn, Mistake):
        return turn
    longer = "longer" if turn.value > 0 else "shorter"
    error = f"{_percent(turn.value)} {longer} than that, +- {_percent(turn.sigma)}"
    lines = [
        f"turn: {_sides(way)}, {math.degrees(way.turn_rad):.1f} degrees; turned {360 * turns:g}",
        f"  turns are {error}",
    ]
    numbers = {**_numbers(way), "turns": turns, "turn": turn.value, "sigma": turn.sigma}
    return Done(replace(taped.with_wheels(config), turn=turn), numbers, lines)


def _apart(options: argparse.Namespace, config: Config, taped: Taped) -> Result:
    metres, peer = options.metres, options.peer
    uwb_id = peer if options.peer_uwb is None else options.peer_uwb
    _say(
        f"apart: let this robot and robot {peer} stand with their antennas {metres:g} m apart, "
        f"in free sight; ranges are collected for {RANGES_S:g} s."
    )
    shown = _Line()
    seconds = min(RANGES_S, options.within)
    ranges = asyncio.run(
        measured_ranges(config, uwb_id, seconds, lambda s: shown(f"{s:.0f} of {seconds:.0f} s"))
    )
    shown.end()
    if isinstance(ranges, NotMeasured):
        return ranges
    nlos_db = config.relative_pose.nlos_db
    bias = bias_of_distance(ranges, metres, nlos_db, DEFAULTS.ranges)
    if isinstance(bias, Mistake):
        return bias
    long = "long" if bias.value > 0 else "short"
    lines = [
        f"apart: {len(ranges)} ranges to robot {peer}",
        f"  they are {abs(bias.value):.3f} m too {long}, +- {bias.sigma:.3f} m",
    ]
    numbers = {"peer": peer, "metres": metres, "ranges": len(ranges)}
    numbers |= {"bias_m": bias.value, "sigma_m": bias.sigma}
    return Done(replace(taped, biases={**taped.biases, peer: bias}), numbers, lines)


MEASURES: dict[str, Callable[[argparse.Namespace, Config, Taped], Result]] = {
    "push": _push,
    "turn": _turn,
    "apart": _apart,
}


class _Line:
    """One line of a terminal that is written again and again; nothing elsewhere."""

    def __init__(self) -> None:
        self._is_terminal = sys.stderr.isatty()

    def __call__(self, text: str) -> None:
        if self._is_terminal:
            print(f"\r\x1b[K  {text}", end="", file=sys.stderr, flush=True)

    def end(self) -> None:
        self("")


def _way(options: argparse.Namespace, config: Config) -> Union[Way, NotMeasured]:
    shown, phases = _Line(), {Phase.STANDING: "go", Phase.ENDED: "stands"}
    said: set[Phase] = set()

    def tell(seen: Seen) -> None:
        if seen.phase in phases and seen.phase not in said:
            said.add(seen.phase)
            shown.end()
            _say(f"  {phases[seen.phase]}")
        way = seen.way
        turned = math.degrees(way.turn_rad)
        shown(f"{_sides(way)}, turned {turned:.0f} degrees")

    way = asyncio.run(measured_way(config, options.within, tell))
    shown.end()
    return way


def _numbers(way: Way) -> dict[str, float]:
    return {
        "left_m": way.left_m,
        "right_m": way.right_m,
        "distance_m": way.distance_m,
        "turn_rad": way.turn_rad,
    }


def _sides(way: Way) -> str:
    return f"left {way.left_m:.3f} m, right {way.right_m:.3f} m"


def _percent(share: float) -> str:
    return f"{100 * abs(share):.1f} %"


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
