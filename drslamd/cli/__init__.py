"""The command ``drslamd``: one file for each verb.

Exit codes: 0 done, 1 something that doctor or calibrate found, 64 wrong usage, 69 no daemon or
sensor answers, or a package is missing (view: or its port is taken), 70 a bug of ours, 73 a file
that cannot be made, or an output that takes no more, 75 another daemon already runs, 78 an unusable
set-up.
"""

from __future__ import annotations

import argparse
import sys

from drslamd import __version__
from drslamd.host.loading import without_openssl

with without_openssl():
    from drslamd.cli import (
        check,
        doctor,
        export,
        feed,
        keygen,
        record,
        run,
        status,
        trajectory,
        view,
    )
    from drslamd.cli.exit_codes import BAD_CONFIG, BUG, CANNOT_CREATE
    from drslamd.cli.parser import Parser
    from drslamd.cli.setting_up import calibrate, init
    from drslamd.config import ConfigError
    from drslamd.host.ending import in_order

EXAMPLES = """\
examples:
  drslamd init                               what is plugged in becomes a configuration
  drslamd keygen /etc/drslamd/team.key       a secret for the team; copy it to every robot
  drslamd check -c /etc/drslamd/3.toml       would it run here, and if not, why?
  drslamd run -c /etc/drslamd/3.toml         the daemon (systemd: drslamd@3)
  drslamd status -c /etc/drslamd/3.toml      what it hears, and why it is not localised
  drslamd calibrate -c /etc/drslamd/3.toml   push it a metre, turn it once: scale and track
  drslamd doctor -c /etc/drslamd/3.toml      what is wrong, since when, what to do
  drslamd view --interface wlan0             the team on a live map, in a browser
  drslamd trajectory -c /etc/drslamd/3.toml --tum out/
  drslamd export -c /etc/drslamd/3.toml --to out/ --format csv mcap
  drslamd feed foxglove -c /etc/drslamd/3.toml   pose and peers, live, for other programs
  drslamd record run.lcmlog --interface wlan0   what all robots say, for LCM tools

exit codes: 0 done, 1 doctor or calibrate found something, 64 wrong usage, 69 no daemon or sensor
answers or a package is missing (view: or its port is taken), 70 a bug, 73 a file or the output
cannot be written, 75 another daemon already runs, 78 the set-up cannot be used
"""

VERBS = (
    init,
    run,
    check,
    calibrate,
    doctor,
    status,
    view,
    trajectory,
    export,
    feed,
    record,
    keygen,
)


def main(arguments: list[str] | None = None) -> int:
    """Run one verb; its exit code."""
    return in_order(lambda: _main(arguments), unwritable=CANNOT_CREATE, bug=BUG)


def _main(arguments: list[str] | None) -> int:
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
