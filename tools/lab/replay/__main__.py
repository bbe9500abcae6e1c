"""tools/replay: recordings of robots once more, faster than they were made.

Exit codes: 0 done (with --check: nothing differs), 1 something differs, 2 wrong usage, 66 no usable
recording, 78 fault in --config.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from pathlib import Path

from drslamd import report
from drslamd.config import ConfigError
from drslamd.reports import status_text
from lab.numbers import real
from lab.progress import Progress
from lab.recordings.recording import BadRecording
from lab.replay.exact import Replayed, Replayer
from lab.replay.provenance import strangers
from lab.replay.runs import Run, key_of, read_runs
from lab.replay.team import gathered, play

DIFFERS, NO_INPUT, BAD_CONFIG = 1, 66, 78

EXAMPLES = """\
examples:
  tools/replay robot-003-20261127T021545.123456-0000.lcmlog    what robot 3 knew at the end
  tools/replay recordings/ --at 63.5                           and what 63.5 s after it began?
  tools/replay recordings/ --check                             does every robot decide as it did?
  tools/replay recordings/ --config other.toml                 what if?
  tools/replay recordings/ --key team.key                      made with a team key
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    options = _parser().parse_args(arguments)
    try:
        runs = read_runs(options.recordings)
        if options.config is not None:
            return _what_if(runs, options.config.read_text(), options.key)
        verdicts = [_replay(run, options) for run in runs]
    except (BadRecording, OSError, UnicodeDecodeError) as error:
        print(error, file=sys.stderr)
        return NO_INPUT
    except ConfigError as error:
        for fault in error.faults:
            print(f"{options.config}: {fault}", file=sys.stderr)
        return BAD_CONFIG
    return 0 if all(verdicts) else DIFFERS


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tools/replay",
        description="Replay what robots recorded (`record = true` in their configuration).",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "recordings", type=Path, nargs="+", metavar="LOG|FOLDER", help="files, or folders of them"
    )
    what = parser.add_mutually_exclusive_group()
    what.add_argument(
        "--check", action="store_true", help="compare all that is done with what was done then"
    )
    what.add_argument(
        "--config", type=Path, metavar="TOML", help="what if these keys had been set?"
    )
    what.add_argument(
        "--at", type=real(), metavar="S", help="what was known S seconds after the beginning?"
    )
    parser.add_argument(
        "--key", metavar="FILE", help="the team key (default: where the robot had it)"
    )
    return parser


def _replay(run: Run, options: argparse.Namespace) -> bool:
    """One run; is everything as it was?"""
    key, is_checked = key_of(run, options.key), options.check
    if is_checked and not run.is_whole:
        print(f"{run.name}: cannot be compared: the first files of this run are gone")
        return False
    until = math.inf if options.at is None else options.at
    progress = Progress(f"robot {run.robot}", min(run.length_s(), until))
    began = time.perf_counter()
    found = Replayer(run, key).follow(progress, is_checked, until)
    took = time.perf_counter() - began
    progress.end()
    print(f"{run.name}: {found.seconds:.1f} s in {took:.1f} s")
    for sentence in run.said + ([found.ended] if found.ended else []):
        print(f"  {sentence}")
    if not run.is_whole:
        print("  the robot began in the middle of the run: its first files are gone")
    if is_checked:
        return _verdict(run, found)
    for line in status_text.lines(report.status(found.robot, found.utime)):
        print(f"  {line}")
    return True


def _what_if(runs: list[Run], extra: str, key_file: str | None) -> int:
    """All runs together, as they would have been."""
    team = gathered(runs)
    progress = Progress(f"{len(team.robots)} robots", team.duration_s)
    played = play(team, extra, key_file, progress)
    progress.end()
    for sentence in team.said():
        print(sentence)
    for robot, member in sorted(played.members.items()):
        now = member.clock.local(played.now)
        print(f"robot {robot}, what if:")
        for line in status_text.lines(report.status(member.robot, now)):
            print(f"  {line}")
    return 0


def _verdict(run: Run, found: Replayed) -> bool:
    if found.difference is None:
        print(
            f"  the same: {found.events} events, {found.sends} messages, "
            f"{found.jobs} computations, bit for bit"
        )
        return True
    print(f"  differs at {found.difference.at_s:.3f} s: {found.difference.what}")
    for sentence in strangers(run.opening.provenance):
        print(f"  {sentence}")
    return False


if __name__ == "__main__":
    raise SystemExit(main())
