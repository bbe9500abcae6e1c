"""tools/demo: a team of real daemons, from nothing to knowing where everybody is.

Each robot is a process of its own with two pseudo-terminals, on which an emulated LinkTrack module
and an emulated wheel controller speak their true bytes; the processes gossip over multicast on
this host only. Exit codes: 0 the team is one group and at most 1.2 times as far off as dead
reckoning that was given the true start poses, 1 it is not, 2 wrong usage, 66 unusable recording,
70 a daemon failed, 73 a result cannot be written, 130 it was interrupted. What a run that failed
found stands beside what a good one found, as `demo-failed.png`.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

from drslamd.cli.view import HTTP_PORT
from drslamd.host.ending import ended_by_a_signal
from lab.files import beside_a_good_one, keep, result_file
from lab.numbers import real, whole
from lab.play import real_team
from lab.play.playback import equip
from lab.play.virtual_team import SETTLE_S
from lab.progress import Progress
from lab.recordings import world
from lab.recordings.readers import read
from lab.recordings.recording import BadRecording, Recording
from lab.score import outcome, picture, table
from lab.score.outcome import Outcome

AT_MOST = 1.2
NO_INPUT, FAILED, INTERRUPTED = 66, 70, 130
MOST_ROBOTS = 30
"""Processes that a laptop bears."""

EXAMPLES = """\
examples:
  tools/demo                             three robots, 75 s in a room of 10 m x 12 m
  tools/demo --view                      the same, on the live map in your browser
  tools/demo --seed 7 --robots 4         another world
  tools/demo --dataset run.pyfg          the same with a recording
  tools/demo --json out/demo.json        the figures for a program
"""

FOR_THE_MAP = "[near]\nhypotheses = true\n"


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    options = _parser().parse_args(arguments)
    try:
        recording = _recording(options)
    except BadRecording as error:
        print(error, file=sys.stderr)
        return NO_INPUT
    progress = Progress(f"{len(recording.trails)} daemons driving", recording.duration + SETTLE_S)
    hardware = equip(recording, varied=options.dataset is None)
    try:
        beside, extra = (live_map, FOR_THE_MAP) if options.view else (None, "")
        with ended_by_a_signal():
            result = asyncio.run(
                real_team.run(recording, hardware, extra, progress=progress, beside=beside)
            )
    except real_team.TeamFailed as error:
        print(f"\n{error}", file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        print("\ninterrupted: all daemons are stopped, nothing was written", file=sys.stderr)
        return INTERRUPTED
    progress.end()
    return _report(recording, result, options)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tools/demo",
        description="Start a team of real daemons on emulated hardware and score what they find.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--view", action="store_true", help="show it on the live map meanwhile")
    parser.add_argument("--dataset", type=Path, metavar="FILE", help="play this recording")
    parser.add_argument(
        "--seed", type=whole(), default=1, help="of the simulated world (default 1)"
    )
    parser.add_argument(
        "--robots", type=whole(2, MOST_ROBOTS), default=3, help="in the simulated world (default 3)"
    )
    parser.add_argument(
        "--seconds", type=real(5, 3600), default=75.0, help="of driving (default 75)"
    )
    parser.add_argument(
        "--png",
        type=result_file,
        default="out/demo.png",
        metavar="FILE",
        help="the picture (default out/demo.png)",
    )
    parser.add_argument("--json", type=result_file, metavar="FILE", help="write all figures there")
    return parser


def _recording(options: argparse.Namespace) -> Recording:
    if options.dataset is not None:
        return read(options.dataset)
    return world.simulate(world.Scene(options.robots, options.seconds), options.seed)


@contextlib.asynccontextmanager
async def live_map(port: int, http_port: int = HTTP_PORT) -> AsyncIterator[None]:
    """`drslamd view` of this host's team, as anybody would start it; it says its address itself.

    Args:
        port: of the team's multicast group; http_port: of the page.
    """
    flags = ("--interface", "127.0.0.1", "--port", str(port), "--http-port", str(http_port))
    process = await asyncio.create_subprocess_exec(sys.executable, "-m", "drslamd", "view", *flags)
    try:
        yield
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        await process.wait()


def _report(recording: Recording, result: Outcome, options: argparse.Namespace) -> int:
    scores = outcome.score(recording, result)
    faults = shortcomings(result, scores)
    png, figures = options.png, options.json
    if faults:
        png, figures = beside_a_good_one(png), figures and beside_a_good_one(figures)
    print(f"\n{recording.name}, {recording.duration:.0f} s")
    print("\n".join(table.lines(scores)))
    code = picture.draw(recording, result, png)
    if not code:
        print(f"picture: {png}")
    code = keep(figures, json.dumps(scores, indent=1) + "\n") or code
    for fault in faults:
        print(f"FAILED: {fault}")
    return 1 if faults else code


def shortcomings(result: Outcome, scores: dict[str, Any]) -> list[str]:
    """What was promised and not reached, in sentences."""
    if not result.is_one_team:
        frames = dict(sorted(result.frames.items()))
        return [f"the team is not one group at the end; frame of each robot: {frames}"]
    faults = []
    for key, unit in (("ate_rmse_m", "m"), ("rot_mean_deg", "degrees")):
        found, given = scores["team"][key], scores["odometry"]["team"][key]
        if found > AT_MOST * given:
            faults.append(
                f"off by {found:.3f} {unit}, more than {AT_MOST} times the {given:.3f} {unit} "
                "of dead reckoning"
            )
    return faults


if __name__ == "__main__":
    raise SystemExit(main())
