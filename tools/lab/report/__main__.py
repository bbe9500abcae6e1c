"""tools/report: run the team on a recording and write one page about it.

Exit codes: 0 done, 2 wrong usage, 66 unusable recording, 73 the page cannot be written, 78 fault in
--config.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from drslamd import __version__
from drslamd.config import ConfigError
from lab.files import keep, result_file, sections
from lab.play import edge_run, virtual_team
from lab.play.virtual_team import SETTLE_S
from lab.progress import Progress
from lab.recordings.readers import READERS, has_edges, read, read_edges
from lab.recordings.recording import BadRecording
from lab.replay import scored, truth
from lab.replay.runs import is_recording, read_runs
from lab.replay.team import gathered, play
from lab.report.evidence import gather
from lab.report.page import blind_page, edge_page, page
from lab.score import outcome

NO_INPUT, BAD_CONFIG = 66, 78

EXAMPLES = """\
examples:
  tools/report run.pyfg                           writes run.html
  tools/report run.pyfg --to out/run.html         writes it there
  tools/report recordings/ --truth mocap/         what robots recorded themselves (record = true)
  tools/report run.pyfg --config rbcd.toml        with sections added to every robot's TOML
"""


def main(arguments: list[str] | None = None) -> int:
    """Run it; the exit code."""
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        to = options.to or result_file(f"{options.recording.resolve().stem}.html")
    except argparse.ArgumentTypeError as error:
        parser.error(str(error))
    try:
        text = _report(options, sections(options.config))
    except (BadRecording, OSError) as error:
        print(error, file=sys.stderr)
        return NO_INPUT
    except ConfigError as error:
        print(error, file=sys.stderr)
        return BAD_CONFIG
    code = keep(to, text)
    if not code:
        print(to)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tools/report",
        description=f"Run the team on a recording ({', '.join(READERS)}, folder): one HTML page.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("recording", type=Path, metavar="RECORDING")
    parser.add_argument(
        "--to", type=result_file, metavar="FILE", help="the page (default RECORDING.html)"
    )
    parser.add_argument(
        "--truth",
        type=Path,
        metavar="FILE|DIR",
        help="TUM or CSV of each robot, for own recordings",
    )
    parser.add_argument("--key", metavar="FILE", help="the team key of own recordings")
    parser.add_argument("--config", type=Path, metavar="TOML", help="sections for every robot")
    return parser


def _report(options: argparse.Namespace, extra: str) -> str:
    """The page."""
    path = options.recording
    configured = "as configured" if not extra else "with the sections of --config"
    about = f"drslamd {__version__}, in virtual time, {configured}"
    if is_recording(path):
        return _own(options, extra, about)
    if has_edges(path):
        edges = read_edges(path)
        progress = Progress("rounds of optimisation, at most", edge_run.MOST_ROUNDS, "")
        result, _ = edge_run.run(edges, extra, progress)
        progress.end()
        return edge_page(edges, result, outcome.score(edges, result), about)
    recording = read(path)
    progress = Progress(f"{len(recording.trails)} robots", recording.duration + SETTLE_S)
    simulator = virtual_team.play(recording, extra=extra, progress=progress)
    progress.end()
    result = virtual_team.outcome(simulator)
    evidence, scores = gather(simulator), outcome.score(recording, result)
    return page(recording, result, evidence, scores, about)


def _own(options: argparse.Namespace, extra: str, about: str) -> str:
    """Of what a team recorded itself, with or without a truth."""
    true = truth.read(options.truth) if options.truth else None
    team = gathered(read_runs([options.recording]))
    progress = Progress(f"{len(team.robots)} robots", team.duration_s)
    played = play(team, extra, options.key, progress)
    progress.end()
    result, evidence = virtual_team.outcome(played), gather(played)
    name = options.recording.resolve().name
    if true is None:
        return blind_page(name, result, evidence, team.duration_s, about)
    recording = scored.as_recording(name, team, played, true)
    scores = outcome.score(recording, result)
    return page(recording, result, evidence, scores, about, starts_at_zero=False)


if __name__ == "__main__":
    raise SystemExit(main())
