"""``drslamd export``: what a robot knows of the team, as files that other tools open."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from drslamd.cli.exit_codes import CANNOT_CREATE, OK, UNAVAILABLE
from drslamd.cli.parser import Verbs, configured_verb
from drslamd.host.unmade import unmade

QUESTIONS = {
    "tum": ("trajectory",),
    "g2o": ("graph",),
    "pyfg": ("graph",),
    "csv": ("graph",),
    "mcap": ("graph", "trajectory", "status"),
    "geojson": ("trajectory",),
}
"""What a daemon is asked for each format."""

EXAMPLES = """\
  drslamd export -c /etc/drslamd/3.toml --to out/ --format tum      for evo
  drslamd export -c /etc/drslamd/3.toml --to out/ --format g2o pyfg csv
  drslamd export -c /etc/drslamd/3.toml --to out/ --format mcap     ROS 2 types, for Foxglove

formats:
  tum     robotN.txt, everybody's path in the frame of the team
  g2o     graph.g2o and keyframes.csv, solved keyframes, odometry, closures
  pyfg    graph.pyfg, the same with ranges
  csv     keyframes, odometry, closures, ranges, windows (each answer of module 1), poses
  mcap    team.mcap with tf, odometry, poses with covariance, paths, diagnostics (pip install
          "drslamd[export]")
  geojson team.geojson, paths and modules by longitude and latitude, for QGIS and web maps; needs
          [[beacon]] with latitude_deg and longitude_deg

All times are UNIX time; a sentence says how wrong they may be where that matters."""


def add(verbs: Verbs) -> None:
    """Add the verb."""
    export = configured_verb(
        verbs, "export", _export, "write what a robot knows for other tools", EXAMPLES
    )
    export.add_argument("--to", required=True, type=Path, metavar="DIR", help="write there")
    export.add_argument(
        "--format", required=True, nargs="+", choices=tuple(QUESTIONS), help="one or more"
    )


def _export(options: argparse.Namespace) -> int:
    from drslamd.cli.ask import ask_daemon  # what needs the daemon takes its time to load

    answers: dict[str, Any] = {}
    for question in dict.fromkeys(q for name in options.format for q in QUESTIONS[name]):
        answer = ask_daemon(options.config, question)
        if answer is None:
            return UNAVAILABLE
        if "error" in answer:
            print(f"the daemon is of an older version: {answer['error']}", file=sys.stderr)
            return UNAVAILABLE
        answers[question] = answer
    return _write(options, answers)


def _write(options: argparse.Namespace, answers: dict[str, Any]) -> int:
    from drslamd.export.formats import CannotWrite, write
    from drslamd.export.stamps import complaints

    said = answers.get("graph") or answers["trajectory"]
    clocks = (
        said["clocks"] if "clocks" in said else {r: p["clock"] for r, p in said["robots"].items()}
    )
    for sentence in complaints(said, clocks):
        print(sentence, file=sys.stderr)
    if said["frame"] is None:
        print("this robot is not localised: there are no paths and no graph yet", file=sys.stderr)
    written: dict[Path, None] = {}
    unwritten = []
    for name in options.format:
        try:
            written.update(dict.fromkeys(write(name, options.to, answers)))
        except CannotWrite as error:
            unwritten.append(error)
        except OSError as error:
            print(unmade(options.to, error), file=sys.stderr)
            return CANNOT_CREATE
    print("".join(f"{path}\n" for path in written), end="")
    for fault in unwritten:
        print(fault, file=sys.stderr)
    return UNAVAILABLE if unwritten else OK
