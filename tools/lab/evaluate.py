"""tools/evaluate: run the team on a recording and write its scores.

Exit codes: 0 done, 2 wrong usage, 66 unusable recording, 70 a daemon failed, 78 fault in --config.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import sys
from pathlib import Path

from drslamd.config import ConfigError
from lab.files import keep, result_file, sections
from lab.play import edge_run, real_team, virtual_team
from lab.play.virtual_team import SETTLE_S
from lab.progress import Progress
from lab.recordings.readers import READERS, has_edges, read, read_edges
from lab.recordings.recording import BadRecording, EdgeRecording, Recording
from lab.replay import scored, truth
from lab.replay.complaints import Complaints
from lab.replay.runs import is_recording, read_runs
from lab.replay.team import gathered, play
from lab.score import outcome, reasons, table
from lab.score.outcome import Outcome

NO_INPUT, FAILED, BAD_CONFIG = 66, 70, 78

EXAMPLES = """\
examples:
  tools/evaluate run.pyfg                         in virtual time, scores as a table
  tools/evaluate run.pyfg --json scores.json      and as JSON (schema: tools/README.md)
  tools/evaluate run.pyfg --speed real            real processes, pseudo-terminals, multicast
  tools/evaluate swust_three_robots               a folder of relative poses: modules 2 and 3 only
  tools/evaluate recordings/ --truth mocap/       what robots recorded themselves (record = true)
  tools/evaluate run.pyfg --config rbcd.toml      with sections added to every robot's TOML
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    options = _parser().parse_args(arguments)
    try:
        extra = sections(options.config)
        recording: Recording | EdgeRecording
        if is_recording(options.recording):
            return _evaluate_own(options, extra)
        if has_edges(options.recording):
            recording = read_edges(options.recording)
            result = _run_edges(recording, extra)
        else:
            recording = read(options.recording)
            result = _run(recording, options.speed, extra)
    except (BadRecording, OSError) as error:
        print(error, file=sys.stderr)
        return NO_INPUT
    except ConfigError as error:
        print(error, file=sys.stderr)
        return BAD_CONFIG
    except real_team.TeamFailed as error:
        print(error, file=sys.stderr)
        return FAILED
    scores = outcome.score(recording, result)
    print("\n".join([*table.lines(scores), *reasons.lines(result.status)]))
    return keep(options.json, json.dumps(scores, indent=1) + "\n")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tools/evaluate",
        description=f"Run the team on a recording ({', '.join(READERS)}, folder) and score it.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("recording", type=Path, metavar="RECORDING")
    parser.add_argument("--json", type=result_file, metavar="FILE", help="write all figures there")
    parser.add_argument("--speed", choices=("real", "virtual"), default="virtual")
    parser.add_argument(
        "--truth",
        type=Path,
        metavar="FILE|DIR",
        help="TUM or CSV of each robot, for own recordings",
    )
    parser.add_argument("--key", metavar="FILE", help="the team key of own recordings")
    parser.add_argument("--config", type=Path, metavar="TOML", help="sections for every robot")
    return parser


def _evaluate_own(options: argparse.Namespace, extra: str) -> int:
    """What a team recorded itself; the exit code.

    Raises: as of `main`.
    """
    true = truth.read(options.truth) if options.truth else None
    team = gathered(read_runs([options.recording]))
    progress = Progress(f"{len(team.robots)} robots", team.duration_s)
    complaints = Complaints()
    played = play(team, extra, options.key, progress, complaints.note)
    progress.end()
    result, name = virtual_team.outcome(played), options.recording.name
    if true is None:
        scores = scored.without_truth(name, result.status)
        lines = [
            f"robot {robot}: {text}" for robot, text in sorted(scored.places(result.status).items())
        ]
    else:
        recording = scored.as_recording(name, team, played, true)
        scores = outcome.score(recording, result)
        lines = table.lines(scores)
    why = reasons.lines(result.status, complaints.lasted())
    print("\n".join([*team.said(), *lines, *why]))
    return keep(options.json, json.dumps(scores, indent=1) + "\n")


def _run(recording: Recording, speed: str, extra: str) -> Outcome:
    progress = Progress(f"{len(recording.trails)} robots", recording.duration + SETTLE_S)
    if speed == "real":
        result = asyncio.run(real_team.run(recording, extra=extra, progress=progress))
    else:
        result = virtual_team.run(recording, extra=extra, progress=progress)
    progress.end()
    return result


def _run_edges(recording: EdgeRecording, extra: str) -> Outcome:
    progress = Progress("rounds of optimisation, at most", edge_run.MOST_ROUNDS, "")
    result, _ = edge_run.run(recording, extra, progress)
    progress.end()
    return result


if __name__ == "__main__":
    raise SystemExit(main())
