"""``drslamd trajectory``: everybody's path in the frame of the team."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from drslamd.cli.ask import ask_daemon
from drslamd.cli.exit_codes import CANNOT_CREATE, OK, UNAVAILABLE
from drslamd.cli.parser import Verbs, configured_verb
from drslamd.host.unmade import unmade


def add(verbs: Verbs) -> None:
    """Add the verb."""
    trajectory = configured_verb(
        verbs,
        "trajectory",
        _trajectory,
        "everybody's path in the team's frame",
        "  drslamd trajectory -c /etc/drslamd/3.toml --tum out/",
    )
    trajectory.add_argument(
        "--tum", metavar="DIR", help="write one TUM file per robot there, in UNIX time"
    )


def _trajectory(options: argparse.Namespace) -> int:
    answer = ask_daemon(options.config, "trajectory")
    if answer is None:
        return UNAVAILABLE
    if options.tum is None:
        print(json.dumps(answer))
        return OK
    from drslamd.export.stamps import complaints
    from drslamd.export.tum_files import write

    clocks = {robot: path["clock"] for robot, path in answer["robots"].items()}
    for sentence in complaints(answer, clocks):
        print(sentence, file=sys.stderr)
    try:
        for path in write(Path(options.tum), answer):
            print(path)
    except OSError as error:
        print(unmade(options.tum, error), file=sys.stderr)
        return CANNOT_CREATE
    return OK
