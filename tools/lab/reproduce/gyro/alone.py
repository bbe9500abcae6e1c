"""One robot and its gyro, without a team: how soon a wrong gyro is named, and what it costs.

usage: python -m lab.reproduce.gyro.alone [--seeds N]

The wheels and gyros of `gyro_rows`, read by one `WheelInput` each, in a second a seed where the
team takes ten minutes. The cost is that of the turn over 40 s, the longest window of module 1, as
root mean square over all windows that neither begin nor end between the fault and its name: what
was told meanwhile is given back when the gyro is found wrong.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drslamd.sensors.wheels.wheel_input import WheelInput
from lab.numbers import whole
from lab.play.playback import equip, robot_config
from lab.progress import Progress
from lab.recordings import world
from lab.recordings.recording import Array
from lab.reproduce.experiment import trial
from lab.reproduce.gyro.gyro_rows import CASES, FAULTY, KEYS, NAMED_WITHIN_S, Case, slipping
from lab.score import metrics

WINDOW_S = 40
START_S = 100.0
"""Of the clock of the host, so that no time of it is zero."""
HEAD = "| | named s, median | worst | never | turn over 40 s, deg | against no gyro |"
RULE = "| --- | --- | --- | --- | --- | --- |"


@dataclass(frozen=True)
class Drive:
    """Of one case and one seed.

    Attributes:
        off: (n,) rad, by how much the heading is off at each whole second.
        named_s: s after it went wrong, infinite where it was not named.
    """

    off: Array
    named_s: float


def drive(case: Case, seed: int) -> Drive:
    """One robot with what the case has."""
    plain = trial(seed)
    recording = world.with_gyros(plain.recording, seed) if case.has_gyro else plain.recording
    hardware = equip(recording)[FAULTY]
    if case.wrong is not None:
        hardware.gyro_wiring = case.wrong()
    if case.slips:
        hardware.wiring = slipping
    wheels = WheelInput(robot_config(hardware, KEYS if case.has_gyro else "").wheels)
    t, headings, named = [0.0], [0.0], np.inf
    for chunk in hardware.wheel_chunks():
        now = round((START_S + chunk.t) * 1e6)
        for motion in wheels.feed(chunk.printed(), now):
            t.append(motion.utime / 1e6 - START_S)
            headings.append(headings[-1] + motion.turn_rad)
        is_named = wheels.gyro.slips(now) if case.slips else wheels.gyro.fault(now) is not None
        if is_named and chunk.t >= case.since_s:
            named = min(named, chunk.t - case.since_s)
    trail = hardware.trail
    seconds = np.arange(1.0, int(trail.t[-1]))
    truth = np.interp(seconds, trail.t, np.unwrap(trail.truth[:, 2]))
    return Drive(np.interp(seconds, t, headings) - truth, float(named))


def windows(drive: Drive, since_s: float, named_s: float) -> Array:
    """(w,) rad, errors of the turn over windows that count."""
    ends = np.arange(1.0, len(drive.off) + 1)
    # a second until the gyro was named, and one in which it is given back
    is_between = (ends >= since_s) & (ends <= since_s + named_s + 2)
    counts = (ends >= since_s)[WINDOW_S:] & ~is_between[WINDOW_S:] & ~is_between[:-WINDOW_S]
    return np.asarray(metrics.wrapped(drive.off[WINDOW_S:] - drive.off[:-WINDOW_S])[counts])


def line(case: Case, drives: Sequence[Drive], without: Sequence[Drive]) -> tuple[str, bool]:
    """A row of the table, and is everything reached?

    Args:
        without: of the same seeds, of robots without a gyro.
    """
    asked = case.wrong is not None or (case.slips and case.has_gyro)
    spans = [(case.since_s, d.named_s if asked and np.isfinite(d.named_s) else 0.0) for d in drives]
    cost, usual = (_rms(each, spans) for each in (drives, without))
    named = np.array([d.named_s for d in drives])
    told = [f"{np.median(named):.1f}", f"{named.max():.1f}", f"{np.sum(~np.isfinite(named))}"]
    ratio = round(cost / usual, 2)
    cells = [*(told if asked else ["-"] * 3), f"{np.degrees(cost):.2f}", f"{ratio:.2f}"]
    is_reached = not asked or (bool(named.max() <= NAMED_WITHIN_S) and ratio <= 1.0)
    return f"| {case.name} | {' | '.join(cells)} |", is_reached


def _rms(drives: Sequence[Drive], spans: Sequence[tuple[float, float]]) -> float:
    errors = [windows(each, *span) for each, span in zip(drives, spans, strict=True)]
    return float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; 1 when something is not reached."""
    parser = argparse.ArgumentParser(
        prog="lab.reproduce.gyro.alone", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--seeds", type=whole(1), default=20, metavar="N", help="default 20")
    options = parser.parse_args(arguments)
    cases = [case for case in CASES if case.has_gyro or not case.slips]
    drives: dict[str, list[Drive]] = {case.name: [] for case in cases}
    bar = Progress("drives", options.seeds * len(cases), "drives")
    for seed in range(options.seeds):
        for k, case in enumerate(cases):
            drives[case.name].append(drive(case, seed))
            bar(seed * len(cases) + k + 1)
    bar.end()
    rows = [line(case, drives[case.name], drives["none"]) for case in cases]
    print("\n".join([HEAD, RULE, *(text for text, _ in rows)]))
    return 0 if all(is_reached for _, is_reached in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
