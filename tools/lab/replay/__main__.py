"""tools/replay: recordings of robots once more, faster than they were made.

Exit codes: 0 done (with --check: nothing differs), 1 something differs, 2 wrong usage, 66 no usable
recording.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from drslamd import report, status_text
from lab.progress import Progress
from lab.recordings.recording import BadRecording
from lab.replay.exact import Replayed, Replayer
from lab.replay.provenance import strangers
from lab.replay.runs import Run, key_of, read_runs

DIFFERS, NO_INPUT = 1, 66

EXAMPLES = """\
examples:
  tools/replay robot-003-20261127T021545.123456-0000.lcmlog    what robot 3 knew at the end
  tools/replay recordings/ --check                             does every robot decide as it did?
  tools/replay recordings/ --key team.key                      made with a team key
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    options = _parser().parse_args(arguments)
    try:
        runs = read_runs(options.recordings)
        verdicts = [_replay(run, options.key, options.check) for run in runs]
    except BadRecording as error:
        print(error, file=sys.stderr)
        return NO_INPUT
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
    parser.add_argument(
        "--check", action="store_true", help="compare all that is done with what was done then"
    )
    parser.add_argument(
        "--key", metavar="FILE", help="the team key (default: where the robot had it)"
    )
    return parser


def _replay(run: Run, key_file: str | None, is_checked: bool) -> bool:
    """One run; is everything as it was?"""
    key = key_of(run, key_file)
    progress = Progress(f"robot {run.robot}", run.length_s())
    began = time.perf_counter()
    found = Replayer(run, key).follow(progress, is_checked)
    took = time.perf_counter() - began
    progress.end()
    print(f"{run.name}: {found.seconds:.1f} s in {took:.1f} s")
    for sentence in run.said + ([found.ended] if found.ended else []):
        print(f"  {sentence}")
    if is_checked:
        return _verdict(run, found)
    for line in status_text.lines(report.status(found.robot, found.utime)):
        print(f"  {line}")
    return True


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
