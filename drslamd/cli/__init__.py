"""The command ``drslamd``: one file for each verb.

Exit codes: 0 done, 64 wrong usage, 69 no daemon answers, 70 a bug of ours, 73 a file that cannot
be made, 78 a configuration that cannot be used.
"""

from __future__ import annotations

import argparse
import sys

from drslamd import __version__
from drslamd.cli import check, keygen, record, run, status, trajectory
from drslamd.cli.exit_codes import BAD_CONFIG
from drslamd.cli.parser import Parser
from drslamd.config import ConfigError

EXAMPLES = """\
examples:
  drslamd keygen /etc/drslamd/team.key       a secret for the team; copy it to every robot
  drslamd check -c /etc/drslamd/3.toml       is the configuration right?
  drslamd run -c /etc/drslamd/3.toml         the daemon (systemd: drslamd@3)
  drslamd status -c /etc/drslamd/3.toml      what it hears, and why it is not localised
  drslamd trajectory -c /etc/drslamd/3.toml --tum out/
  drslamd record run.lcmlog --interface wlan0   what all robots say, for LCM tools

exit codes: 0 done, 64 wrong usage, 69 no daemon answers, 70 a bug, 73 a file cannot be made,
78 the configuration cannot be used
"""

VERBS = (run, check, status, trajectory, record, keygen)


def main(arguments: list[str] | None = None) -> int:
    """Run one verb; its exit code."""
    options = parser().parse_args(arguments)
    try:
        return int(options.verb(options))
    except ConfigError as error:
        for fault in error.faults:
            print(f"{options.config}: {fault}", file=sys.stderr)
        return BAD_CONFIG


def parser() -> argparse.ArgumentParser:
    """All verbs and their options."""
    parser = Parser(
        prog="drslamd",
        description="Where is everybody? UWB ranges and wheel odometry, no anchors.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"drslamd {__version__}")
    verbs = parser.add_subparsers(required=True, metavar="VERB")
    for verb in VERBS:
        verb.add(verbs)
    return parser
